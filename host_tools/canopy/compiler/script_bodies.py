# SPDX-License-Identifier: MIT
"""The bodies of the C functions that scripts become, by what the script is for (tree.Role)."""

from __future__ import annotations

from fractions import Fraction

from canopy.compiler.blackboard import Entry, SignalName, pointer
from canopy.compiler.bus_reader import Bus
from canopy.compiler.limits import count
from canopy.compiler.port_types import TEXT, literal
from canopy.compiler.script.compile import FAULTS, Compiler, Texts, guess
from canopy.compiler.script.storing import stripped
from canopy.compiler.script.syntax import Assignment, Expression, ScriptError
from canopy.compiler.script.values import Const, Num, TextConst, TextVar, Value, boolean
from canopy.compiler.tree import Script
from canopy.escape.c import emits_c
from canopy.tree.lists import items_of, queue_literal


def entry_value(script: Script) -> Entry | SignalName | str:
    """What SetBlackboard's value is: an entry or a signal in braces, or a literal."""
    name = pointer(script.text, "value")
    return script.text if name is None else script.scope.resolve(name, script.place())


def _cases(script: Script) -> int:
    """How many cases a Switch has; that is the place of its default, too."""
    return sum(name.startswith("case_") for name in script.element.attributes)


def _is_number(text: str, number: Const) -> bool:
    value = guess(text)
    return isinstance(value, Const) and not value.is_bool and not number.is_bool and value.value == number.value


class Bodies:
    """Compiles scripts. `indices`: the place of each node (by its id()) in the node table."""

    def __init__(self, bus: Bus, texts: Texts, floats: bool, indices: dict[int, int]) -> None:
        self._bus = bus
        self._texts = texts
        self._floats = floats
        self._indices = indices
        self.all_texts_are_known = False

    def body(self, script: Script, statements: tuple[Expression, ...]) -> tuple[str, ...]:
        """The lines of the function, without its head."""
        compiler = Compiler(script.scope, script.place(), self._bus, self._texts, self._floats)
        if script.role in ("condition", "action"):
            lines = self._statements(compiler, script, statements)
        elif script.role == "switch":
            lines = self._switch(compiler, script)
        elif script.role == "updates":
            assert isinstance(script.target, Entry)
            lines = [f"return (int32_t)app->entries.{script.target.c_name}_updates;"]
        elif script.role == "take":
            lines = self._take(compiler, script)
        elif script.role == "parameter":
            lines = self._parameter(compiler, script)
        else:
            lines = self._set(compiler, script)
        return (*self._guard(compiler, _cases(script) if script.role == "switch" else 0), *lines)

    @staticmethod
    def _guard(compiler: Compiler, otherwise: int) -> list[str]:
        """A script that reads a stale signal is not run, but answers `otherwise`; not if it asks for .fresh itself."""
        stale = [message for name, message in compiler.used.items() if name not in compiler.tested]
        flags = sorted(f"app->input.{message.c_name}.fresh" for message in stale)
        flags += sorted(compiler.parts)
        if not flags:
            return []
        tests = " || ".join(f"!{flag}" for flag in flags)
        return [f"if ({tests}) {{", f"    return {otherwise};", "}"]

    def _statements(self, compiler: Compiler, script: Script, statements: tuple[Expression, ...]) -> list[str]:
        lines = [line for statement in statements[:-1] for line in compiler.statement(statement)]
        last = statements[-1]
        if script.role == "action":
            return [*lines, *compiler.statement(last), "return 1;"]
        if isinstance(last, Assignment):
            lines += compiler.statement(last)
            last = last.target
        truth = compiler.truth(last)
        lines += compiler.first()
        return [*lines, f"return {int(truth.value)};" if isinstance(truth, Const) else f"return {stripped(truth.c)};"]

    def _value(self, compiler: Compiler, script: Script, text: str, own_name: str) -> Value:
        name = pointer(text, own_name)
        if name is None and text in script.scope.board.enums:
            return Const(Fraction(script.scope.board.enums[text]))
        return guess(text) if name is None else compiler.named(name, 0)

    def _switch(self, compiler: Compiler, script: Script) -> list[str]:
        value = self._value(compiler, script, script.text, "variable")
        lines: list[str] = []
        for place in range(_cases(script)):
            attribute = f"case_{place + 1}"
            text = script.element.attributes[attribute]
            case = self._value(compiler, script, text, attribute)
            if isinstance(value, TextVar) or (isinstance(value, Num) and value.choices and isinstance(case, TextConst)):
                case = TextConst(text) if pointer(text, attribute) is None else case
            answer = self._matches(compiler, value, case)
            if isinstance(answer, Const):
                if answer.value:
                    return [*lines, f"return {place};"]
                continue
            lines += [f"if {answer.c if answer.c.startswith('(') else f'({answer.c})'} {{", f"    return {place};", "}"]
        return [*lines, f"return {_cases(script)};"]

    def _matches(self, compiler: Compiler, value: Value, case: Value) -> Num | Const:
        """Equal; of texts also those that are the same number, as in BehaviorTree.CPP: 5 and 5.0."""
        answer = compiler.compare_values("==", value, case)
        number = guess(case.text) if isinstance(case, TextConst) else None
        if not isinstance(value, TextVar) or not isinstance(number, Const) or not self.all_texts_are_known:
            return answer
        places = [place for place, text in enumerate(self._texts.all) if _is_number(text, number)]
        return boolean(f"({' || '.join(f'{value.c} == {place}u' for place in places)})") if places else answer

    def _take(self, compiler: Compiler, script: Script) -> list[str]:
        assert isinstance(script.target, Entry)
        assert script.type is not None
        if script.queue is not None and not script.queue.is_constant:
            return self._take_from_entry(compiler, script, script.queue, script.target)
        assert script.state is not None
        place = script.place()
        texts = items_of(script.text if script.queue is None else script.queue.initial or "")
        if not texts:
            return ["return 0; /* the list is empty */"]
        count(texts, "items of the list", place)
        if script.type == TEXT:
            items, c_type = [f"{self._texts.index(text)}u" for text in texts], "uint16_t"
        else:
            items = [literal(text, script.type, "queue", place) for text in texts]
            c_type = script.type.c
        state = f"app->entries.{script.state.c_name}"
        return [
            f"static const {c_type} items[] = {{{', '.join(items)}}};",
            "",
            f"if (!canopy_status_runs(app->tree.status[{self._indices[id(script.node)]}])) {{",
            f"    {state} = 0;",
            "}",
            f"if ({state} == {len(items)}u) {{",
            "    return 0;",
            "}",
            *compiler.store(script.target, f"items[{state}]"),
            f"{state}++;",
            "return 1;",
        ]

    @staticmethod
    def _take_from_entry(compiler: Compiler, script: Script, queue: Entry, target: Entry) -> list[str]:
        assert script.type is not None
        kind = queue.type
        if kind.item != script.type.c:
            items, name = ("texts", "std::string") if script.type == TEXT else (script.type.c, script.type.c)
            raise ScriptError(
                0,
                f"entry '{queue.name}' is {kind}, and a queue of {items} is needed",
                f"declare the port that fills it as type='{name}[8]'",
            )
        member = f"app->entries.{queue.c_name}"
        return [
            f"if ({member}.count == 0u) {{",
            "    return 0;",
            "}",
            f"if ({member}.count > {kind.capacity}u) {{",
            f"    canopy_script_fault({FAULTS});",
            f"    {member}.count = {kind.capacity}u;",
            "}",
            *compiler.store(target, f"{member}.items[0]"),
            f"{member}.count--;",
            f"memmove(&{member}.items[0], &{member}.items[1], {member}.count * sizeof {member}.items[0]);",
            "return 1;",
        ]

    def _set(self, compiler: Compiler, script: Script) -> list[str]:
        target = script.target
        assert isinstance(target, Entry)
        if script.role == "unset":
            return [*initial_lines(target, self._texts), "return 1;"]
        source = entry_value(script)
        if isinstance(source, Entry) and source.type.kind == "user" and source.type == target.type:
            return [*compiler.store(target, f"app->entries.{source.c_name}"), "return 1;"]
        if isinstance(source, str) and target.type.kind in ("user", "float"):
            c = literal(source, target.type, "value", script.place())
        elif isinstance(source, str) and target.type == TEXT:
            c = compiler.storing.convert(TextConst(source), TEXT, 0)
        else:
            value = guess(source) if isinstance(source, str) else compiler.target_value(source, 0)
            c = compiler.storing.convert(value, target.type, 0)
        return [*compiler.store(target, c), "return 1;"]

    def _parameter(self, compiler: Compiler, script: Script) -> list[str]:
        assert script.target is not None
        value = compiler.target_value(script.target, 0)
        return [f"return {stripped(compiler.storing.parameter(value, script.least))};"]


@emits_c
def initial_lines(entry: Entry, texts: Texts) -> list[str]:
    """C lines that give an entry the value it begins with: the literal of its SubTree, else 0."""
    member = f"app->entries.{entry.c_name}"
    if entry.initial is not None and entry.type == TEXT:
        return [f"{member} = {texts.index(entry.initial)}u;"]
    if entry.initial is not None:
        if entry.type.item:
            where = f"entry {entry.name!r}"
            c = queue_literal(entry.initial, entry.type, where, entry.place, texts)
            return [f"{member} = ({entry.type.c}){{{c}}};"]
        return [f"{member} = {literal(entry.initial, entry.type, f'entry {entry.name!r}', entry.place)};"]
    if entry.type.kind == "user":
        return [f"memset(&{member}, 0, sizeof {member});"]
    return [f"{member} = {'false' if entry.type.kind == 'bool' else '0'};"]
