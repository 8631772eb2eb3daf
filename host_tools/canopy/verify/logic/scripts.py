# SPDX-License-Identifier: MIT
"""What nodes ask in a circuit: scripts as they are compiled, or anything, where nothing is known of them."""

from __future__ import annotations

from collections.abc import Iterable

from canopy.compiler.blackboard import Entry, SignalName, pointer
from canopy.compiler.script.syntax import Assignment, Expression
from canopy.compiler.script_bodies import entry_value
from canopy.compiler.tree import Script
from canopy.verify.logic.board import FORMULA, Board, Fact, assignments
from canopy.verify.logic.circuit import TRUE, Circuit
from canopy.verify.logic.expressions import Expressions, TextValue, Value
from canopy.verify.logic.memory import Memory
from canopy.verify.logic.words import NotModelledError


class Scripts:
    """`board`: None when there are no real scripts, and each may answer anything.

    `free`: the answers, by the node and what is asked. `assumed`: nodes that may answer what the tree's do not.
    `unknown`: scripts that are not followed.
    """

    def __init__(self, circuit: Circuit, board: Board | None) -> None:
        self.circuit = circuit
        self.board = board
        self.memory = Memory(circuit, board) if board is not None else None
        self.free: dict[tuple[int, str], int] = {}
        self.assumed: set[int] = set()
        self.unknown: set[tuple[int, str]] = set()

    def ask(self, node: int, what: str, condition: int) -> int:
        """What a script answers, if it is run where the condition holds."""
        answer = self._ask(node, what, condition)
        self.free[node, what] = answer
        return answer

    def anything(self, node: int, what: str) -> int:
        """An answer that nothing is known of: of a timer, say."""
        return self.free.setdefault((node, what), self.circuit.input())

    def _ask(self, node: int, what: str, condition: int) -> int:
        script = self._script(node, what)
        if script is None or self.memory is None:
            self.assumed.add(node)
            return self.circuit.input()
        before = list(self.memory.now)
        try:
            return self._run(node, what, script, condition)
        except NotModelledError:
            self.memory.now = before
        self.assumed.add(node)
        self.unknown.add((node, what))
        for place in self.memory.board.targets(script):
            if place not in self.memory.board.open:
                written = self.circuit.both(condition, self.memory.bit("writes", node, what, place))
                new = self.memory.number((self.memory.board.limits(place),), "becomes", node, what, place)
                self.memory.write(place, written, new)
        return self.circuit.input()

    def _script(self, node: int, what: str) -> Script | None:
        return self.board.scripts.get((node, what)) if self.board is not None else None

    def run(self, node: int, what: str, condition: int) -> None:
        """Runs a script whose answer nobody asks for, if there is one."""
        if self._script(node, what) is not None:
            self.ask(node, what, condition)

    def _run(self, node: int, what: str, script: Script, condition: int) -> int:
        assert self.memory is not None
        board = self.memory.board
        values = Expressions(self.memory, script.scope, script.place(), (node, what))
        if script.role == "unset":
            target = script.target
            assert isinstance(target, Entry)
            place = board.place(target)
            if place is not None:
                start = self.memory.words.constant(board.initial(target))
                self.memory.write(place, condition, start, counts=False)
            return TRUE
        if script.role == "set":
            return self._set(script, values, condition)
        if script.role not in ("condition", "action"):
            raise NotModelledError("it is a queue")
        statements = board.read(script)
        if len(assignments(statements)) != sum(isinstance(one, Assignment) for one in statements):
            raise NotModelledError("it assigns inside an expression")
        self._note_open(node, script)
        known = self.memory.known(*board.needs(script.scope, script.place(), statements))
        result = self._statements(script, values, statements, self.circuit.both(condition, known))
        return self.circuit.both(known, result)

    def _note_open(self, node: int, script: Script) -> None:
        assert self.board is not None
        if self.board.open_in(script):
            self.assumed.add(node)

    def _statements(self, script: Script, values: Expressions, found: tuple[Expression, ...], condition: int) -> int:
        """Runs them; for a condition the literal that says that the last one is not 0."""
        for number, statement in enumerate(found, 1):
            last: Expression = statement
            if isinstance(statement, Assignment):
                self._assign(script, values, statement, condition)
                last = statement.target
            if number == len(found) and script.role == "condition":
                return values.truth(last)
        return TRUE

    def _assign(self, script: Script, values: Expressions, statement: Assignment, condition: int) -> None:
        target = script.scope.resolve(statement.target.name, script.place())
        if isinstance(target, SignalName):
            return  # an output: nothing reads it
        value = values.evaluate(statement.value)
        if statement.operator not in (":=", "="):
            value = values.computed(statement.operator[0], values.stored(target), value)
        self._store(target, values, value, condition)

    def _store(self, target: Entry, values: Expressions, value: Value, condition: int) -> None:
        assert self.memory is not None
        place = self.memory.board.place(target)
        if place is not None:  # of others nothing is known
            self.memory.write(place, condition, values.converted(value, target.type))

    def _set(self, script: Script, values: Expressions, condition: int) -> int:
        """SetBlackboard."""
        assert self.memory is not None
        source, target = entry_value(script), script.target
        assert isinstance(target, Entry)
        names = [source.text] if isinstance(source, SignalName) else []
        known = self.memory.known(*self.memory.board.needs_of(names))
        if self.memory.board.place(target) is None:
            return known
        if isinstance(source, str) and (target.type.names or source in script.scope.board.enums):
            raise NotModelledError("it sets a value of an enum")
        if isinstance(source, str):
            value = values.text(source) if target.type.kind == "text" else values.literal(source)
        else:
            value = values.target(source)
        self._store(target, values, value, self.circuit.both(condition, known))
        return known

    def fact(self, fact: Fact) -> int:
        """The literal of a condition of the formula, after all nodes."""
        assert self.memory is not None
        if fact.condition is None:
            return self.memory.fresh(fact.message)
        board = self.memory.board
        known = self.memory.known(*board.needs(board.main, FORMULA, [fact.condition]))
        return self.circuit.both(known, Expressions(self.memory, board.main, FORMULA, ()).truth(fact.condition))

    # Nodes that ask in their own way

    def watch(self, nodes: Iterable[int]) -> None:
        """These nodes ask whether their entries have been written."""
        for node in nodes:
            place = self._watched(node)
            if place is not None and self.memory is not None:
                self.memory.watch(node, place)

    def _watched(self, node: int) -> int | None:
        """The place of the entry that a node asks for; None if it is not followed."""
        script = self._script(node, "is true")
        place = self.board.place(script.target) if script is not None and self.board is not None else None
        return None if self.board is None or place in self.board.open else place

    def is_new(self, node: int, condition: int) -> int:
        """Has the entry of a node been written since it last asked?"""
        if self._watched(node) is None or self.memory is None:
            return self.ask(node, "is true", condition)
        self.free[node, "is true"] = self.memory.is_new(node, condition)
        return self.free[node, "is true"]

    def cases(self, node: int, count: int) -> list[int]:
        """For each case of a Switch, whether it is the first that matches."""
        script = self._script(node, "is true")
        try:
            if script is None or self.memory is None:
                raise NotModelledError("nothing is known of it")
            matches = self._matches(node, script, count)
        except NotModelledError:
            self.assumed.add(node)
            self.unknown.add((node, "is true"))
            matches = [self.circuit.input() for _ in range(count)]
        rest = TRUE
        for case, match in enumerate(matches):
            self.free[node, f"case {case}"] = self.circuit.both(rest, match)
            rest = self.circuit.both(rest, match ^ 1)
        return [self.free[node, f"case {case}"] for case in range(count)]

    def _matches(self, node: int, script: Script, count: int) -> list[int]:
        assert self.memory is not None
        self._note_open(node, script)
        values = Expressions(self.memory, script.scope, script.place(), (node, "is true"))
        texts = {f"case_{case + 1}": script.element.attributes[f"case_{case + 1}"] for case in range(count)}
        variable = self._named(script, values, "variable", script.text)
        known = self.memory.known(*self.memory.board.needs_of(self.memory.board.signals_in(script)))
        result = []
        for attribute, text in texts.items():
            case = self._named(script, values, attribute, text)
            if isinstance(variable, TextValue) and pointer(text, attribute) is None and not _is_text(case):
                raise NotModelledError("it compares a text with a number")
            if pointer(text, attribute) is None and _is_text(case):
                case = values.text(text)
            result.append(self.circuit.both(known, values.compared("==", variable, case)))
        return result

    @staticmethod
    def _named(script: Script, values: Expressions, attribute: str, text: str) -> Value:
        name = pointer(text, attribute)
        if name is None and text in script.scope.board.enums:
            raise NotModelledError("it names a value of an enum")
        return values.literal(text) if name is None else values.named(name)


def _is_text(value: Value) -> bool:
    return isinstance(value, TextValue)
