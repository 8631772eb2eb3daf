# SPDX-License-Identifier: MIT
"""A subsumption architecture as a behaviour tree: the paper's Lemma 8 and Table II.

Each layer says in every tick whether it wants control: RUNNING if it does, FAILURE if it does not. The highest layer
that does has it; a layer that loses control is halted.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from canopy.convert.equivalence import Answers, Shown, State
from canopy.convert.writer import LeafModel, composite, node
from canopy.fmt.document import Element
from canopy.semantics.spec import CONTINUE, FAILURE, HALTED, RUNNING, START

MAX_LAYERS = 60
TABLE_LAYERS = 6
"""More make a table of more than 64 rows, which nobody reads."""


def convert(layers: Sequence[str], otherwise: str | None) -> tuple[Element, list[LeafModel]]:
    """The tree, from the highest layer to the lowest one, and its leaves.

    `otherwise`: an action that is always RUNNING, for when no layer wants control.
    """
    leaves = [LeafModel(layer, "StatefulAction", "RUNNING FAILURE") for layer in layers]
    if otherwise is not None:
        leaves.append(LeafModel(otherwise, "StatefulAction", "RUNNING"))
    return composite("ReactiveFallback", [node(leaf.id) for leaf in leaves]), leaves


def table(layers: Sequence[str], otherwise: str | None) -> list[tuple[tuple[str, ...], str]]:
    """Table II: what each layer returns, and who has control then."""
    rows = []
    for wants in product((True, False), repeat=len(layers)):
        first = next((layer for layer, wanted in zip(layers, wants, strict=True) if wanted), None)
        if first is None:
            first = otherwise or "nobody: the tree fails, and every output takes its safe value"
        rows.append((tuple("RUNNING" if wanted else "FAILURE" for wanted in wants), first))
    return rows


class ArbiterMachine:
    """The architecture itself: the state is who had control."""

    def __init__(self, layers: Sequence[str], otherwise: str | None) -> None:
        self._layers = layers
        self._otherwise = otherwise

    def start(self) -> State:
        """Nobody has control."""
        return None

    def step(self, state: State, answers: Answers) -> tuple[State, Shown]:
        """Asks the layers from the highest on, until one wants control; the one that loses it is halted."""
        if len(self._layers) <= TABLE_LAYERS:
            for layer in self._layers:  # they run side by side: try also what those below the winner want
                answers.ask((layer, ()), (RUNNING, FAILURE))
        calls: list[tuple[tuple[str, tuple[()]], int]] = []
        winner = None
        for layer in self._layers:
            calls.append(((layer, ()), CONTINUE if state == layer else START))
            if answers.ask((layer, ()), (RUNNING, FAILURE)) == RUNNING:
                winner = layer
                break
        if winner is None and self._otherwise is not None:
            winner = self._otherwise
            calls.append(((winner, ()), CONTINUE if state == winner else START))
        # A layer that was asked and failed has given control back itself; one that was not asked is halted.
        asked = {key[0] for key, _ in calls}
        if state is not None and state not in asked:
            calls.append(((state, ()), HALTED))
        return winner, (RUNNING if winner is not None else FAILURE, tuple(calls))
