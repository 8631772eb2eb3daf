# SPDX-License-Identifier: MIT
"""What every node of the conformance table's model does: the calls that it makes, and what it asks for.

Written, as the rest of the model, from docs/semantics.md alone, without a look at the engine. Statuses are letters: S
success, F failure, R running, K skipped, I idle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

Answer = int | str
"""A status, as a letter, or what a script gives."""

Ask = Callable[[str, Sequence[Answer]], Answer]
"""Gives the answer of a child that is ticked or a script that is asked now: its letter, and what it may answer."""

STATUSES = "SFRK"


@dataclass(frozen=True)
class Script:
    """A parameter that is a script: it is asked for one of these answers, or, without any, only run."""

    answers: tuple[Answer, ...] = ()


RUN = Script()
NONE = -1
"""In the place of a script that the node has not."""

Parameter = int | Script


class Node:
    """A node with its children; a subclass says what a tick is. One tick a millisecond."""

    script_letters = "ABCDEFGH"
    """One a parameter."""

    def __init__(self, children: int, *parameters: Parameter) -> None:
        """Keep the number of children and the parameters in the order of nodes.def."""
        self.children = children
        self.parameters = parameters
        self.status = "I"
        self.child_status = ["I"] * children
        self.calls = ""
        self.fault = False
        self._ask: Ask
        self.forget()

    # What a subclass says.

    def forget(self) -> None:
        """Set the memory to what it is before the first tick."""

    def on_tick(self) -> str:
        """Tick the children that are to be ticked, and return the status."""
        raise NotImplementedError

    def on_halt(self) -> None:
        """Forget what a halt forgets."""
        self.forget()

    def memory(self) -> tuple[object, ...]:
        """Everything a later tick depends on but the statuses; times as what is left."""
        return ()

    def pass_time(self) -> None:
        """A millisecond passes."""

    # What every node does.

    def tick(self, ask: Ask) -> str:
        """Tick once, and note the calls: a ticked, a' ticked while RUNNING, a! halted, A a script."""
        self.calls = ""
        self.fault = False
        self._ask = ask
        self.status = self.on_tick()
        if self.status != "R":
            self.reset_all()
        self.pass_time()
        return self.status

    def halt(self, ask: Ask) -> None:
        """Halt the tree: children first. What a node keeps while RUNNING or through a SKIPPED child is forgotten."""
        self.calls = ""
        self.fault = False
        self._ask = ask
        self.reset_all()
        if self.status in "RK":
            self.on_halt()
        self.status = "I"
        self.pass_time()

    def reset(self, ask: Ask) -> None:
        """Halt the tree and forget everything."""
        self.halt(ask)
        self.forget()

    def state(self) -> tuple[object, ...]:
        """What a later tick depends on."""
        return (self.status if self.status in "RK" else "", tuple(self.child_status), self.memory())

    def running(self) -> tuple[object, ...]:
        """The state of a node for which only matters which children are RUNNING."""
        return tuple(status == "R" for status in self.child_status)

    def run(self, child: int) -> str:
        """Tick a child."""
        letter = chr(ord("a") + child)
        self.calls += letter + ("'" if self.child_status[child] == "R" else "")
        self.child_status[child] = str(self._ask(letter, STATUSES))
        return self.child_status[child]

    def run_script(self, which: int, suffix: str = "") -> Answer:
        """Run the script of a parameter, if the node has it. One that is only run gives nothing that matters: 0."""
        script = self.parameters[which]
        if not isinstance(script, Script):
            return 0
        letter = self.script_letters[which]
        self.calls += letter + suffix
        return self._ask(letter, script.answers) if script.answers else 0

    def parameter(self, which: int) -> int:
        """Look at a parameter: the number in the XML, or what its script gives now."""
        constant = self.parameters[which]
        value = self.run_script(which) if isinstance(constant, Script) else constant
        assert isinstance(value, int)
        return value

    def reset_child(self, child: int) -> None:
        """Halt a child if it is RUNNING; IDLE afterwards."""
        if self.child_status[child] == "R":
            self.calls += chr(ord("a") + child) + "!"
        self.child_status[child] = "I"

    def reset_all(self) -> None:
        """Reset all children."""
        for child in range(self.children):
            self.reset_child(child)

    def others_running(self, child: int) -> None:
        """Halt all RUNNING children but this one."""
        for other in range(self.children):
            if other != child and self.child_status[other] == "R":
                self.reset_child(other)
