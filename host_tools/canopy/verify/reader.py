# SPDX-License-Identifier: MIT
"""Reads a model file. What can be wrong with it without a tree is found here; the rest in checks.py."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

from canopy.compiler.errors import CompileError, nearest
from canopy.verify.expression import ExpressionError, parse_formula, parse_sum
from canopy.verify.linear import Formula
from canopy.verify.model import (
    STATUSES,
    Claim,
    LeafModel,
    Mode,
    Plant,
    Step,
    Variable,
    identity,
)
from canopy.verify.toml_file import TomlFile
from canopy.verify.units import Unit, parse_unit

FORMAT = 1
MAX_VARIABLES = 12
ELSE = "else"
VARIABLE_KEYS = ("unit", "range", "signal", "meaning")
LEAF_KEYS = ("success", "running", "failure", "modes", "free")
MODE_KEYS = ("name", "when", "where", "next", "disturbance", "shorter_than", "writes")
CLAIM_KINDS = ("reaches", "stays", "avoids", "margin", "dwell", "invariant", "border")


class ModelReader:
    """Reads the parts of a model file; the errors name the line."""

    def __init__(self, path: Path) -> None:
        self.file = TomlFile(path)
        self.units: dict[str, Unit] = {}
        self.names: list[str] = []

    def fail(self, path: tuple[str, ...], message: str, help_text: str = "") -> CompileError:
        """An error at a key, or at the table around it."""
        return CompileError(self.file.place(*path), message, help_text)

    def only(self, table: dict[str, Any], known: Iterable[str], path: tuple[str, ...], what: str) -> None:
        """Rejects keys that are not known."""
        for key in table:
            if key not in known:
                raise self.fail((*path, key), f"{what} has no key '{key}'", nearest(key, known))

    def table(self, value: Any, path: tuple[str, ...], what: str) -> dict[str, Any]:
        """A value that must be a table."""
        if not isinstance(value, dict):
            raise self.fail(path, f"{what} must be a table", f"write [{'.'.join(path)}]")
        return value

    def tables(self, value: Any, path: tuple[str, ...], what: str) -> list[dict[str, Any]]:
        """A value that must be an array of tables."""
        if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
            raise self.fail(path, f"{what} must be tables", f"write [[{'.'.join(path)}]]")
        return value

    def number(self, value: Any, path: tuple[str, ...], what: str) -> Fraction:
        """A value that must be a number."""
        if isinstance(value, bool) or not isinstance(value, (int, Fraction)):
            raise self.fail(path, f"{what} must be a number, not {value!r}")
        return Fraction(value)

    def text(self, value: Any, path: tuple[str, ...], what: str) -> str:
        """A value that must be a text."""
        if not isinstance(value, str):
            raise self.fail(path, f"{what} must be a text in quotes, not {value!r}")
        return value

    def interval(self, value: Any, path: tuple[str, ...], what: str) -> tuple[Fraction, Fraction]:
        """A value that must be [low, high]."""
        if not isinstance(value, list) or len(value) != 2:
            raise self.fail(path, f"{what} must be two numbers", "write for example [0, 100]")
        low, high = (self.number(one, path, what) for one in value)
        if low > high:
            raise self.fail(path, f"{what}: {low} is above {high}", "write the smaller number first")
        return low, high

    def formula(self, value: Any, path: tuple[str, ...], what: str) -> Formula:
        """A value that must be a condition on the variables."""
        text = self.text(value, path, what)
        try:
            return parse_formula(text, self.units)
        except ExpressionError as error:
            raise self.fail(path, f"{what}: {error.message}, at '{text[error.at :][:20]}'", error.help_text) from None

    def variables(self, content: dict[str, Any]) -> tuple[Variable, ...]:
        """The state."""
        tables = self.table(content.get("variables", {}), ("variables",), "'variables'")
        if not 1 <= len(tables) <= MAX_VARIABLES:
            raise self.fail(
                ("variables",), f"a model has 1 to {MAX_VARIABLES} variables, not {len(tables)}", "write [variables.x1]"
            )
        result = []
        for name, raw in tables.items():
            path = ("variables", name)
            table = self.table(raw, path, f"variable '{name}'")
            if not name.isidentifier():
                raise self.fail(path, f"'{name}' cannot be the name of a variable", "use letters, digits and _")
            self.only(table, VARIABLE_KEYS, path, f"variable '{name}'")
            for key in ("unit", "range"):
                if key not in table:
                    example = 'unit = "m"' if key == "unit" else "range = [0, 100]"
                    raise self.fail(path, f"variable '{name}' has no {key}", f"write {example}")
            try:
                unit = parse_unit(self.text(table["unit"], (*path, "unit"), "unit"))
            except ValueError as error:
                raise self.fail((*path, "unit"), str(error)) from None
            low, high = self.interval(table["range"], (*path, "range"), f"range of '{name}'")
            signal = self.text(table.get("signal", ""), (*path, "signal"), "signal")
            result.append(Variable(name, unit, low, high, signal, self.file.place(*path)))
        self.units = {one.name: one.unit for one in result}
        self.names = list(self.units)
        return tuple(result)

    def leaf(self, name: str, raw: Any) -> LeafModel:
        """A leaf's table."""
        path = ("leaves", name)
        table = self.table(raw, path, f"leaf '{name}'")
        self.only(table, LEAF_KEYS, path, f"leaf '{name}'")
        free = table.get("free", False)
        if not isinstance(free, bool):
            raise self.fail((*path, "free"), "'free' must be true or false")
        given = [key for key in ("success", "running", "failure") if key in table]
        if free and given:
            raise self.fail((*path, given[0]), f"leaf '{name}' is free, so it has no region '{given[0]}'")
        if not free and not given:
            raise self.fail(
                path, f"leaf '{name}' has no regions", 'write success = "…", running = "…" and failure = "…"'
            )
        regions = self.regions(table, path, name) if not free else {}
        raw_modes = self.tables(table.get("modes", []), (*path, "modes"), f"modes of leaf '{name}'")
        modes = tuple(self.mode(one, (*path, "modes", str(index)), name) for index, one in enumerate(raw_modes))
        return LeafModel(name, regions, modes, free, self.file.place(*path))

    def regions(self, table: dict[str, Any], path: tuple[str, ...], name: str) -> dict[str, Formula]:
        """The regions; `else` is what the others leave, and a region that is not given is empty."""
        keys = {status.lower(): status for status in STATUSES}
        rest = [key for key in keys if table.get(key) == ELSE]
        if len(rest) > 1:
            raise self.fail((*path, rest[1]), f"leaf '{name}' has two regions 'else'", "one region may be the rest")
        result = {}
        for key, status in keys.items():
            if key in rest:
                continue
            raw = table.get(key, "false")
            result[status] = self.formula(raw, (*path, key), f"{key} of leaf '{name}'")
        if rest:
            taken = Formula(len(self.names), tuple(part for one in result.values() for part in one.parts))
            result[keys[rest[0]]] = ~taken
        return result

    def mode(self, table: dict[str, Any], path: tuple[str, ...], leaf: str) -> Mode:
        """A mode's table."""
        what = f"mode of leaf '{leaf}'"
        self.only(table, MODE_KEYS, path, what)
        name = self.text(table.get("name", ""), (*path, "name"), "name")
        conditions = []
        for key in ("when", "where"):
            raw = table.get(key, "true")
            conditions.append(self.formula(raw, (*path, key), f"{key} of leaf '{leaf}'"))
        if not {"next", "shorter_than"} & set(table):
            raise self.fail(path, f"a {what} has neither 'next' nor 'shorter_than'", 'write next = { x1 = "x1 - 1" }')
        writes = self.table(table.get("writes", {}), (*path, "writes"), "'writes'")
        for signal, value in writes.items():
            if isinstance(value, bool) or not isinstance(value, (str, int)):
                raise self.fail((*path, "writes"), f"'{signal}' must be given a raw number or the name of a value")
        step = self.step(table, path, leaf)
        return Mode(name, conditions[0], conditions[1], step, tuple(writes.items()), self.file.place(*path))

    def step(self, table: dict[str, Any], path: tuple[str, ...], leaf: str) -> Step:
        """What a mode does."""
        maps = list(identity(len(self.names)))
        noise = [(Fraction(0), Fraction(0))] * len(self.names)
        for name, raw in self.table(table.get("next", {}), (*path, "next"), "'next'").items():
            index = self.index(name, (*path, "next", name))
            text = self.text(raw, (*path, "next", name), f"next {name} of leaf '{leaf}'")
            try:
                quantity = parse_sum(text, self.units)
            except ExpressionError as error:
                raise self.fail(
                    (*path, "next", name),
                    f"next {name} of leaf '{leaf}': {error.message}, at '{text[error.at :][:20]}'",
                    error.help_text,
                ) from None
            if quantity.unit not in (None, self.units[name]):
                raise self.fail(
                    (*path, "next", name),
                    f"next {name} of leaf '{leaf}' is in {quantity.unit}, and {name} in {self.units[name]}",
                )
            maps[index] = quantity.value
        for name, raw in self.table(table.get("disturbance", {}), (*path, "disturbance"), "'disturbance'").items():
            index = self.index(name, (*path, "disturbance", name))
            noise[index] = self.interval(raw, (*path, "disturbance", name), f"disturbance of {name}")
        shorter = self.shorter(table.get("shorter_than", {}), (*path, "shorter_than"), self.names)
        return Step(tuple(maps), tuple(noise), shorter)

    def shorter(self, raw: Any, path: tuple[str, ...], all_names: list[str]) -> tuple[Fraction | None, ...]:
        """A number for all variables, or a table of them."""
        limits = dict.fromkeys(all_names, raw) if not isinstance(raw, dict) else raw
        result: list[Fraction | None] = [None] * len(self.names)
        for name, limit in limits.items():
            value = self.number(limit, path, "shorter_than")
            if value <= 0:
                raise self.fail(path, f"no step is shorter than {value}", "write a number above 0")
            result[self.index(name, path)] = value
        return tuple(result)

    def index(self, name: str, path: tuple[str, ...]) -> int:
        """The place of a variable in the state."""
        if name not in self.names:
            raise self.fail(path, f"no variable '{name}'", nearest(name, self.names))
        return self.names.index(name)

    def claim(self, index: int, table: dict[str, Any]) -> Claim:
        """A claim's table; its formulas are read when it is asked (question.py)."""
        path = ("claims", str(index))
        name = self.text(table.get("name", f"claim {index + 1}"), (*path, "name"), "name")
        kind = table.get("kind")
        if kind not in CLAIM_KINDS:
            raise self.fail(path, f"claim '{name}' has kind {kind!r}", f"expected one of: {', '.join(CLAIM_KINDS)}")
        return Claim(name, kind, table, index, self.file.place(*path))


def read_model(path: Path) -> tuple[Plant, ModelReader]:
    """A model file, and the reader that reads the claims' formulas.

    Raises:
        CompileError: It is not a model; names file, line, and what to write.
    """
    reader = ModelReader(path)
    content = reader.file.content
    reader.only(content, ("format", "step", "variables", "leaves", "claims"), (), "a model")
    if content.get("format") != FORMAT:
        raise reader.fail(("format",), f"format is {content.get('format')!r}", f"write format = {FORMAT}")
    variables = reader.variables(content)
    leaves = reader.table(content.get("leaves", {}), ("leaves",), "'leaves'")
    made = {name: reader.leaf(name, raw) for name, raw in leaves.items()}
    claims = reader.tables(content.get("claims", []), ("claims",), "'claims'")
    return Plant(path, variables, made, tuple(reader.claim(i, one) for i, one in enumerate(claims))), reader
