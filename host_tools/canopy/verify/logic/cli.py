# SPDX-License-Identifier: MIT
"""`canopy verify --never` and `--always`: what is asked and how it is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from canopy.compiler.bus_reader import read_bus
from canopy.compiler.errors import CompileError, Place
from canopy.compiler.numbers import plain
from canopy.compiler.port_types import Options
from canopy.compiler.tree_reader import read_tree
from canopy.escape.json_text import dumps
from canopy.escape.terminal import echo, echo_lines
from canopy.semantics.spec import STATUS_NAMES
from canopy.verify.expression import ExpressionError
from canopy.verify.logic.ask import Verdict, ask, called
from canopy.verify.logic.engine import EngineError
from canopy.verify.logic.formula import Formula, parse
from canopy.verify.logic.replay import Inputs
from canopy.verify.logic.subject import LogicTree

SHOWN = 8
NOT_PROVEN = 1


def _read(tree: LogicTree, option: str, text: str) -> Formula:
    """The formula that has to hold in every tick."""
    try:
        formula = parse(text, tree)
    except ExpressionError as error:
        message = f"column {error.at + 1}: {error.message}"
        raise CompileError(Place(option), message, error.help_text) from None
    return Formula("not", (formula,)) if option == "--never" else formula


def _image(tree: LogicTree, inputs: Inputs) -> dict[str, str]:
    """The part of the input image that the trace speaks of: signals in their units; messages that are stale."""
    shown = {}
    for key, value in inputs.bits.items():
        if key[0] == "fresh" and not value:
            shown[str(key[1])] = "stale"
    for key, raw in inputs.numbers.items():
        name = str(key[1])
        if key[0] == "signal" and name.partition(".")[0] not in shown:
            shown[name] = plain(tree.board.physical(name, raw))
    return shown


def _trace(tree: LogicTree, verdict: Verdict, whole: bool) -> list[str]:
    lines = []
    before = tuple(tree.board.initial(entry) for entry in tree.board.entries)
    for tick, (inputs, shot) in enumerate(zip(verdict.inputs, verdict.trace, strict=True), 1):
        image = ", ".join(f"{name} {value}" for name, value in _image(tree, inputs).items())
        answers = ", ".join(f"{path} {status}" for path, status in called(tree, inputs, shot))
        changed = [place for place, (old, new) in enumerate(zip(before, shot.entries, strict=True)) if old != new]
        entries = ", ".join(tree.board.shown(place, shot.entries[place]) for place in changed)
        line = f"{tick:>6}  {f'{image}; ' if image else ''}{answers or 'no leaf is called'}: "
        line += f"the tree is {STATUS_NAMES[shot.moments[0].returned]}"
        lines.append(line + (f"; {entries}" if entries else ""))
        before = shot.entries
    if whole or len(lines) <= SHOWN + 1:
        return lines
    return [*lines[: SHOWN // 2], f"     …  {len(lines) - SHOWN} more (--trace shows all)", *lines[-SHOWN // 2 :]]


def _print(tree: LogicTree, question: str, verdict: Verdict, whole: bool) -> None:
    texts = {
        "proven": "whatever the leaves answer",
        "refuted": f"in tick {len(verdict.trace)}, replayed in the reference model",
    }
    echo(f"{verdict.verdict:8} {question}")
    echo(f"         {texts.get(verdict.verdict, verdict.reason)} ({verdict.seconds:.2f} s)")
    for line in _trace(tree, verdict, whole):
        echo(f"  {line}")


def _as_json(tree: LogicTree, question: str, verdict: Verdict) -> dict[str, Any]:
    paths = [node.path.lstrip("/") for node in tree.nodes]
    return {
        "question": question,
        "verdict": verdict.verdict,
        "reason": verdict.reason,
        "seconds": round(verdict.seconds, 3),
        "trace": [
            {
                "inputs": _image(tree, inputs),
                "answers": dict(called(tree, inputs, shot)),
                "statuses": {path: STATUS_NAMES[one.code] for path, one in zip(paths, shot.moments, strict=True)},
                "halted": [path for path, one in zip(paths, shot.moments, strict=True) if one.halted],
                "entries": [tree.board.shown(place, steps) for place, steps in enumerate(shot.entries)],
            }
            for inputs, shot in zip(verdict.inputs, verdict.trace, strict=True)
        ],
    }


@dataclass(frozen=True)
class How:
    """`dbc`, `node`: the bus; None: not given. `period_ms`: from tick to tick; None: not known. `timeout` [s]."""

    dbc: Path | None
    node: str
    period_ms: int | None
    timeout: float
    whole: bool
    json_: bool


def run(path: Path, questions: Sequence[tuple[str, str]], options: Options, how: How) -> int:
    """Answers questions, each an option (--never, --always) and its formula. Returns the exit status.

    Raises:
        CompileError: The tree or a formula is wrong, or berkeley-abc cannot be run.
    """
    bus = read_bus(how.dbc, how.node, how.period_ms or 1) if how.dbc is not None else None
    tree = LogicTree(read_tree(path, options), bus, options)
    formulas = [(f"{option[2:]} {text}", _read(tree, option, text)) for option, text in questions]
    results = []
    for question, formula in formulas:
        try:
            verdict = ask(tree, formula, how.period_ms, how.timeout)
        except EngineError as error:
            raise CompileError(Place(str(path)), str(error), error.help_text) from error
        results.append((question, verdict))
        if not how.json_:
            _print(tree, question, verdict, how.whole)
    if how.json_:
        echo_lines(dumps([_as_json(tree, *one) for one in results], indent=1))
    return 0 if all(verdict.verdict == "proven" for _, verdict in results) else NOT_PROVEN
