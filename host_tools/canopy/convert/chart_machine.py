# SPDX-License-Identifier: MIT
"""A state machine itself, ticked: what its tree is compared with.

Written after the W3C's algorithm (exit set, entry set, order of the document), not after the converter: two ways from
one file to what happens.
"""

from __future__ import annotations

from canopy.convert.equivalence import Answers, Shown, State
from canopy.convert.scxml import Chart, Transition, Vertex
from canopy.semantics.spec import CONTINUE, FAILURE, HALTED, RUNNING, START, SUCCESS

Call = tuple[tuple[str, tuple[()]], int]


class ChartMachine:
    """Its state: the active states, how the activity has ended (1 well, 2 badly, else 0), and whether it is running."""

    def __init__(self, chart: Chart) -> None:
        self._chart = chart
        self._order = {name: number for number, name in enumerate(chart.states)}

    def start(self) -> State:
        """Before the first tick."""
        return frozenset(), 0, False

    def _entry_set(self, target: Vertex, domain: Vertex | None) -> set[str]:
        """The target, what it contains by default, and what contains it below `domain`."""
        entered = {target.id}
        below = target
        while below.children:
            below = self._chart.states[below.initial or below.children[0].id]
            entered.add(below.id)
        above = target.parent
        while above is not domain and above is not None:
            entered.add(above.id)
            above = above.parent
        return entered

    def _is_inside(self, name: str, domain: Vertex | None) -> bool:
        here = self._chart.states[name].parent
        while here is not None and here is not domain:
            here = here.parent
        return here is domain

    def _domain(self, source: Vertex, target: Vertex) -> Vertex | None:
        """The innermost state that properly contains both."""
        here = source.parent
        while here is not None and not self._is_inside(target.id, here):
            here = here.parent
        return here

    def _calls(self, leaves: tuple[str, ...]) -> list[Call]:
        return [((leaf, ()), START) for leaf in leaves]

    def _enter(self, entered: set[str]) -> list[Call]:
        in_order = sorted(entered, key=self._order.__getitem__)
        return [call for name in in_order for call in self._calls(self._chart.states[name].entry)]

    def _take(
        self, active: frozenset[str], source: Vertex, transition: Transition, target: Vertex
    ) -> tuple[frozenset[str], list[Call]]:
        domain = self._domain(source, target)
        left = {name for name in active if self._is_inside(name, domain)}
        calls: list[Call] = []
        for name in sorted(left, key=self._order.__getitem__, reverse=True):
            calls += self._calls(self._chart.states[name].exit)
        entered = self._entry_set(target, domain)
        calls += self._calls(transition.actions) + self._enter(entered)
        return (active - left) | entered, calls

    def _is_enabled(self, transition: Transition, activity: str | None, ended: int, answers: Answers) -> bool:
        come = SUCCESS in [answers.ask((event, ()), (SUCCESS, FAILURE)) for event in transition.events]
        come = come or (ended == 1 and activity in transition.done) or (ended == 2 and activity in transition.failed)
        if not come or transition.cond is None:
            return come
        return (answers.ask((transition.cond[0], ()), (SUCCESS, FAILURE)) == SUCCESS) != transition.cond[1]

    def _select(self, leaf: Vertex, ended: int, answers: Answers) -> tuple[Vertex, Transition] | None:
        here: Vertex | None = leaf
        while here is not None:
            for transition in here.transitions:
                if self._is_enabled(transition, leaf.activity, ended, answers):
                    return here, transition
            here = here.parent
        return None

    def step(self, state: State, answers: Answers) -> tuple[State, Shown]:
        """One tick."""
        active, ended, is_running = state
        if not active:
            entered = self._entry_set(self._chart.states[self._chart.initial], None)
            return (frozenset(entered), 0, False), (RUNNING, tuple(self._enter(entered)))
        leaf = self._chart.states[max(active, key=self._order.__getitem__)]
        calls: list[Call] = []
        found = self._select(leaf, ended, answers)
        if found is not None and found[1].target is not None:
            following, calls = self._take(active, *found, self._chart.states[found[1].target])
            if is_running:
                calls.append(((leaf.activity or "", ()), HALTED))
            return (following, 0, False), (RUNNING, tuple(calls))
        if found is not None:
            calls = self._calls(found[1].actions)
        if leaf.is_final:
            return state, (SUCCESS, tuple(calls))
        if leaf.activity is None or ended:
            return state, (RUNNING, tuple(calls))
        calls.append(((leaf.activity, ()), CONTINUE if is_running else START))
        status = answers.ask((leaf.activity, ()), (RUNNING, SUCCESS, FAILURE))
        return (active, {RUNNING: 0, SUCCESS: 1, FAILURE: 2}[status], status == RUNNING), (RUNNING, tuple(calls))
