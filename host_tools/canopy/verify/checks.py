# SPDX-License-Identifier: MIT
"""Is a model one of this tree and bus? Regions cover and do not overlap, steps stay in the state space, units match."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations

from canopy.compiler.bus_model import Bus, Signal
from canopy.compiler.errors import nearest
from canopy.compiler.tree import Node, Tree
from canopy.verify.linear import Formula, Polyhedron, State, substituted
from canopy.verify.model import RUNNING, STATUSES, LeafModel, Mode, Plant
from canopy.verify.regions import LEAF_KINDS, Piece
from canopy.verify.system import opened


def nodes_of(root: Node) -> list[Node]:
    """All nodes of a tree, parents first."""
    result, waiting = [], [root]
    while waiting:
        node = waiting.pop()
        result.append(node)
        waiting += reversed(node.children)
    return result


def check_model(plant: Plant, tree: Tree, bus: Bus | None) -> list[str]:
    """Checks all leaves of a model, and says what was checked.

    Raises:
        CompileError: The first thing that is wrong.
    """
    used = {node.leaf.id: node for node in nodes_of(tree.root) if node.leaf is not None}
    done = []
    for leaf in plant.leaves.values():
        node = used.get(leaf.id)
        if node is None:
            raise plant.error(leaf.place, f"the tree has no leaf '{leaf.id}'", nearest(leaf.id, used))
        _check_leaf(plant, leaf, node)
        done.append(leaf.id)
    if bus is not None:
        _check_signals(plant, bus)
        _check_writes(plant, bus)
    return done


def _check_leaf(plant: Plant, leaf: LeafModel, node: Node) -> None:
    domain = Formula(plant.width, (plant.domain,))
    if node.type.name not in LEAF_KINDS:
        raise plant.error(leaf.place, f"'{leaf.id}' is a {node.type.name}, and only leaves have a model")
    if not leaf.free:
        _check_partition(plant, leaf, domain)
        _check_declared(plant, leaf, node, domain)
    acts = domain if leaf.free else leaf.regions[RUNNING] & domain
    if leaf.free and not leaf.modes:
        return
    _check_modes(plant, leaf, acts)


def _check_partition(plant: Plant, leaf: LeafModel, domain: Formula) -> None:
    for one, other in combinations(STATUSES, 2):
        point = (leaf.regions[one] & leaf.regions[other] & domain).point()
        if point is not None:
            raise plant.error(
                leaf.place,
                f"{one.lower()} and {other.lower()} of leaf '{leaf.id}' overlap, for example at {plant.shown(point)}",
                f'take it out of one of them, or write {other.lower()} = "else"',
            )
    point = _outside(domain, [leaf.regions[status] for status in STATUSES])
    if point is not None:
        raise plant.error(
            leaf.place,
            f"leaf '{leaf.id}' returns nothing at {plant.shown(point)}",
            'the three regions must cover the state space: write "else" for one of them',
        )


def _outside(domain: Formula, covering: list[Formula]) -> tuple[Fraction, ...] | None:
    """A state of the domain that none of the formulas has."""
    covered = Formula(domain.width, tuple(part for one in covering for part in one.parts))
    return (domain & ~covered).point()


def _check_declared(plant: Plant, leaf: LeafModel, node: Node, domain: Formula) -> None:
    assert node.leaf is not None
    allowed = node.leaf.returns or (STATUSES if node.type.name == "StatefulAction" else ("SUCCESS", "FAILURE"))
    for status in STATUSES:
        point = (leaf.regions[status] & domain).point()
        if point is not None and status not in allowed:
            raise plant.error(
                leaf.place,
                f"leaf '{leaf.id}' returns {status} at {plant.shown(point)}, which it does not declare",
                f"at {node.leaf.place} it may return {' '.join(allowed)}",
            )


def _check_modes(plant: Plant, leaf: LeafModel, acts: Formula) -> None:
    for one, other in combinations(leaf.modes, 2):
        point = (one.when & one.where & other.when & other.where & acts).point()
        if point is not None:
            raise plant.error(
                other.place,
                f"two modes of leaf '{leaf.id}' hold at {plant.shown(point)}",
                f"the other one begins at {one.place}: let 'when' or 'where' divide them",
            )
    point = _outside(acts, [mode.when & mode.where for mode in leaf.modes])
    if point is not None:
        raise plant.error(
            leaf.place,
            f"leaf '{leaf.id}' is RUNNING at {plant.shown(point)}, and no mode says what it does there",
            f"write [[leaves.{leaf.id}.modes]] with next or shorter_than; next = {{}} stands still",
        )
    for mode in leaf.modes:
        _check_closed(plant, leaf, mode, acts & mode.when & mode.where)


def leak(piece: Piece, domain: Polyhedron) -> tuple[State, State] | None:
    """A step of a piece that leaves the state space; None: there is none."""
    one = opened(piece, domain)
    for bound in domain.atoms:
        outside = one.states.meet([substituted(bound.negation, one.maps)])
        point = Formula(outside.width, (outside,)).point()
        if point is not None:
            return point[: domain.width], tuple(item.at(point) for item in one.maps)
    return None


def _check_closed(plant: Plant, leaf: LeafModel, mode: Mode, where: Formula) -> None:
    for part in where.parts:
        found = leak(Piece(part, RUNNING, "", mode.step, ()), plant.domain)
        if found is not None:
            raise plant.error(
                mode.place,
                f"leaf '{leaf.id}' leaves the state space: from {plant.shown(found[0])} to {plant.shown(found[1])}",
                "widen the range of the variable, or say with 'when' what happens at its end",
            )


def signal_of(bus: Bus, name: str) -> Signal | None:
    """A signal by Message.Signal."""
    message_name, _, signal_name = name.partition(".")
    for message in bus.messages:
        if message.name == message_name:
            return next((signal for signal in message.signals if signal.name == signal_name), None)
    return None


def physical(signal: Signal, raw: int) -> Fraction:
    """The physical value of a raw one."""
    return Fraction(raw) * Fraction(signal.scale) + Fraction(signal.offset)


def _check_signals(plant: Plant, bus: Bus) -> None:
    known = [f"{message.name}.{signal.name}" for message in bus.messages for signal in message.signals]
    for variable in plant.variables:
        if not variable.signal:
            continue
        signal = signal_of(bus, variable.signal)
        if signal is None:
            raise plant.error(
                variable.place, f"the bus has no signal '{variable.signal}'", nearest(variable.signal, known)
            )
        if signal.unit != str(variable.unit) and (signal.unit or variable.unit.powers):
            raise plant.error(
                variable.place,
                f"'{variable.name}' is in {variable.unit}, and its signal '{variable.signal}' in '{signal.unit}'",
                f'write unit = "{signal.unit}", and the numbers of the model in it',
            )
        if signal.is_float:
            continue
        low, high = physical(signal, signal.low), physical(signal, signal.high)
        if variable.low < low or variable.high > high:
            raise plant.error(
                variable.place,
                f"'{variable.name}' goes beyond the range of its signal '{variable.signal}', {low} to {high}",
                "frames with such values are refused: narrow the variable's range, or widen the signal's",
            )


def _check_writes(plant: Plant, bus: Bus) -> None:
    known = [f"{message.name}.{signal.name}" for message in bus.send for signal in message.signals]
    for leaf in plant.leaves.values():
        for mode in leaf.modes:
            for name, value in mode.writes:
                signal = signal_of(bus, name)
                if signal is None or name not in known:
                    raise plant.error(mode.place, f"the controller sends no signal '{name}'", nearest(name, known))
                texts = [one.text for one in signal.enumerators]
                if isinstance(value, str) and value not in texts:
                    raise plant.error(mode.place, f"'{name}' has no value named '{value}'", nearest(value, texts))
