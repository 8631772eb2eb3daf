# SPDX-License-Identifier: MIT
"""The compiled application as files: C through the templates, and the model file for the host tools."""

from __future__ import annotations

import functools
import hashlib
import itertools
import os
import re
from dataclasses import dataclass
from pathlib import Path

import jinja2

from canopy import __version__
from canopy.compiler import codec
from canopy.compiler.binding import bind
from canopy.compiler.bounds import Others
from canopy.compiler.budget import Budget, make_budget
from canopy.compiler.bus_reader import Bus, read_bus
from canopy.compiler.bus_timing import frame_us, frames_in
from canopy.compiler.dbc_file import read_dbc
from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.generation import PLACEHOLDER, tie
from canopy.compiler.image_catalogue import Catalogue
from canopy.compiler.image_room import exchangeable, image_cost, make_room
from canopy.compiler.layout import layout
from canopy.compiler.leaf_c import (
    arguments,
    entry_kind,
    entry_note,
    entry_step,
    entry_type,
    function_names,
    has_setter,
    item_type,
    parameters,
    port_members,
    prototypes,
    reason_constants,
    setter,
    stale_test,
    text_constants,
)
from canopy.compiler.limits import FRAMES, whole
from canopy.compiler.names import is_c_identifier, snake
from canopy.compiler.port_types import Options, PortType
from canopy.compiler.row_c import place_constant, row_fields
from canopy.compiler.script.arithmetic import RANK
from canopy.compiler.script.compile import Texts
from canopy.compiler.script_bodies import initial_lines
from canopy.compiler.table import Table, make_table
from canopy.compiler.trace import Trace, TraceOptions, make_trace
from canopy.compiler.trace_layout import dbc as trace_dbc
from canopy.compiler.tree_reader import read_tree
from canopy.escape import c_templates
from canopy.escape.c import header, string
from canopy.escape.json_text import dumps
from canopy.tree.enums import constants
from canopy.tree.generic import VALUE

MODEL_FORMAT = 2


@dataclass(frozen=True)
class Application:
    """Everything that the templates need."""

    name: str
    table: Table
    bus: Bus
    period_ms: int
    bitrate: int
    budget: Budget
    trace: Trace | None
    options: Options
    images: Catalogue | None

    @property
    def include(self) -> str | None:
        """The user's header."""
        return self.options.include

    @property
    def rx_max(self) -> int:
        """Most frames that the bus can carry in a period."""
        return frames_in(self.period_ms * 1000, self.bitrate)

    @property
    def frame_us(self) -> int:
        """How long a classic frame of 8 bytes takes at most [us]."""
        return frame_us(self.bitrate)

    @property
    def trace_capacity(self) -> int:
        """Trace frames that can wait: a power of two."""
        return self.trace.capacity if self.trace is not None else 1


def _check_leaves(table: Table, bus: Bus) -> None:
    messages = {
        "reads": [message.name for message in bus.receive],
        "writes": [message.name for message in bus.send],
    }
    for use in table.users:
        for verb, known in messages.items():
            for name in getattr(use.leaf, verb):
                message, _, signal = name.partition(".")
                if message not in known:
                    raise CompileError(
                        use.leaf.place,
                        f"leaf '{use.leaf.id}' {verb} '{name}', which node '{bus.node}' of {bus.path.name} does not "
                        f"{'receive' if verb == 'reads' else 'send'}",
                        nearest(message, known),
                    )
                owner = next(m for m in bus.receive + bus.send if m.name == message)
                signals = [s.name for s in owner.signals]
                if signal and signal not in signals:
                    raise CompileError(
                        use.leaf.place, f"message '{message}' has no signal '{signal}'", nearest(signal, signals)
                    )


def load_application(
    name: str,
    tree: Path,
    dbc: Path,
    node: str,
    period_ms: int,
    bitrate: int,
    include: str | None = None,
    options: Options | None = None,
    images: tuple[int, int] | None = None,
    others: Others | None = None,
    trace: TraceOptions | None = None,
) -> Application:
    """Reads and checks everything.

    `images`: nodes, and uses of each kind, of the largest tree image; None: no images. `trace`: None: without.

    Raises:
        CompileError: something in the tree, in the DBC, or between them cannot be compiled.
    """
    if not is_c_identifier(name) or name != snake(name):
        raise CompileError(Place("--name"), f"'{name}' is not a lower-case C identifier", f"for example {snake(name)}")
    whole(
        frames_in(period_ms * 1000, bitrate),
        FRAMES,
        f"the number of frames that a bus of {bitrate} bit/s carries in {period_ms} ms",
        Place("--bitrate"),
        "state the bus's bit rate, or take a shorter period",
    )
    options = options or Options(include=include)
    parsed = read_tree(tree, options)
    bus = read_bus(dbc, node, period_ms, name)
    table = make_table(parsed, bind(parsed, bus, options, name))
    _check_leaves(table, bus)
    traced = make_trace(table, bus, period_ms, trace) if trace is not None else None
    catalogue = None
    if images is not None:
        table = exchangeable(table)
        catalogue = Catalogue(table, make_room(table, *images))
    cost = image_cost(table, catalogue.room) if catalogue is not None else None
    budget = make_budget(table, bus, period_ms, traced, bitrate, others or Others(), cost)
    return Application(name, table, bus, period_ms, bitrate, budget, traced, options, catalogue)


def _category(row_category: str, kind: str) -> str:
    if row_category == "LEAF":
        return "condition" if kind == "Condition" else "action"
    return row_category.lower()


def _file(table: Table, place: Place) -> dict[str, str]:
    """The file of a node that is not in the main file."""
    return {} if place.file == str(table.tree.path) else {"file": Path(place.file).name}


def model(application: Application) -> dict[str, object]:
    """The model file's content (docs/model.md)."""
    table, bus = application.table, application.bus
    return {
        "format": MODEL_FORMAT,
        "canopy": __version__,
        "application": application.name,
        "hash": table.hash,
        "period_us": application.period_ms * 1000,
        "tree": {
            "id": table.tree.id,
            "file": table.tree.path.name,
            "nodes": [
                {
                    "index": index,
                    "parent": row.parent if index else None,
                    "end": row.end,
                    "type": row.node.xml_name,
                    "category": _category(row.node.type.category, row.node.type.name),
                    "name": row.node.name,
                    "line": row.node.place.line,
                    "path": row.node.path,
                    **_file(table, row.node.place),
                }
                for index, row in enumerate(table.rows)
            ],
        },
        "bus": {
            "dbc": bus.path.name,
            "dbc_hash": hashlib.sha256(read_dbc(bus.path)).hexdigest()[:16],
            "node": bus.node,
            "receive": [message.name for message in bus.receive],
            "send": [message.name for message in bus.send],
        },
        "trace": application.trace.as_dict() if application.trace is not None else None,
        "budget": application.budget.as_dict(),
        **({"image": application.images.model(application.options)} if application.images is not None else {}),
    }


def _queues(table: Table) -> list[PortType]:
    """The types of queues, each once."""
    kinds = [port.type for use in table.users for port in use.leaf.ports]
    kinds += [entry.type for entry in table.bindings.entries]
    return sorted({kind for kind in kinds if kind.capacity}, key=lambda kind: kind.c)


def _ranks(table: Table) -> list[int]:
    """The place of each text in the order of all; none where no script asks for it."""
    if not any(f"{RANK}(" in line for script in table.tree.scripts for line in script.body):
        return []
    order = sorted(table.bindings.texts, key=str.encode)
    return [order.index(text) for text in table.bindings.texts]


def _short(place: Place) -> str:
    """`get_home.xml:12`, for comments."""
    return f"{os.path.basename(place.file)}:{place.line}"


def _identifier(text: str) -> str:
    """Text as the end of a C identifier, in the letters that it has: `nao.dbc` becomes `nao_dbc`."""
    return re.sub(r"[^0-9A-Za-z]", "_", text)


def _exact(place: Place) -> str:
    """`get_home.xml:12:5`, for comments."""
    return f"{_short(place)}:{place.column}"


def environment(bus: Bus) -> jinja2.Environment:
    """The templates, with what they call."""
    result = c_templates.environment("canopy.compiler")
    result.filters |= {"snake": snake, "short": _short, "exact": _exact, "c_string": string, "c_header": header}
    result.filters["identifier"] = _identifier
    result.globals |= {
        "codec": codec,
        "stale_test": functools.partial(stale_test, bus),
        "parameters_of": parameters,
        "arguments_of": arguments,
        "prototypes_of": prototypes,
        "function_names_of": function_names,
        "port_members": port_members,
        "setter": setter,
        "has_setter": has_setter,
        "entry_type": entry_type,
        "entry_note": entry_note,
        "entry_kind": entry_kind,
        "entry_step": entry_step,
        "item_type": item_type,
        "text_constants": text_constants,
        "reason_constants": reason_constants,
        "place_constant": place_constant,
        "row_fields": row_fields,
        "version": __version__,
        "generation": PLACEHOLDER,
    }
    return result


def render_bus(bus: Bus, period_ms: int) -> dict[str, str]:
    """The bus's two files: images, codecs and tables for canopy/bus.h. File name -> content, for tie()."""
    templates = environment(bus)
    sizes = [2 * message.length for message in bus.send]
    places = list(itertools.accumulate(sizes, initial=0))
    return {
        f"{bus.name}_bus.{suffix}": layout(
            templates.get_template(f"bus.{suffix}.j2").render(bus=bus, period_ms=period_ms, places=places)
        )
        for suffix in ("h", "c")
    }


def render(application: Application) -> dict[str, bytes]:
    """File name -> content, the one that a build looks at last. The same input gives the same bytes."""
    bindings = application.table.bindings
    texts = Texts(bindings.texts or ("",))
    context = {
        "app": application,
        "table": application.table,
        "bus": application.bus,
        "entries": bindings.entries,
        "texts": bindings.texts,
        "enums": constants(application.name, application.table.tree.enums),
        "ranks": _ranks(application.table),
        "notes": application.table.parameter_notes(),
        "queues": _queues(application.table),
        "has_values": any(p.type == VALUE for use in application.table.users for p in use.leaf.ports),
        "image": application.images,
        "trace": application.trace,
        "starts": [line for entry in bindings.entries for line in initial_lines(entry, texts)],
    }
    name = application.name
    templates = {
        f"{name}_leaves.h": "leaves.h.j2",
        f"{name}_app.h": "application.h.j2",
        f"{name}_app.c": "application.c.j2",
    }
    files = render_bus(application.bus, application.period_ms)
    files |= {
        file: layout(environment(application.bus).get_template(template).render(context))
        for file, template in templates.items()
    }
    traced = application.trace
    return {
        **(
            {f"{name}_trace.dbc": trace_dbc(traced.base, traced.extended, application.bus.node).encode()}
            if traced
            else {}
        ),
        application.bus.path.name: read_dbc(application.bus.path),
        f"{name}.model.json": (dumps(model(application), indent=1) + "\n").encode(),
        **tie(files),
    }
