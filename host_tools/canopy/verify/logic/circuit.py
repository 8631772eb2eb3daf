# SPDX-License-Identifier: MIT
"""A sequential circuit of inputs, latches and AND gates, with its simulation and its text in AIGER's binary format.

A literal is 2 * variable, plus 1 when it is inverted; FALSE is 0, TRUE is 1. All latches start with 0 in the file: a
latch that starts with 1 is stored inverted.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

FALSE, TRUE = 0, 1


@dataclass(frozen=True)
class Aiger:
    """A file, and which inputs of the circuit its inputs are."""

    content: bytes
    inputs: tuple[int, ...]


class Circuit:
    """Gates are made once: the same two literals give the same gate."""

    def __init__(self) -> None:
        self._count = 0
        self._gates: dict[int, tuple[int, int]] = {}
        self._known: dict[tuple[int, int], int] = {}
        self._next: dict[int, int] = {}
        self.inputs: list[int] = []

    def _variable(self) -> int:
        self._count += 1
        return self._count

    def input(self) -> int:
        """A new input."""
        self.inputs.append(2 * self._variable())
        return self.inputs[-1]

    def latch(self, start: bool = False) -> int:
        """A new latch; follow() says what comes next, else it keeps its value."""
        variable = self._variable()
        self._next[variable] = 2 * variable
        return 2 * variable + start

    def follow(self, latch: int, value: int) -> None:
        """The latch's value in the next tick."""
        self._next[latch >> 1] = value ^ (latch & 1)

    def both(self, a: int, b: int) -> int:
        """Both of two."""
        if a > b:
            a, b = b, a
        if a == FALSE or a == b ^ 1:
            return FALSE
        if a in (TRUE, b):
            return b
        if (a, b) not in self._known:
            variable = self._variable()
            self._gates[variable] = (a, b)
            self._known[a, b] = 2 * variable
        return self._known[a, b]

    def all(self, literals: Iterable[int]) -> int:
        """All of them; TRUE for none."""
        result = TRUE
        for literal in literals:
            result = self.both(result, literal)
        return result

    def any(self, literals: Iterable[int]) -> int:
        """At least one of them; FALSE for none."""
        return self.all(literal ^ 1 for literal in literals) ^ 1

    def either(self, a: int, b: int) -> int:
        """At least one of two."""
        return self.both(a ^ 1, b ^ 1) ^ 1

    def choose(self, condition: int, yes: int, no: int) -> int:
        """`yes` when the condition holds, else `no`."""
        if yes == no:
            return yes
        return self.either(self.both(condition, yes), self.both(condition ^ 1, no))

    def differ(self, a: int, b: int) -> int:
        """One of two, and not the other."""
        return self.choose(a, b ^ 1, b)

    def count(self, literals: Iterable[int], most: int) -> list[int]:
        """How many hold, in unary: element k says "more than k", up to `most` elements."""
        return self.add([], literals, most)

    def add(self, counted: Sequence[int], literals: Iterable[int], most: int) -> list[int]:
        """A unary count with more literals counted."""
        result = [*counted, *([FALSE] * (most - len(counted)))]
        for literal in literals:
            below = [TRUE, *result[:-1]]
            result = [self.either(old, self.both(less, literal)) for old, less in zip(result, below, strict=True)]
        return result

    def step(self, memory: dict[int, bool], inputs: dict[int, bool]) -> tuple[dict[int, bool], list[bool]]:
        """One tick: the latches' next values, and the value of every variable. Inputs and latches not given are 0."""
        values = [False] * (self._count + 1)
        for literal, value in inputs.items():
            values[literal >> 1] = value
        for variable in self._next:
            values[variable] = memory.get(variable, False)
        for variable, (a, b) in self._gates.items():
            values[variable] = (values[a >> 1] ^ bool(a & 1)) and (values[b >> 1] ^ bool(b & 1))
        return {latch: values[lit >> 1] ^ bool(lit & 1) for latch, lit in self._next.items()}, values

    def _needed(self, output: int) -> set[int]:
        """The variables on which a literal depends, now or later."""
        found: set[int] = set()
        waiting = [output >> 1]
        while waiting:
            variable = waiting.pop()
            if variable in found or variable == 0:
                continue
            found.add(variable)
            if variable in self._gates:
                waiting += [literal >> 1 for literal in self._gates[variable]]
            elif variable in self._next:
                waiting.append(self._next[variable] >> 1)
        return found

    def aiger(self, output: int) -> Aiger:
        """The part of the circuit that one output depends on."""
        needed = self._needed(output)
        inputs = [literal for literal in self.inputs if literal >> 1 in needed]
        latches = [variable for variable in self._next if variable in needed]
        gates = [variable for variable in self._gates if variable in needed]
        order = [literal >> 1 for literal in inputs] + latches + gates
        place = {0: 0} | {variable: number for number, variable in enumerate(order, 1)}

        def renamed(literal: int) -> int:
            return 2 * place[literal >> 1] + (literal & 1)

        content = bytearray(f"aig {len(order)} {len(inputs)} {len(latches)} 1 {len(gates)}\n".encode())
        content += "".join(f"{renamed(self._next[latch])}\n" for latch in latches).encode()
        content += f"{renamed(output)}\n".encode()
        for variable in gates:
            low, high = sorted(renamed(literal) for literal in self._gates[variable])
            content += _number(2 * place[variable] - high) + _number(high - low)
        return Aiger(bytes(content), tuple(inputs))


def _number(value: int) -> bytes:
    """Seven bits a byte, the lowest first; the high bit says that more follow."""
    result = bytearray()
    while value > 0x7F:
        result.append(value & 0x7F | 0x80)
        value >>= 7
    result.append(value)
    return bytes(result)
