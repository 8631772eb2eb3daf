# SPDX-License-Identifier: MIT
"""The entries and the input image in a circuit: what they hold at the place that the tick has come to."""

from __future__ import annotations

import itertools

from canopy.compiler.bus_model import Ranges
from canopy.verify.logic.board import Board
from canopy.verify.logic.circuit import FALSE, Circuit
from canopy.verify.logic.words import Word, Words

Key = tuple[str | int, ...]
"""What an input of the circuit is: its kind, then the message, the signal, the node, the script, the entry it is of."""


class Memory:
    """`bits`, `numbers`: the inputs that were made, which a trace gives to the reference model."""

    def __init__(self, circuit: Circuit, board: Board) -> None:
        self.board = board
        self.circuit = circuit
        self.words = Words(circuit)
        self.bits: dict[Key, int] = {}
        self.numbers: dict[Key, Word] = {}
        self._latches = [
            self.words.latch(board.initial(entry), *board.limits(place)) for place, entry in enumerate(board.entries)
        ]
        self.now: list[Word] = list(self._latches)
        """What each entry holds; of an open one nothing is known."""
        self._watched: list[tuple[int, int, int]] = []
        self._new: dict[int, int] = {}

    def bit(self, *key: str | int) -> int:
        """An input that is true or false."""
        if key not in self.bits:
            self.bits[key] = self.circuit.input()
        return self.bits[key]

    def number(self, ranges: Ranges, *key: str | int) -> Word:
        """An input that is any number of some ranges."""
        if key not in self.numbers:
            self.numbers[key] = self._any_of(ranges)
        return self.numbers[key]

    def _any_of(self, ranges: Ranges) -> Word:
        words = self.words
        chosen = words.input(0, sum(high - low + 1 for low, high in ranges) - 1)
        result = words.add(chosen, words.constant(ranges[0][0]))
        passed = 0
        for (low, high), (following, _) in itertools.pairwise(ranges):
            passed += high - low + 1
            beyond = words.less(words.constant(passed - 1), chosen)
            result = words.choose(beyond, words.add(chosen, words.constant(following - passed)), result)
        return Word(words.limited(result, ranges[0][0], ranges[-1][1]).bits, ranges[0][0], ranges[-1][1])

    # The input image

    def fresh(self, message: str) -> int:
        """Is a message fresh in this tick?"""
        return self.bit("fresh", message)

    def come(self, signal: str) -> int:
        """Has a multiplexed signal come?"""
        return self.bit("come", signal)

    def known(self, messages: set[str], signals: set[str]) -> int:
        """Is everything known that a leaf or script needs to be run?"""
        literals = [self.fresh(name) for name in sorted(messages)] + [self.come(name) for name in sorted(signals)]
        return self.circuit.all(literals)

    def signal(self, name: str) -> Word | None:
        """The raw value of a received signal; None: of a float."""
        received = self.board.received(name)
        if received is None:
            return None
        valid = self.fresh(received.message.name)
        if received.signal.selectors:
            valid = self.circuit.both(valid, self.come(name))
        value = self.number(received.values, "signal", name)
        if received.ever == received.values:
            return value
        return self.words.choose(valid, value, self.number(received.ever, "old signal", name))

    # Entries

    def read(self, place: int, *key: str | int) -> Word:
        """What an entry holds. What a script reads of an open one is anything, but the same in the whole script."""
        if place in self.board.open:
            return self.number((self.board.limits(place),), "read", *key, place)
        return self.now[place]

    def write(self, place: int, condition: int, value: Word, *, counts: bool = True) -> None:
        """Writes an entry if the condition holds. The value is in the entry's range. `counts`: is that an update?"""
        if place in self.board.open:
            return
        chosen = self.words.choose(condition, value, self.now[place])
        self.now[place] = Word(chosen.bits, *self.board.limits(place))
        for node, watched, _ in self._watched:
            if counts and watched == place:
                self._new[node] = self.circuit.either(self._new[node], condition)

    def called(self, node: int, condition: int) -> None:
        """A leaf is called if the condition holds: it may write what its ports are connected to."""
        for place, choices in self.board.may_write.get(node, ()):
            written = self.circuit.both(condition, self.bit("writes", node, place))
            self.write(place, written, self.number(choices, "value", node, place))

    def watch(self, node: int, place: int) -> None:
        """A node asks whether an entry has been written; before the first tick none has."""
        latch = self.circuit.latch()
        self._watched.append((node, place, latch))
        self._new[node] = latch

    def is_new(self, node: int, condition: int) -> int:
        """Has the entry of a node been written since the node last asked? It asks if the condition holds."""
        answer = self._new[node]
        self._new[node] = self.circuit.choose(condition, FALSE, answer)
        return answer

    def held(self) -> list[Word | None]:
        """What each entry holds after the tick; None: it is open."""
        return [None if place in self.board.open else word for place, word in enumerate(self.now)]

    def settle(self) -> None:
        """The tick is over."""
        for place, latch in enumerate(self._latches):
            self.words.keep(latch, self.now[place])
        for node, _, watch in self._watched:
            self.circuit.follow(watch, self._new[node])
