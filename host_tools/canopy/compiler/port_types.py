# SPDX-License-Identifier: MIT
"""Types of ports and blackboard entries: the C++ and C names that models use, and what they are in C."""

from __future__ import annotations

import difflib
import html
import re
import struct
import sys
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Literal

from canopy.compiler.errors import LONGEST_NAME, CompileError, Place, UnsupportedTypeError, nearest
from canopy.compiler.names import is_c_identifier
from canopy.compiler.numbers import exact, plain
from canopy.escape.c import emits_c, string
from canopy.tree.cxx import ITEMS, LIST_CAPACITY, c_type_of, limit_of, list_item, without_allocators, without_optional

Kind = Literal["bool", "int", "fixed", "duration", "float", "text", "user", "any", "value"]


@dataclass(frozen=True)
class PortType:
    """A type. `c` is the C type of an entry or port; `low` and `high` are the limits of whole numbers.

    Fixed point is a whole number of steps: the value in C times `scale` is what the tree's texts and scripts mean.

    A queue is a type like the user's own, made by the compiler: `item` is the C type of its `capacity` items. Texts in
    entries and queues are places in the application's table of texts.

    An enum is a whole number whose values have `names`; `label` is what messages call it.
    """

    kind: Kind
    c: str
    low: int = 0
    high: int = 0
    item: str = ""
    capacity: int = 0
    scale: Fraction = Fraction(1)
    names: tuple[tuple[str, int], ...] = ()
    label: str = ""

    def __str__(self) -> str:
        if self.label:
            return self.label
        if self.kind == "fixed":
            return f"{self.c} in steps of {plain(self.scale)}"
        return {"text": "a constant text", "duration": "a duration [ms]", "any": "any type"}.get(self.kind, self.c)

    @property
    def holds_texts(self) -> bool:
        """Is it a text, or a queue of texts?"""
        return self.kind == "text" or self.item == TEXT.c

    @property
    def is_number(self) -> bool:
        """Can scripts compute with it?"""
        return self.kind in ("bool", "int", "fixed", "duration", "float")


def _integer(bits: int, *, signed: bool) -> PortType:
    low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    return PortType("int", f"{'' if signed else 'u'}int{bits}_t", low, high)


BOOL = PortType("bool", "bool", 0, 1)
INT32 = _integer(32, signed=True)
INT64 = _integer(64, signed=True)
DURATION = PortType("duration", "uint32_t", 0, 2**32 - 1)
FLOAT = PortType("float", "float")
DOUBLE = PortType("float", "double")
TEXT = PortType("text", "const char *")
NOTHING = PortType("user", "void")
"""Of a port without a type that nothing is connected to: a pointer that is NULL."""
STATUS = PortType(
    "int",
    "int32_t",
    0,
    4,
    names=(("IDLE", 0), ("RUNNING", 1), ("SUCCESS", 2), ("FAILURE", 3), ("SKIPPED", 4)),
    label="a status",
)
ANY = PortType("any", "")

# Spellings on the left: C, C++, and what compilers print for C++ types.
PORT_TYPES: dict[str, PortType] = {
    "bool": BOOL,
    **{f"{u}int{bits}_t": _integer(bits, signed=not u) for u in ("", "u") for bits in (8, 16, 32, 64)},
    "int": INT32,
    "unsigned": _integer(32, signed=False),
    "unsigned int": _integer(32, signed=False),
    "short": _integer(16, signed=True),
    "unsigned short": _integer(16, signed=False),
    "signed char": _integer(8, signed=True),
    "unsigned char": _integer(8, signed=False),
    "long": INT64,
    "unsigned long": _integer(64, signed=False),
    "size_t": _integer(64, signed=False),
    "float": FLOAT,
    "double": DOUBLE,
    # As in the messages of ROS.
    **{f"{u}int{bits}": _integer(bits, signed=not u) for u in ("", "u") for bits in (8, 16, 32, 64)},
    "float32": FLOAT,
    "float64": DOUBLE,
    "std::string": TEXT,
    "string": TEXT,
    "std::string_view": TEXT,
    "const char *": TEXT,
    "std::basic_string<char,std::char_traits<char>>": TEXT,
    "std::chrono::milliseconds": DURATION,
    "chrono::milliseconds": DURATION,
    "std::chrono::duration<long,std::ratio<1,1000>>": DURATION,
    "duration": DURATION,
    "": ANY,
    "AnyTypeAllowed": ANY,
    "BT::AnyTypeAllowed": ANY,
    "BT::Any": ANY,
    "NodeStatus": STATUS,
    "BT::NodeStatus": STATUS,
}


@dataclass(frozen=True)
class Options:
    """What the command line says about types and trees, and where the ROS packages are whose trees may be included."""

    floats: bool = False
    type_map: dict[str, str] = field(default_factory=dict)
    include: str | None = None
    ros_packages: dict[str, Path] = field(default_factory=dict)
    unset_ports: bool = False  # input ports may have neither a value nor a default: 0, false or NULL
    main_tree: str | None = None  # instead of the file's main_tree_to_execute
    any_type: bool = False  # types for which there is nothing in C are accepted
    enums: dict[str, PortType] = field(default_factory=dict)
    search: tuple[Path, ...] = ()  # folders, projects and files that trees and models are looked for in
    draw: bool = False  # what is wrong is drawn as far as it can be
    undeclared: bool = False  # nodes that nobody declared are taken as what they can be
    foreign: frozenset[str] = frozenset()  # attributes and metadata of other tools that look like ours, misspelt


# For tools that make no C.
ANY_TYPE = Options(floats=True, unset_ports=True, any_type=True)


def _normal(name: str) -> str:
    """One spelling for `std::vector< int >`, `std::__cxx11::basic_string<…>`, `std::ratio<1l, 1000l>`, `&lt;`."""
    text = html.unescape(name).strip().replace("std::__cxx11::", "std::").replace("std::__1::", "std::")
    text = re.sub(r"\s*([<>,*/])\s*", r"\1", text)
    text = re.sub(r"\b(\d+)[lL]+\b", r"\1", text).replace("const char*", "const char *")
    text = without_allocators(text)
    return re.sub(r"\s+", " ", text.removeprefix("const ") if "*" not in text else text)


def is_optional(name: str) -> bool:
    """Is it a std::optional?"""
    return without_optional(_normal(name)) != _normal(name)


_QUEUE = re.compile(r"(?P<item>[\w: ]+?) ?\[(?P<capacity>\d{1,5})\]")
MAX_CAPACITY = 65_535


def _queue(item: PortType, capacity: int, where: str, place: Place) -> PortType:
    if item.kind not in ("bool", "int", "float", "text") or not 1 <= capacity <= MAX_CAPACITY:
        raise CompileError(
            place, f"{where}: a queue has 1 to {MAX_CAPACITY} numbers or texts", "for example type='int32_t[8]'"
        )
    name = "text" if item == TEXT else item.c.removesuffix("_t")
    return PortType("user", f"canopy_queue_{name}_{capacity}_t", item=item.c, capacity=capacity)


# int16_t*0.01, as a DBC has its factors; int16_t/256, as in binary fixed point.
_FIXED = re.compile(r"(?P<base>[\w ]+)(?P<sign>[*/])(?P<step>\d+(\.\d+)?)")


def is_queue(name: str) -> bool:
    """Is it a type like int32_t[8]?"""
    return _QUEUE.fullmatch(_normal(name)) is not None


def _is_item(name: str) -> bool:
    """Is it a type that the items of lists can have?"""
    known = PORT_TYPES.get(name) or PORT_TYPES.get(name.removeprefix("std::"))
    return known is not None and known.kind in ITEMS


def is_fixed_point(name: str) -> bool:
    """Is it a type like int16_t*0.01?"""
    return _FIXED.fullmatch(_normal(name)) is not None


def _fixed(base: PortType, sign: str, step: str, where: str, place: Place) -> PortType:
    number = exact(step) if len(step) < 40 else Fraction(0)
    if base.kind != "int" or number == 0:
        raise CompileError(
            place, f"{where}: '{base.c}{sign}{step}' is no fixed-point type", "for example type='int16_t*0.01'"
        )
    scale = number if sign == "*" else 1 / number
    return base if scale == 1 else replace(base, kind="fixed", scale=scale)


def read_type(name: str, where: str, place: Place, options: Options) -> PortType:
    """The type of that name. `where` says whose it is, for messages.

    Raises:
        UnsupportedTypeError: it is no known type, or one that this application does not allow.
        CompileError: it is a queue or a fixed-point type that cannot be.
    """
    mapped = {_normal(key): _normal(value) for key, value in options.type_map.items()}
    normal = mapped.get(_normal(name), _normal(name))
    normal = without_optional(normal)
    normal = mapped.get(normal, normal)
    enum = options.enums.get(normal) or options.enums.get(normal.rpartition("::")[2])
    if enum is not None:
        return enum
    known = PORT_TYPES.get(normal) or PORT_TYPES.get(normal.removeprefix("std::"))
    if known is not None:
        if known.kind == "float" and not options.floats:
            raise UnsupportedTypeError(
                place,
                f"{where}: type '{name}' is floating point, which this application does not allow",
                "use whole numbers of a smaller unit, or compile with --allow-floating-point",
            )
        return known
    queue = _QUEUE.fullmatch(normal)
    if queue is not None:
        return _queue(read_type(queue["item"], where, place, options), int(queue["capacity"]), where, place)
    item = list_item(normal)
    if item is not None:
        kind = mapped.get(item, item)
        inner = read_type(kind, where, place, options) if _is_item(kind) else None
        if inner is not None and inner.kind in ITEMS:
            return _queue(inner, LIST_CAPACITY, where, place)
    fixed = _FIXED.fullmatch(normal)
    if fixed is not None:
        base = read_type(fixed["base"], where, place, options)
        return _fixed(base, fixed["sign"], fixed["step"], where, place)
    if options.any_type:
        return PortType("user", normal)
    if not is_c_identifier(normal) and options.include is not None:
        return PortType("user", c_type_of(normal))
    if not is_c_identifier(normal):
        raise UnsupportedTypeError(
            place,
            f"{where}: unsupported type '{name}'",
            f"give the C type of yours that stands for it: --type-map '{normal}=my_type_t'; with --include, the header "
            f"that has your types, it is {c_type_of(normal)} unless you say otherwise",
        )
    close = difflib.get_close_matches(normal[:LONGEST_NAME], [n for n in PORT_TYPES if n], n=1, cutoff=0.85)
    if normal not in mapped.values() and close:
        raise UnsupportedTypeError(place, f"{where}: unsupported type '{name}'", f"did you mean '{close[0]}'?")
    if options.include is None:
        raise UnsupportedTypeError(
            place,
            f"{where}: unsupported type '{name}'",
            "if it is a C type of yours, name its header with --include; else use one of: "
            + ", ".join(sorted({t.c for t in PORT_TYPES.values() if t.c})),
        )
    return PortType("user", normal)


@emits_c
def literal(text: str, kind: PortType, where: str, place: Place) -> str:
    """The C literal of a value of that type.

    Raises:
        CompileError: the text is not a value of the type.
    """
    if kind.kind == "bool":
        if text.lower() not in ("true", "false", "0", "1"):
            raise CompileError(place, f"{where}: '{text}' is not a bool", "write true or false")
        return "true" if text.lower() in ("true", "1") else "false"
    if kind.kind == "text":
        return string(text)
    if kind.kind == "float":
        return _float(text, kind, where, place)
    if kind.kind == "user":
        if not is_c_identifier(text):
            raise CompileError(
                place,
                f"{where}: '{text}' cannot be a value of your type {kind.c}",
                "name a constant of that type (an enum's), or connect an entry: {name}",
            )
        return text
    if kind.kind == "fixed":
        return integer(_steps(text, kind, where, place), kind)
    named = dict(kind.names)
    limits = {"max": kind.high, "min": kind.low, "lowest": kind.low, "inf": kind.high + 1, "-inf": kind.low - 1}
    limit = limit_of(text)
    if kind.names and text not in named and not text.lstrip("-").isdecimal():
        raise CompileError(place, f"{where}: '{text}' is no value of {kind}", nearest(text, named))
    try:
        value = named[text] if text in named else limits[limit] if limit in limits else _whole(text)
    except ValueError:
        raise CompileError(place, f"{where}: '{text}' is not a whole number ({kind.c})") from None
    if not kind.low <= value <= kind.high:
        raise CompileError(place, f"{where}: {value} is outside {kind.c} [{kind.low}, {kind.high}]")
    return integer(value, kind)


def _whole(text: str) -> int:
    """12, 0x1F, and 5.0, which is a whole number, too."""
    try:
        return int(text, 0)
    except ValueError:
        value = exact(text)
        if value.denominator != 1:
            raise
        return int(value)


def _float(text: str, kind: PortType, where: str, place: Place) -> str:
    limit = limit_of(text)
    suffix = "f" if kind.c == "float" else ""
    if limit is not None and limit.endswith("inf"):
        return f"{'-' if limit[0] == '-' else ''}__builtin_inf{suffix}()"
    ends = {"f": ("3.4028234663852886e+38", "1.1754943508222875e-38"), "": (repr(_MAX), repr(_MIN))}[suffix]
    named = {"max": ends[0], "-max": f"-{ends[0]}", "lowest": f"-{ends[0]}", "min": ends[1], "-min": f"-{ends[1]}"}
    text = named.get(limit or "", text)
    try:
        value = float(text)
    except ValueError:
        raise CompileError(place, f"{where}: '{text}' is not a number ({kind.c})") from None
    if value != value or value in (float("inf"), float("-inf")):
        raise CompileError(place, f"{where}: '{text}' is not a finite number")
    if not fits_float(value, kind.c) or (value == 0 and re.search("[1-9]", text.lower().partition("e")[0])):
        raise CompileError(place, f"{where}: '{text}' is too large or too small for a {kind.c}")
    return repr(value) + suffix


_MAX, _MIN = sys.float_info.max, sys.float_info.min


def fits_float(value: float, c_type: str) -> bool:
    """Can a `float` or `double` hold the number, be it rounded, without becoming infinite or 0?"""
    try:
        return struct.unpack("<f", struct.pack("<f", value))[0] != 0 or value == 0 or c_type == "double"
    except OverflowError:
        return c_type == "double"


def _steps(text: str, kind: PortType, where: str, place: Place) -> int:
    """How many steps of a fixed-point type a text in physical units is."""
    try:
        steps = exact(text) / kind.scale
    except ValueError:
        raise CompileError(place, f"{where}: '{text}' is not a number ({kind})") from None
    if steps.denominator != 1:
        near = [plain(whole * kind.scale) for whole in (steps.__floor__(), steps.__ceil__())]
        raise CompileError(
            place, f"{where}: {text} lies between two steps of {plain(kind.scale)}", f"write {near[0]} or {near[1]}"
        )
    if not kind.low <= steps <= kind.high:
        ends = (plain(kind.low * kind.scale), plain(kind.high * kind.scale))
        raise CompileError(place, f"{where}: {text} is outside {kind} [{ends[0]}, {ends[1]}]")
    return int(steps)


@emits_c
def integer(value: int, kind: PortType) -> str:
    """The C literal of a whole number, or of a number of steps, that the type can hold."""
    bits = int("".join(c for c in kind.c if c.isdigit()))
    macro = f"{'U' if kind.c.startswith('u') else ''}INT{bits}_C"
    return f"({macro}({value + 1}) - 1)" if value == kind.low and value < 0 else f"{macro}({value})"
