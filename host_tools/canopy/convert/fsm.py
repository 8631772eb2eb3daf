# SPDX-License-Identifier: MIT
"""A state machine as a behaviour tree.

In each tick at most one transition is taken: of the active state, then of those around it, the first in the order of
the file whose event is there and whose cond holds. Its tick runs exit, transition and entry actions, and halts the
activity; the new state's activity starts in the next tick.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from canopy.convert.scxml import Chart, Transition, Vertex
from canopy.convert.writer import LeafModel, composite, node
from canopy.fmt.document import Element

STATE, ENDED = "fsm_state", "fsm_ended"
"""Entries: the number of the active state, 0 before the first tick; 1, 2: its activity has succeeded, failed."""

_NO_EVENT = "canopy:allow hidden-failure: no transition is taken"
_POLITE = "canopy:allow hidden-failure: a transition is taken as a whole"


@dataclass(frozen=True)
class Taken:
    """What taking a transition does: actions in order, and the state that is active afterwards (None: no change)."""

    actions: tuple[str, ...]
    goes_to: Vertex | None


def effect(chart: Chart, source: Vertex, active: Vertex, transition: Transition) -> Taken:
    """SCXML's rules: out to the nearest state around the source that has the target inside, and in from there."""
    if transition.target is None:
        return Taken(transition.actions, None)
    target = chart.states[transition.target]
    around = [state for state in source.up() if state is not source]
    common = next((state for state in around if state is not target and state in target.up()), None)
    left = _until(active, common)
    entered = [*reversed(_until(target, common)), *chart.inner_initial(target)[1:]]
    out = tuple(action for state in left for action in state.exit)
    into = tuple(action for state in entered for action in state.entry)
    return Taken((*out, *transition.actions, *into), entered[-1])


def _until(state: Vertex, end: Vertex | None) -> list[Vertex]:
    """The state and those around it, up to `end`, which is not among them."""
    found = []
    for here in state.up():
        if here is end:
            break
        found.append(here)
    return found


def start_effect(chart: Chart) -> Taken:
    """What the first tick does."""
    first = chart.states[chart.initial]
    entered = [*reversed(list(first.up())), *chart.inner_initial(first)[1:]]
    return Taken(tuple(action for state in entered for action in state.entry), entered[-1])


def candidates(active: Vertex) -> Iterator[tuple[Vertex, Transition]]:
    """The transitions that can be taken in a state, in the order in which they are tried."""
    for state in active.up():
        for transition in state.transitions:
            yield state, transition


class _Converter:
    def __init__(self, chart: Chart) -> None:
        self._chart = chart
        self._atomic = chart.atomic()
        self._numbers = {state.id: number for number, state in enumerate(self._atomic, 1)}
        self._activities = any(state.activity for state in self._atomic)
        self.leaves: list[LeafModel] = []

    def _leaf(self, name: str, kind: str) -> Element:
        self.leaves.append(LeafModel(name, kind))
        return node(name)

    @staticmethod
    def _idle() -> Element:
        return node("KeepRunningUntilFailure", node("AlwaysSuccess"))

    def _taken(self, taken: Taken) -> list[Element]:
        parts = [node("ForceSuccess", self._leaf(a, "SyncAction"), _description=_POLITE) for a in taken.actions]
        if taken.goes_to is not None:
            code = f"{STATE} := {self._numbers[taken.goes_to.id]}" + (f"; {ENDED} := 0" if self._activities else "")
            parts += [node("Script", code=code), self._idle()]
        return parts

    def _event(self, transition: Transition, active: Vertex) -> Element | None:
        """What asks for the events; None when none of them can come in this state."""
        asked = [self._leaf(event, "Condition") for event in transition.events]
        for code, names in ((1, transition.done), (2, transition.failed)):
            if active.activity in names:
                asked.append(node("ScriptCondition", code=f"{ENDED} == {code}"))
        return composite("ReactiveFallback", asked) if asked else None

    def _transitions(self, active: Vertex) -> Element | None:
        ways = []
        for source, transition in candidates(active):
            event = self._event(transition, active)
            if event is None:
                continue
            parts = [event]
            if transition.cond is not None:
                condition = self._leaf(transition.cond[0], "Condition")
                parts.append(node("Inverter", condition) if transition.cond[1] else condition)
            parts += self._taken(effect(self._chart, source, active, transition))
            ways.append(composite("ReactiveSequence", parts))
        if not ways:
            return None
        guard = node("ScriptCondition", code=f"{STATE} == {self._numbers[active.id]}")
        return node("ReactiveSequence", guard, composite("ReactiveFallback", ways), name=f"leave {active.id}")

    def _activity(self, state: Vertex) -> Element:
        assert state.activity is not None
        code = f"{STATE} == {self._numbers[state.id]} && {ENDED} == 0"
        done = node(
            "ReactiveSequence", self._leaf(state.activity, "StatefulAction"), node("Script", code=f"{ENDED} := 1")
        )
        ended = node("ReactiveFallback", done, node("Script", code=f"{ENDED} := 2"))
        return node(
            "ReactiveSequence",
            node("ScriptCondition", code=code),
            ended,
            node("AlwaysFailure"),
            name=f"in {state.id}",
        )

    def root(self) -> Element:
        """The tree."""
        begin = node("ScriptCondition", code=f"{STATE} == 0")
        first = node("ReactiveSequence", begin, *self._taken(start_effect(self._chart)), name="start")
        leave = [way for way in map(self._transitions, self._atomic) if way is not None]
        acting = [self._activity(state) for state in self._atomic if state.activity is not None]
        finals = [f"{STATE} == {self._numbers[state.id]}" for state in self._atomic if state.is_final]
        if finals:
            acting.insert(0, node("ScriptCondition", code=" || ".join(finals)))
        return node(
            "ReactiveSequence",
            node("ReactiveFallback", first, *leave, node("AlwaysSuccess", _description=_NO_EVENT), name="transitions"),
            composite("ReactiveFallback", [*acting, self._idle()]),
        )


def convert(chart: Chart) -> tuple[Element, list[LeafModel]]:
    """The tree of a state machine, and its leaves."""
    converter = _Converter(chart)
    return converter.root(), converter.leaves
