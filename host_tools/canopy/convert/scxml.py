# SPDX-License-Identifier: MIT
"""State machines in SCXML (W3C, 2015), as far as they become trees: everything else is rejected by name and line."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from canopy.compiler.errors import CompileError, Place, nearest
from canopy.compiler.xml_reader import Element, read_xml
from canopy.convert.writer import check_leaf_name

NAMESPACE = "http://www.w3.org/2005/07/scxml"
MAX_STATES = 1_000
MAX_DEPTH = 20

# What SCXML has and this has not, and what to do about it.
_MISSING = {
    "parallel": "convert each region by itself, and put the trees below a ReactiveParallel",
    "history": "make a state for each place to come back to",
    "initial": "write the attribute initial of the state; put the actions into <onentry>",
    "datamodel": "keep data in leaves, and ask it with cond, the ID of a Condition",
    "raise": "put the transition's actions here",
    "if": "make two transitions with cond",
    "log": "remove it",
    "script": 'write <send event="ID"/>: it calls the SyncAction of that ID',
    "assign": "keep data in leaves",
    "foreach": "do it in a leaf",
    "cancel": "sending is calling a leaf: there is nothing to cancel",
    "finalize": "do it in the activity",
    "donedata": "remove it",
}
_COND = re.compile(r"(!?)\s*([A-Za-z_]\w*)")
_DONE = re.compile(r"(done\.invoke|error\.platform)\.([A-Za-z_]\w*)")


@dataclass(frozen=True)
class Transition:
    """A transition. `events`: IDs of Conditions; `done`, `failed`: activities whose end is the event.

    `cond`: ID of a Condition, and whether it is negated. `target` None: nothing is exited or entered.
    """

    events: tuple[str, ...]
    done: tuple[str, ...]
    failed: tuple[str, ...]
    cond: tuple[str, bool] | None
    target: str | None
    actions: tuple[str, ...]
    place: Place


@dataclass(eq=False)
class Vertex:
    """A state. `entry`, `exit`: IDs of SyncActions; `activity`: the ID of a StatefulAction."""

    id: str
    place: Place
    parent: Vertex | None = None
    is_final: bool = False
    initial: str | None = None
    entry: tuple[str, ...] = ()
    exit: tuple[str, ...] = ()
    activity: str | None = None
    children: list[Vertex] = field(default_factory=list)
    transitions: list[Transition] = field(default_factory=list)

    def up(self) -> Iterator[Vertex]:
        """This state and those around it, the innermost first."""
        here: Vertex | None = self
        while here is not None:
            yield here
            here = here.parent


@dataclass
class Chart:
    """A state machine: its name, the initial state, and all states by ID in the order of the file."""

    name: str
    initial: str
    states: dict[str, Vertex]
    place: Place

    def atomic(self) -> list[Vertex]:
        """The states without states inside, in the order of the file."""
        return [state for state in self.states.values() if not state.children]

    def inner_initial(self, state: Vertex) -> list[Vertex]:
        """From a state down to the atomic one that entering it leads to, the state itself first."""
        path = [state]
        while path[-1].children:
            path.append(self.states[path[-1].initial] if path[-1].initial else path[-1].children[0])
        return path


def _reject(element: Element) -> CompileError:
    if element.tag in _MISSING:
        return CompileError(element.place, f"<{element.tag}> is not supported", _MISSING[element.tag])
    known = ("state", "final", "onentry", "onexit", "transition", "send", "invoke")
    return CompileError(element.place, f"<{element.tag}> is not supported here", nearest(element.tag, known))


def _only(element: Element, *known: str) -> None:
    for name in element.attributes:
        if name not in known and ":" not in name and name != "xmlns":
            raise CompileError(
                element.attribute_place(name), f"{name}='…' of <{element.tag}> is not supported", nearest(name, known)
            )


class _Reader:
    def __init__(self, root: Element) -> None:
        self.states: dict[str, Vertex] = {}
        if root.tag != "scxml" or root.attributes.get("xmlns", NAMESPACE) != NAMESPACE:
            raise CompileError(root.place, "the root is not <scxml>", f'<scxml xmlns="{NAMESPACE}" version="1.0">')
        _only(root, "initial", "name", "version", "datamodel")
        if root.attributes.get("datamodel", "null") != "null":
            raise CompileError(
                root.attribute_place("datamodel"),
                f"datamodel='{root.attributes['datamodel']}' is not supported",
                "cond is the ID of a Condition; data is in leaves",
            )
        top = [self._state(child, None, 1) for child in root.children]
        if not top:
            raise CompileError(root.place, "there is no state")
        self.chart = Chart(
            root.attributes.get("name", "StateMachine"),
            root.attributes.get("initial", top[0].id),
            self.states,
            root.place,
        )
        self._check_names(root)

    def _state(self, element: Element, parent: Vertex | None, depth: int) -> Vertex:
        if element.tag not in ("state", "final"):
            raise _reject(element)
        if element.tag == "final" and parent is not None:
            raise CompileError(
                element.place,
                "<final> inside a state is not supported",
                "make it a <state>, and its transitions its own",
            )
        if depth > MAX_DEPTH or len(self.states) == MAX_STATES:
            raise CompileError(element.place, f"more than {MAX_STATES} states, or {MAX_DEPTH} inside each other")
        _only(element, *(("id", "initial") if element.tag == "state" else ("id",)))
        name = element.attributes.get("id", "")
        if not name or name in self.states:
            raise CompileError(element.place, f"<{element.tag}> needs an id of its own, not '{name}'")
        state = Vertex(name, element.place, parent, element.tag == "final", element.attributes.get("initial"))
        self.states[name] = state
        for child in element.children:
            self._part(child, state, depth)
        if state.activity is not None and state.children:
            raise CompileError(
                state.place,
                f"<invoke> in '{name}', which has states inside, is not supported",
                "put it into each of the states inside",
            )
        return state

    def _part(self, child: Element, state: Vertex, depth: int) -> None:
        if child.tag == "onentry":
            state.entry += self._actions(child)
        elif child.tag == "onexit":
            state.exit += self._actions(child)
        elif child.tag == "transition" and not state.is_final:
            state.transitions.append(self._transition(child))
        elif child.tag == "invoke" and not state.is_final:
            self._invoke(child, state)
        elif child.tag in ("state", "final") and not state.is_final:
            state.children.append(self._state(child, state, depth + 1))
        else:
            raise _reject(child)

    @staticmethod
    def _actions(element: Element) -> tuple[str, ...]:
        found = []
        for child in element.children:
            if child.tag != "send":
                raise _reject(child)
            _only(child, "event")
            name = child.attributes.get("event", "")
            check_leaf_name(name, child.place)
            if child.children:
                raise _reject(child.children[0])
            found.append(name)
        return tuple(found)

    @staticmethod
    def _invoke(element: Element, state: Vertex) -> None:
        _only(element, "id")
        if state.activity is not None:
            raise CompileError(element.place, f"a second <invoke> in '{state.id}' is not supported")
        name = element.attributes.get("id", "")
        check_leaf_name(name, element.place)
        if element.children:
            raise _reject(element.children[0])
        state.activity = name

    def _transition(self, element: Element) -> Transition:
        _only(element, "event", "cond", "target", "type")
        if element.attributes.get("type", "external") != "external":
            raise CompileError(element.attribute_place("type"), "only external transitions are supported")
        events: list[str] = []
        done: list[str] = []
        failed: list[str] = []
        for event in element.attributes.get("event", "").split():
            ended = _DONE.fullmatch(event)
            if ended is not None:
                (done if ended[1] == "done.invoke" else failed).append(ended[2])
                continue
            if not event.isidentifier():
                raise CompileError(
                    element.attribute_place("event"),
                    f"event '{event}' is not supported",
                    "the ID of a Condition, done.invoke.ID, or error.platform.ID",
                )
            check_leaf_name(event, element.attribute_place("event"))
            events.append(event)
        if not events and not done and not failed:
            raise CompileError(
                element.place,
                "a transition without an event is not supported",
                "give it one: the ID of a Condition, which is asked in each tick",
            )
        cond = None
        if "cond" in element.attributes:
            found = _COND.fullmatch(element.attributes["cond"].strip())
            if found is None:
                raise CompileError(
                    element.attribute_place("cond"),
                    f"cond='{element.attributes['cond']}' is not supported",
                    "the ID of a Condition, or ! and the ID",
                )
            check_leaf_name(found[2], element.attribute_place("cond"))
            cond = (found[2], found[1] == "!")
        target = element.attributes.get("target")
        return Transition(
            tuple(events), tuple(done), tuple(failed), cond, target, self._actions(element), element.place
        )

    def _check_names(self, root: Element) -> None:
        """Every state that is named is there, and where it has to be."""
        if self.chart.initial not in self.states:
            raise CompileError(root.place, f"no state '{self.chart.initial}'", nearest(self.chart.initial, self.states))
        for state in self.states.values():
            inside = [child.id for child in state.children]
            if state.initial is not None and state.initial not in inside:
                raise CompileError(
                    state.place,
                    f"initial='{state.initial}' is no child of '{state.id}'",
                    nearest(state.initial, inside),
                )
            activities = {s.activity for s in self.states.values() if s.activity and state in s.up()}
            for transition in state.transitions:
                if transition.target is not None and transition.target not in self.states:
                    raise CompileError(
                        transition.place,
                        f"no state '{transition.target}'",
                        nearest(transition.target, self.states),
                    )
                for activity in (*transition.done, *transition.failed):
                    if activity not in activities:
                        raise CompileError(
                            transition.place,
                            f"'{activity}' is no activity of '{state.id}', or of a state inside it",
                            nearest(activity, [name for name in activities if name]),
                        )


def read_scxml(path: Path) -> Chart:
    """Reads a state machine.

    Raises:
        CompileError: it cannot be read, or has in it what does not become a tree: named, with the line.
    """
    return _Reader(read_xml(path)).chart
