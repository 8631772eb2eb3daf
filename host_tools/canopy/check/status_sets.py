# SPDX-License-Identifier: MIT
"""Which statuses each subtree can return, and which children can ever be ticked.

For every node a set of statuses that contains all it can return; it may contain more, because leaves are taken as
independent of each other and of time. So a child that is called unreachable here can never be ticked, whatever the
leaves do within their declared `returns`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from canopy.compiler.blackboard import SignalName
from canopy.compiler.tree import Bound, Node, Script

Statuses = frozenset[str]

S, F, R, K = "SUCCESS", "FAILURE", "RUNNING", "SKIPPED"
NONE: Statuses = frozenset()
ANY: Statuses = frozenset((S, F, R, K))
# canopy_status_t
NUMBERS = {1: R, 2: S, 3: F, 4: K}

# What a leaf returns unless it declares `returns`.
LEAVES: dict[str, Statuses] = {
    "Condition": frozenset((S, F)),
    "SyncAction": frozenset((S, F)),
    "StatefulAction": frozenset((S, F, R)),
    "AlwaysSuccess": frozenset((S,)),
    "AlwaysFailure": frozenset((F,)),
    "Sleep": frozenset((S, R)),
    "WasEntryUpdated": frozenset((S, F)),
    "TestNode": frozenset((S, F, R, K)),
}


@dataclass(frozen=True)
class Outcome:
    """What a node can return, and for each child whether it can be ticked."""

    statuses: Statuses
    ticked: tuple[bool, ...]


Rule = Callable[[Node, Sequence[Statuses]], Outcome]


def _all(statuses: Statuses, children: Sequence[Statuses]) -> Outcome:
    return Outcome(statuses, tuple(True for _ in children))


def _values(parameter: int | Script, *ends: int) -> tuple[int, ...]:
    """A parameter's value; if an entry gives one in each tick, `ends`: they allow between them what any value does."""
    return ends if isinstance(parameter, Script) else (parameter,)


def _either(outcomes: Iterable[Outcome]) -> Outcome:
    """What at least one of the outcomes, of the same node, allows."""
    every = list(outcomes)
    statuses = NONE.union(*(one.statuses for one in every))
    return Outcome(statuses, tuple(map(any, zip(*(one.ticked for one in every), strict=True))))


def _in_order(children: Sequence[Statuses], go_on: str, stop: str) -> Outcome:
    """Children one after the other while they return `go_on` or are skipped."""
    result: set[str] = set()
    ticked = []
    reached = True
    for child in children:
        ticked.append(reached)
        if reached:
            result |= child & {stop, R}
            reached = bool(child & {go_on, K})
    if reached:
        if any(go_on in child for child in children):
            result.add(go_on)
        if all(K in child for child in children):
            result.add(K)
    return Outcome(frozenset(result), tuple(ticked))


def _sequence(_node: Node, children: Sequence[Statuses]) -> Outcome:
    return _in_order(children, S, F)


def _fallback(_node: Node, children: Sequence[Statuses]) -> Outcome:
    return _in_order(children, F, S)


def _async(go_on: str, stop: str) -> Rule:
    def rule(_node: Node, children: Sequence[Statuses]) -> Outcome:
        plain = _in_order(children, go_on, stop)
        yields = any(go_on in child for child, ticked in zip(children[:-1], plain.ticked, strict=False) if ticked)
        return Outcome(plain.statuses | ({R} if yields else NONE), plain.ticked)

    return rule


def _threshold(value: int, count: int) -> int:
    """A negative threshold counts from count + 1 down."""
    return value if value >= 0 else max(count + value + 1, 0)


def _completing(
    children: Sequence[Statuses], count: int, needed: int, failures_needed: int, good: Statuses
) -> Statuses:
    """What a parallel node of `count` children can return when `children` are ticked; `good` counts as success."""
    result = set()
    if sum(bool(child & good) for child in children) >= needed:
        result.add(S)
    can_fail = sum(F in child for child in children)
    if can_fail >= failures_needed or can_fail > count - needed:
        result.add(F)
    if any(child & {R, K} for child in children):
        result.add(R)
    if children and all(K in child for child in children):
        result.add(K)
    return frozenset(result)


def _parallel(node: Node, children: Sequence[Statuses]) -> Outcome:
    successes, failures = (_values(parameter, 0, len(children) + 1) for parameter in node.parameters)
    return _either(_parallel_with(s, f, children) for s in successes for f in failures)


def _parallel_with(success_count: int, failure_count: int, children: Sequence[Statuses]) -> Outcome:
    count = len(children)
    needed = _threshold(success_count, count)
    failures_needed = _threshold(failure_count, count)
    good = frozenset((S, K) if success_count < 0 else (S,))
    certain = 0
    ticked = []
    for child in children:
        ticked.append(certain < needed)
        certain += child == {S}
    reached = [child for child, is_reached in zip(children, ticked, strict=True) if is_reached]
    return Outcome(_completing(reached, count, needed, failures_needed, good), tuple(ticked))


def _parallel_all(node: Node, children: Sequence[Statuses]) -> Outcome:
    limits = _values(node.parameters[0], 0, len(children) + 1)
    return _either(_parallel_all_with(_threshold(limit, len(children)), children) for limit in limits)


def _parallel_all_with(limit: int, children: Sequence[Statuses]) -> Outcome:
    result = {R} if any(R in child for child in children) else set()
    if all(child & {S, F, K} for child in children):
        if sum(F in child for child in children) >= limit:
            result.add(F)
        if sum(not child & {S, R, K} for child in children) < limit and any(child & {S, F} for child in children):
            result.add(S)
        if all(K in child for child in children):
            result.add(K)
    return _all(frozenset(result), children)


def _reactive_parallel(node: Node, children: Sequence[Statuses]) -> Outcome:
    needed = _values(node.parameters[0], 1, len(children) + 1)
    return _either(_reactive_parallel_with(_threshold(least, len(children)), children) for least in needed)


def _reactive_parallel_with(needed: int, children: Sequence[Statuses]) -> Outcome:
    count = len(children)
    if any(K in child for child in children):  # N depends on who is skipped: no sharper bound is worth the trouble
        result = {S, F}
        if any(R in child for child in children):
            result.add(R)
        if all(K in child for child in children):
            result.add(K)
        return _all(frozenset(result), children)
    if sum(child == {S} for child in children) >= needed:
        return _all(frozenset((S,)), children)
    return _all(_completing(children, count, needed, count + 1, frozenset((S,))), children)


def _if_then_else(_node: Node, children: Sequence[Statuses]) -> Outcome:
    asked = children[0]
    result = set(asked & {R, K})
    if S in asked:
        result |= children[1]
    if F in asked:
        result |= children[2] if len(children) == 3 else {F}
    return Outcome(frozenset(result), (True, S in asked, F in asked)[: len(children)])


def _try_catch(node: Node, children: Sequence[Statuses]) -> Outcome:
    tried = _in_order(children[:-1], S, F)
    result = set(tried.statuses - {F})
    if F in tried.statuses:
        result |= children[-1] & {R}
        if children[-1] & {S, F, K}:
            result.add(F)
    on_halt = node.parameters[0] != 0 and R in tried.statuses
    return Outcome(frozenset(result), (*tried.ticked, F in tried.statuses or on_halt))


def _map(**changed: str) -> Rule:
    def rule(_node: Node, children: Sequence[Statuses]) -> Outcome:
        return _all(frozenset(changed.get(status, status) for status in children[0]), children)

    return rule


def _again(repeated: str) -> Rule:
    """Repeat (`repeated` is SUCCESS) and RetryUntilSuccessful (FAILURE)."""

    def times(most: int, children: Sequence[Statuses]) -> Outcome:
        if most == 0:
            return Outcome(frozenset((repeated,)), (False,))
        result = set(children[0])
        if repeated in result and most != 1:
            result.add(R)
        if most < 0:
            result.discard(repeated)
        return _all(frozenset(result), children)

    def rule(node: Node, children: Sequence[Statuses]) -> Outcome:
        return _either(times(most, children) for most in _values(node.parameters[0], 0, 2))

    return rule


def _plus(added: str) -> Rule:
    def rule(_node: Node, children: Sequence[Statuses]) -> Outcome:
        return _all(children[0] | {added}, children)

    return rule


def _delay(node: Node, children: Sequence[Statuses]) -> Outcome:
    return _all(children[0] | ({R} if max(_values(node.parameters[0], 1)) > 0 else NONE), children)


def _timeout(_node: Node, children: Sequence[Statuses]) -> Outcome:
    return _all(children[0] | ({F} if R in children[0] else NONE), children)


def _run_once(node: Node, children: Sequence[Statuses]) -> Outcome:
    return _all(children[0] | ({K} if any(_values(node.parameters[0], 1)) and children[0] & {S, F} else NONE), children)


def _given(status: int | Script) -> Statuses:
    """The status that a parameter names."""
    return frozenset(NUMBERS[number] for number in _values(status, *NUMBERS))


def _else_status(node: Node, children: Sequence[Statuses]) -> Outcome:
    """Precondition: the child's, or the status given in `else`."""
    return _all(children[0] | _given(node.parameters[1]), children)


def _attributes(node: Node, children: Sequence[Statuses]) -> Outcome:
    failure_if, success_if, skip_if, while_ = (script != -1 for script in node.parameters[:4])
    added = {F: failure_if, S: success_if, K: skip_if or while_}
    return _all(children[0] | {status for status, given in added.items() if given}, children)


def _loop(node: Node, children: Sequence[Statuses]) -> Outcome:
    """After each item RUNNING, even after the last; the empty queue is seen in the next tick."""
    going_on = frozenset((R,)) if children[0] & {S, R, K} else NONE
    return _all(going_on | children[0] & {F} | _given(node.parameters[1]), children)


def _any_child(_node: Node, children: Sequence[Statuses]) -> Outcome:
    return _all(frozenset().union(*children), children)


def _anything(_node: Node, children: Sequence[Statuses]) -> Outcome:
    """A node of the user's own: nothing is known."""
    return _all(ANY, children)


RULES: dict[str, Rule] = {
    "Sequence": _sequence,
    "SequenceWithMemory": _sequence,
    "AsyncSequence": _async(S, F),
    "ReactiveSequence": _sequence,
    "Fallback": _fallback,
    "AsyncFallback": _async(F, S),
    "ReactiveFallback": _fallback,
    "Parallel": _parallel,
    "ParallelAll": _parallel_all,
    "ReactiveParallel": _reactive_parallel,
    "IfThenElse": _if_then_else,
    "WhileDoElse": _if_then_else,
    "TryCatch": _try_catch,
    "Inverter": _map(SUCCESS=F, FAILURE=S),
    "ForceSuccess": _map(FAILURE=S),
    "ForceFailure": _map(SUCCESS=F),
    "Repeat": _again(S),
    "RetryUntilSuccessful": _again(F),
    "KeepRunningUntilFailure": _map(SUCCESS=R),
    "Delay": _delay,
    "Timeout": _timeout,
    "RunOnce": _run_once,
    "Precondition": _else_status,
    "Attributes": _attributes,
    "SkipUnlessUpdated": _plus(K),
    "WaitValueUpdate": _plus(R),
    "Loop": _loop,
    "Switch": _any_child,
    "Control": _anything,
    "Decorator": _anything,
}


def leaf_statuses(node: Node) -> Statuses:
    """What a leaf can return: what it declares, else what its kind allows; and its answer to stale signals."""
    if node.type.name == "TestNode":
        status, delay = node.parameters[:2]
        return _given(status) | ({R} if delay else NONE)
    if node.leaf is not None and node.leaf.is_guessed:
        return frozenset((S, F, R))  # a condition, or an action of either kind
    declared = node.leaf.returns if node.leaf is not None else ()
    result = frozenset(declared) or LEAVES.get(node.type.name, ANY)
    if node.leaf is not None and (node.leaf.reads or any(_is_signal(bound) for bound in node.bound)):
        result |= {node.leaf.stale}
    return result


def _is_signal(bound: Bound) -> bool:
    """Does a port get a signal? Then the leaf is not called while its message is stale."""
    return isinstance(bound.target, SignalName) and not bound.target.text.endswith(".fresh")


def outcome(node: Node, children: Sequence[Statuses]) -> Outcome:
    """What `node` can do with children that can return these. A type that is not known here may do anything."""
    if not node.children:
        return Outcome(leaf_statuses(node), ())
    return RULES.get(node.type.name, _anything)(node, children)
