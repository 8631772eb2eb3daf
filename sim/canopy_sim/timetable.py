# SPDX-License-Identifier: MIT
"""What happens to the robot at which time of its clock: a file in TOML.

[[events]]
at = 12.5            # s on the robot's clock
do = "say"           # as `canopy sim` has it
wish = "ball game"
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from canopy.compiler.errors import CompileError, nearest
from canopy.verify.toml_file import TomlFile
from canopy_sim.deeds import WHOLE_MS_MAX, Deed, Kind
from canopy_sim.plant import Wish

LATEST_S = 10_000_000
"""Of an event: four months."""

EVENTS_MAX = 10_000

WISHES = {"sit": Wish.Sit, "stand up": Wish.StandUp, "sleep": Wish.Sleep, "say goodbye": Wish.SayGoodbye}
WISHES["ball game"] = Wish.BallGame

TOES = {"left-outer": 1, "left-inner": 2, "right-inner": 4, "right-outer": 8}

Event = tuple[int, Deed]
"""Time on the robot's clock [ms], and what is done."""


def _wish(value: Any) -> dict[str, Any]:
    if value not in WISHES:
        raise ValueError(f"is {value!r}; one of {', '.join(WISHES)}")
    return {"number": int(WISHES[value])}


def _toes(value: Any) -> dict[str, Any]:
    if not isinstance(value, list) or not value or not all(toe in TOES for toe in value):
        raise ValueError(f"is {value!r}; a list of {', '.join(TOES)}")
    return {"number": sum(TOES[toe] for toe in set(value))}


def _number(field: str, low: float, high: float) -> Callable[[Any], dict[str, Any]]:
    def read(value: Any) -> dict[str, Any]:
        if isinstance(value, bool) or not isinstance(value, (int, Fraction)) or not low <= value <= high:
            raise ValueError(f"is {value!r}; a number from {low:g} to {high:g}")
        return {field: float(value)}

    return read


def _milliseconds(value: Any) -> dict[str, Any]:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= WHOLE_MS_MAX:
        raise ValueError(f"is {value!r}; a whole number from 0 to {WHOLE_MS_MAX}")
    return {"milliseconds": value}


_STATE = {
    "battery": _number("battery", 0, 110),
    "charger_distance": _number("charger_distance", -10, 200),
    "head_x": _number("head_x", -10, 10),
    "head_height": _number("head_height", 0, 2),
    "ball_distance": _number("ball_distance", 0, 5),
}

_DEEDS: dict[str, tuple[Kind, dict[str, Callable[[Any], dict[str, Any]]], tuple[str, ...]]] = {
    "say": (Kind.SAY, {"wish": _wish}, ("wish",)),
    "push-over": (Kind.PUSH_OVER, {}, ()),
    "press-chest": (Kind.PRESS_CHEST, {}, ()),
    "bumper": (Kind.PRESS_TOES, {"toes": _toes, "ms": _milliseconds}, ()),
    "drain": (Kind.DRAIN, {"percent": _number("battery", 0, 100)}, ("percent",)),
    "unplug": (Kind.UNPLUG, {}, ()),
    "plug": (Kind.PLUG, {}, ()),
    "overheat": (Kind.OVERHEAT, {}, ()),
    "drop-ball": (Kind.DROP_BALL, {}, ()),
    "set": (Kind.SET_STATE, _STATE, ()),
    "stop-sending": (Kind.STOP_SENDING, {}, ()),
    "resume-sending": (Kind.RESUME_SENDING, {}, ()),
}
"""Name -> kind, how its keys are read, and which of them it must have."""


def load_timetable(path: Path) -> list[Event]:
    """Reads the file; the earliest event first.

    Raises:
        CompileError: The file cannot be read, or something in it is not as it should be; with its line.
    """
    file = TomlFile(path)
    unknown = set(file.content) - {"events"}
    if unknown:
        name = sorted(unknown)[0]
        raise CompileError(file.place(name), f"unknown key '{name}'", "there are [[events]], and nothing else")
    events = file.content.get("events", [])
    if not isinstance(events, list) or not 0 < len(events) <= EVENTS_MAX:
        raise CompileError(file.place("events"), f"there must be 1 to {EVENTS_MAX} [[events]]")
    read = [_read(file, index, event) for index, event in enumerate(events)]
    return sorted(read, key=lambda event: event[0])


def _read(file: TomlFile, index: int, event: Any) -> Event:
    def wrong(key: str, text: str, help_text: str = "") -> CompileError:
        return CompileError(file.place("events", str(index), key), text, help_text)

    if not isinstance(event, dict):
        raise wrong("at", "an event is a table: [[events]]")
    rest = dict(event)
    at, name = rest.pop("at", None), rest.pop("do", None)
    if isinstance(at, bool) or not isinstance(at, (int, Fraction)) or not 0 <= at <= LATEST_S:
        raise wrong("at", f"'at' is {at!r}, and must be a time from 0 to {LATEST_S} [s]")
    if not isinstance(name, str) or name not in _DEEDS:
        raise wrong("do", f"'do' is {name!r}", nearest(str(name), _DEEDS))
    kind, keys, needed = _DEEDS[name]
    deed = Deed(kind)
    for key, value in rest.items():
        if key not in keys:
            raise wrong(key, f"'{name}' has no '{key}'", nearest(key, [*keys, "at", "do"]))
        try:
            deed = replace(deed, **keys[key](value))
        except ValueError as error:
            raise wrong(key, f"'{key}' {error}") from None
    missing = [key for key in needed if key not in rest]
    if missing:
        raise wrong("do", f"'{name}' needs '{missing[0]}'")
    return round(at * 1000), deed
