# SPDX-License-Identifier: MIT
"""The claims of a model file, decided one by one: proven, refuted with a trace, or unknown."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Literal

from canopy.compiler.tree import Tree
from canopy.verify import smt
from canopy.verify.invariant import Invariant, directions
from canopy.verify.linear import Formula, State, everything, nothing
from canopy.verify.local import leaves_set, sliding
from canopy.verify.margin import distance
from canopy.verify.model import Claim, Plant, number
from canopy.verify.question import Question, ask
from canopy.verify.ranking import Ranking, rank
from canopy.verify.reader import ModelReader
from canopy.verify.simulate import candidates, simulate
from canopy.verify.system import System
from canopy.verify.unroll import Found, Limit, Visit, into, longest, shortest_visit

Verdict = Literal["proven", "refuted", "unknown"]
MOST_STEPS = 10_000


@dataclass
class Result:
    """What came of a claim. `steps`: those of the proof, for a solver (smt.py); `method`: how it was found."""

    claim: Claim
    verdict: Verdict
    text: str
    method: str
    trace: tuple[Visit, ...] = ()
    steps: list[str] = field(default_factory=list)
    seconds: float = 0.0
    bound: Fraction | None = None
    endless: bool = False
    """Refuted by a run that never ends, of which the trace shows the beginning."""

    @property
    def expected(self) -> bool:
        """Did it come out as the model file says? Without `expect`, as proven."""
        return bool(self.verdict == self.claim.options.get("expect", "proven"))


def decide(claim: Claim, plant: Plant, reader: ModelReader, tree: Tree, seconds: float = 60) -> Result:
    """Decides one claim within about `seconds`.

    Raises:
        CompileError: The claim is not one of this model and tree.
    """
    begin = time.monotonic()
    methods: dict[str, Callable[[Question], Result]] = {
        "reaches": _reaches,
        "stays": _stays,
        "avoids": _avoids,
        "margin": _margin,
        "dwell": _dwell,
        "invariant": _invariant,
        "border": _border,
    }
    question = ask(claim, plant, reader, tree, seconds)
    result = _checked(question, methods[claim.kind](question))
    result.seconds = time.monotonic() - begin
    return result


def _checked(question: Question, result: Result) -> Result:
    """What refutes a claim about old measurements has to be a run in which each of them is one of the past."""
    sensing = question.sensing
    if sensing is None or sensing.is_exact or result.verdict != "refuted":
        return result
    can_happen = bool(result.trace) and not result.endless
    if can_happen and sensing.explains(result.trace, question.measured, question.system.domain):
        return result
    text = f"{result.text}; that may need older measurements than there are"
    return replace(result, verdict="unknown", text=text)


def _reaches(question: Question) -> Result:
    """Finite time success: the worst run that was found from below, a ranking from above, else unrolling."""
    within = question.whole("within")
    system, claim = question.system, question.claim
    starts = candidates(system, question.start, question.outside)
    runs = [simulate(system, start, question.goal, MOST_STEPS) for start in starts]
    worst = max(runs, key=lambda run: (not run.ended, len(run.visits)), default=None)
    if worst is None:
        return Result(claim, "proven", "every start is at the goal", "one step", bound=Fraction(0))
    if not worst.ended and not worst.cut:
        return Result(claim, "refuted", f"this run never ends: {worst.why}", "simulation", worst.visits, endless=True)
    least = len(worst.visits) - 1
    if within is not None and least > within:
        text = f"from {question.plant.shown(worst.visits[0].state)} it takes {least} steps"
        return Result(claim, "refuted", text, "simulation", worst.visits)
    invariant = Invariant(system, question.start, directions(system, [question.start]))
    ranking = rank(invariant, question.outside)
    if isinstance(ranking, Ranking) and (ranking.total == least or (within is not None and ranking.total <= within)):
        return _ranked(question, invariant, ranking, least, worst.visits)
    found = longest(system, question.outside, question.start, Limit(question.seconds))
    if not found.complete and within is None and isinstance(ranking, Ranking):
        return _ranked(question, invariant, ranking, least, worst.visits)
    return _unrolled(question, found, within)


def _ranked(question: Question, invariant: Invariant, ranking: Ranking, least: int, trace: tuple[Visit, ...]) -> Result:
    exact = f"and {least} are needed" if ranking.total == least else f"and {least} are needed at least"
    steps = smt.invariant_steps(invariant) + smt.ranking_steps(invariant, ranking)
    text = f"within {ranking.total} steps, {exact}"
    return Result(question.claim, "proven", text, "ranking", trace, steps, bound=Fraction(ranking.total))


def _unrolled(question: Question, found: Found, within: int | None) -> Result:
    claim = question.claim
    shown = question.plant.shown(found.trace[0].state) if found.trace else ""
    if within is not None and len(found.trace) > within + 1:
        return Result(claim, "refuted", f"from {shown} it takes more than {within} steps", "unrolling", found.trace)
    if found.complete:
        steps = smt.level_steps(question.system, question.outside, found, question.start)
        text = f"within {found.steps} steps, and as many are needed"
        return Result(claim, "proven", text, "unrolling", found.trace, steps, bound=Fraction(found.steps))
    if found.endless:
        return Result(claim, "refuted", f"from {shown} some run never ends", "unrolling", found.trace, endless=True)
    return Result(claim, "unknown", f"no bound found, and no run longer than {found.steps}: {found.note}", "unrolling")


def _stays(question: Question) -> Result:
    """No step leaves the goal."""
    system = question.system
    steps = []
    for index in sorted(question.goal):
        for other in question.outside:
            target = system.pieces[other].states
            steps.append(smt.leads(system, index, target))
            state = Formula(system.width, (system.before(index, target),)).point()
            if state is None:
                continue
            after = system.next(index, state, target)
            assert after is not None
            moments = ((state, system.pieces[index]), (after, system.pieces[other]))
            visits = tuple(Visit(at, piece.label, piece.status) for at, piece in moments)
            return Result(question.claim, "refuted", "this step leaves it", "one step", visits)
    return Result(question.claim, "proven", "no step leaves it", "one step", (), steps)


def _avoids(question: Question) -> Result:
    """Safety: an inductive invariant, else the exact set of states that come to the bad ones."""
    bad = question.formula("avoid")
    system = question.system
    invariant = Invariant(system, question.start, directions(system, [question.start, bad]))
    reached = [invariant.states(index) for index in range(len(system.pieces))]
    if all(one is None or one.meet(part).is_empty for one in reached for part in bad.parts):
        steps = smt.invariant_steps(invariant) + smt.excluded_steps(invariant, bad)
        return Result(question.claim, "proven", "an invariant excludes it", "invariant", (), steps)
    found = into(system, bad, question.start, Limit(question.seconds))
    if found.trace:
        text = f"after {found.steps} steps from {question.plant.shown(found.trace[0].state)}"
        return Result(question.claim, "refuted", text, "unrolling", found.trace)
    if found.complete:
        steps = smt.backward_steps(system, found, bad, question.start)
        text = f"what leads there, in up to {found.steps} steps, is no start"
        return Result(question.claim, "proven", text, "unrolling", (), steps)
    return Result(question.claim, "unknown", found.note, "unrolling")


def _margin(question: Question) -> Result:
    """Safeguarding (Definition 7 in its right form): the longest steps that a guarded child may take."""
    claim, system = question.claim, question.system
    domain = Formula(system.width, (system.domain,))
    inside = question.formula("inside") & domain
    bad = question.formula("avoid")
    state = (inside & bad).point()
    if state is not None:
        return Result(claim, "refuted", f"inside has the bad state {question.plant.shown(state)}", "one step")
    guard = System([system.pieces[index] for index in question.outside], system.domain)
    met = into(guard, bad, inside, Limit(question.seconds))
    if met.trace:
        return Result(claim, "refuted", "the guard alone comes to a bad state", "unrolling", met.trace)
    if not met.complete:
        return Result(claim, "unknown", met.note, "unrolling")
    success = Formula(system.width, tuple(system.pieces[index].states for index in sorted(question.goal)))
    least = distance(success, domain & ~inside)
    path = ("claims", str(claim.index), "at_least")
    wanted = question.reader.number(claim.options.get("at_least", 0), path, "at_least")
    if least is None:
        return Result(claim, "proven", "no step leads out: inside is everything, or success nothing", "distance")
    steps = smt.backward_steps(guard, met, bad, inside) + least.steps
    text = f"the margin is {number(least.distance)}"
    if least.distance >= wanted:
        text += ": steps shorter than that stay inside"
        return Result(claim, "proven", text, "distance", (), steps, bound=least.distance)
    states = (question.plant.shown(least.success), question.plant.shown(least.outside))
    text += f": from {states[0]}, which is success, a step of little more leads to {states[1]}, which is not inside"
    return Result(claim, "refuted", text, "distance", bound=least.distance)


def _dwell(question: Question) -> Result:
    """Chattering: every visit of what acts, between two switches, lasts so many steps."""
    at_least = question.whole("at_least") or 0
    system = question.system
    invariant = Invariant(system, question.start, directions(system, [question.start]))
    reached = [invariant.states(index) for index in range(len(system.pieces))]
    doubt = 0
    for steps in range(1, at_least):
        trace, possible = shortest_visit(system, steps, question.start, reached)
        if trace:
            text = f"'{trace[1].label}' acts for {steps} step{'s' if steps > 1 else ''} only, between two others"
            return Result(question.claim, "refuted", text, "unrolling", trace)
        doubt = steps if possible else doubt
    if doubt:
        text = f"there are visits of {doubt} steps, from states that may be out of reach"
        return Result(question.claim, "unknown", text, "unrolling")
    text = f"every visit between two others lasts {at_least} steps or more"
    return Result(question.claim, "proven", text, "unrolling")


def _invariant(question: Question) -> Result:
    """A given set: every start is in it, no step leads out of it, and nothing in it is bad."""
    claim, system = question.claim, question.system
    kept = question.formula("holds")
    bad = question.formula("avoid") if "avoid" in claim.options else nothing(system.width)
    outside = (question.start & ~kept).point()
    if outside is not None:
        text = f"the start {question.plant.shown(outside)} is not in it"
        return Result(claim, "refuted", text, "one step", _at(system, outside))
    inside = (kept & bad & Formula(system.width, (system.domain,))).point()
    if inside is not None:
        text = f"it has {question.plant.shown(inside)}, which is to be avoided"
        return Result(claim, "refuted", text, "one step", _at(system, inside))
    leak, steps = leaves_set(system, kept)
    if leak is not None:
        places = ((leak.state, leak.piece), (leak.after, leak.target))
        pieces = [(state, system.pieces[index]) for state, index in places]
        visits = tuple(Visit(state, piece.label, piece.status) for state, piece in pieces)
        return Result(claim, "refuted", "this step leads out of it", "one step", visits)
    steps += [smt.held_by(part, kept) for part in question.start.parts]
    steps += [smt.meets(one, part.meet(system.domain)) for one in kept.parts for part in bad.parts]
    return Result(claim, "proven", "no step leads out of it", "one step", (), steps)


def _at(system: System, state: State) -> tuple[Visit, ...]:
    """A moment in a state."""
    return tuple(Visit(state, system.pieces[i].label, system.pieces[i].status) for i in system.at(state)[:1])


def _border(question: Question) -> Result:
    """Lemma 6 in its right form: at each border one of the two that act beside it moves away from it."""
    where = question.formula("inside") if "inside" in question.claim.options else everything(question.system.width)
    found = sliding(question.system, where)
    if found is None:
        text = "at each border between two that act one moves away from it, however short the steps are"
        return Result(question.claim, "proven", text, "border")
    one, other = (question.system.pieces[index].label for index in (found.one, found.other))
    text = f"at {question.plant.shown(found.state)} neither '{one}' nor '{other}' moves away from their border"
    return Result(question.claim, "refuted", text, "border", _at(question.system, found.state))
