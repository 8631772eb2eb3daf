# SPDX-License-Identifier: MIT
"""The built-in nodes whose attributes are scripts, entries or lists: from XML to nodes that name scripts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from canopy.compiler.blackboard import Blackboard, Entry, Scope, SignalName, Use, pointer
from canopy.compiler.errors import CompileError, nearest
from canopy.compiler.node_types import node_types
from canopy.compiler.port_types import ANY, BOOL, DOUBLE, INT32, PORT_TYPES, TEXT, Options, PortType
from canopy.compiler.tree import Node, Role, Script
from canopy.compiler.xml_reader import Element

# As in canopy/status.h.
STATUSES = {"RUNNING": 1, "SUCCESS": 2, "FAILURE": 3, "SKIPPED": 4}

PRECONDITIONS = ("_failureIf", "_successIf", "_skipIf", "_while")
POSTCONDITIONS = ("_onSuccess", "_onFailure", "_post", "_onHalted")

LOOP_ITEMS: dict[str, PortType] = {"LoopInt": INT32, "LoopBool": BOOL, "LoopDouble": DOUBLE, "LoopString": TEXT}


@dataclass
class Context:
    """What making nodes needs and adds to."""

    options: Options
    board: Blackboard
    scripts: list[Script] = field(default_factory=list)

    def script(self, role: Role, element: Element, attribute: str, scope: Scope) -> Script:
        """A new script, from an attribute that must be there."""
        script = Script(role, element, attribute, scope)
        if not script.text.strip():
            raise CompileError(element.place, f"<{element.tag}> needs the attribute {attribute}")
        self.scripts.append(script)
        return script

    def entry(
        self, element: Element, attribute: str, scope: Scope, what: str, *, writes: bool, kind: PortType
    ) -> Entry:
        """The entry that an attribute names, with or without braces."""
        text = element.attributes.get(attribute, "")
        place = element.attribute_place(attribute)
        if not text.strip():
            raise CompileError(
                element.place, f"<{element.tag}> needs the attribute {attribute}", f'{attribute}="{{name}}"'
            )
        inner = pointer(text, attribute)
        target = scope.resolve(inner if inner is not None else text.strip(), place)
        if isinstance(target, SignalName):
            raise CompileError(place, f"{attribute}: '{target.text}' is a signal, and an entry is needed here")
        target.connect(Use(kind, place, what, writes))
        return target


def _check(element: Element, allowed: tuple[str, ...]) -> None:
    known = {*allowed, "name", "ID"}
    for attribute in element.attributes:
        if not attribute.startswith("_") and attribute not in known:
            raise CompileError(
                element.attribute_place(attribute),
                f"<{element.tag}> has no attribute '{attribute}'",
                nearest(attribute, known),
            )


def _status(element: Element, attribute: str, default: str) -> int:
    text = element.attributes.get(attribute, default)
    if text not in STATUSES:
        raise CompileError(
            element.attribute_place(attribute), f"{attribute}='{text}' is no status", nearest(text, STATUSES)
        )
    return STATUSES[text]


def _node(type_name: str, xml_name: str, element: Element, parameters: tuple[int | Script, ...] = ()) -> Node:
    name = element.attributes.get("name", xml_name)
    return Node(node_types()[type_name], name, element.place, parameters, xml_name=xml_name)


def _script(context: Context, element: Element, scope: Scope, xml_name: str) -> Node:
    _check(element, ("code",))
    is_condition = xml_name == "ScriptCondition"
    node = _node("Condition" if is_condition else "SyncAction", xml_name, element)
    node.script = context.script("condition" if is_condition else "action", element, "code", scope)
    return node


def _set(context: Context, element: Element, scope: Scope, xml_name: str) -> Node:
    attribute = "output_key" if xml_name == "SetBlackboard" else "key"
    _check(element, ("value", "output_key") if xml_name == "SetBlackboard" else ("key",))
    node = _node("SyncAction", xml_name, element)
    what = f"<{xml_name} {attribute}>"
    target = context.entry(element, attribute, scope, what, writes=True, kind=ANY)
    if xml_name == "SetBlackboard":
        if "value" not in element.attributes:
            raise CompileError(element.place, "<SetBlackboard> needs the attribute value")
        script = Script("set", element, "value", scope, target=target)
        context.scripts.append(script)
    else:
        script = context.script("unset", element, "key", scope)
        script.target = target
    node.script = script
    return node


def _precondition(context: Context, element: Element, scope: Scope, xml_name: str) -> Node:
    _check(element, ("if", "else"))
    script = context.script("condition", element, "if", scope)
    return _node("Precondition", xml_name, element, (script, _status(element, "else", "FAILURE")))


def _test_node(context: Context, element: Element, scope: Scope, xml_name: str) -> Node:
    scripts = ("success_script", "failure_script", "post_script")
    if "return_status_script" in element.attributes:
        raise CompileError(
            element.attribute_place("return_status_script"),
            "return_status_script is not supported",
            "give return_status, or write the leaf: canopy compile --stubs",
        )
    _check(element, ("return_status", "async_delay", *scripts))
    status = _status(element, "return_status", "SUCCESS")
    if status == STATUSES["RUNNING"]:
        raise CompileError(
            element.attribute_place("return_status"),
            "return_status='RUNNING' would never be done",
            "<KeepRunningUntilFailure><AlwaysSuccess/></KeepRunningUntilFailure> is RUNNING for ever",
        )
    text = element.attributes.get("async_delay", "0")
    if not text.isdecimal() or int(text) >= 2**31:
        raise CompileError(
            element.attribute_place("async_delay"), f"async_delay='{text}' is no time in ms", "0 to 2147483647"
        )
    parameters = [context.script("action", element, s, scope) if element.attributes.get(s) else -1 for s in scripts]
    return _node("TestNode", xml_name, element, (status, int(text), *parameters))


def _updated(context: Context, element: Element, scope: Scope, xml_name: str) -> Node:
    _check(element, ("entry",))
    target = context.entry(element, "entry", scope, f"<{xml_name} entry>", writes=False, kind=ANY)
    target.counted = True
    script = context.script("updates", element, "entry", scope)
    script.target = target
    return _node(xml_name, xml_name, element, (script,))


def _switch(context: Context, element: Element, scope: Scope, xml_name: str) -> Node:
    cases = int(xml_name.removeprefix("Switch"))
    names = tuple(f"case_{number}" for number in range(1, cases + 1))
    _check(element, ("variable", *names))
    for name in names:
        if name not in element.attributes:
            raise CompileError(element.place, f"<{xml_name}> needs the attribute {name}")
    if len(element.children) != cases + 1:
        raise CompileError(
            element.place,
            f"<{xml_name}> needs exactly {cases + 1} child nodes (one a case, and the default), "
            f"and has {len(element.children)}",
        )
    return _node("Switch", xml_name, element, (context.script("switch", element, "variable", scope),))


def _loop(context: Context, element: Element, scope: Scope, xml_name: str) -> Node:
    _check(element, ("queue", "if_empty", "value"))
    kind = LOOP_ITEMS[xml_name]
    if kind.kind == "float" and not context.options.floats:
        raise CompileError(
            element.place,
            "<LoopDouble> is floating point, which this application does not allow",
            "use LoopInt with a smaller unit, or compile with --allow-floating-point",
        )
    if "queue" not in element.attributes:
        raise CompileError(element.place, f"<{xml_name}> needs the attribute queue", 'for example queue="1;2;3"')
    script = Script("take", element, "queue", scope)  # it may be empty: a loop over nothing
    context.scripts.append(script)
    script.type = kind
    script.target = context.entry(element, "value", scope, f"<{xml_name} value>", writes=True, kind=kind)
    node = _node("Loop", xml_name, element, (script, _status(element, "if_empty", "SUCCESS")))
    script.node = node
    if pointer(script.text, "queue") is not None:
        script.queue = context.entry(element, "queue", scope, f"<{xml_name} queue>", writes=False, kind=ANY)
    script.state = context.board.make(f"next item at line {element.place.line}", scope.path, element.place)
    script.state.connect(Use(PORT_TYPES["uint16_t"], element.place, f"<{xml_name}>", True))
    return node


Maker = Callable[[Context, Element, Scope, str], Node]

SCRIPTED: dict[str, Maker] = {
    "Script": _script,
    "ScriptCondition": _script,
    "SetBlackboard": _set,
    "UnsetBlackboard": _set,
    "Precondition": _precondition,
    "TestNode": _test_node,
    "SkipUnlessUpdated": _updated,
    "WaitValueUpdate": _updated,
    "WasEntryUpdated": _updated,
    **{f"Switch{number}": _switch for number in range(2, 7)},
    **dict.fromkeys(LOOP_ITEMS, _loop),
}


def attributes_node(context: Context, element: Element, scope: Scope) -> Node | None:
    """The node that stands above one that has pre- or postconditions; None when it has none."""
    kind = node_types()["Attributes"]
    names = [parameter.name for parameter in kind.parameters]
    if not any(name in element.attributes for name in names):
        return None
    parameters: list[int | Script] = []
    for name in names:
        if not element.attributes.get(name, "").strip():
            parameters.append(-1)
        else:
            role: Role = "condition" if name in PRECONDITIONS else "action"
            parameters.append(context.script(role, element, name, scope))
    label = " ".join(name for name in names if name in element.attributes)
    return Node(kind, label, element.place, tuple(parameters), xml_name="Attributes")
