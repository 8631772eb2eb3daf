# SPDX-License-Identifier: MIT
"""Random trees as XML, with scripts over entries and signals of logic.bus, and leaves that write entries."""

from __future__ import annotations

import random
from xml.sax.saxutils import quoteattr

NUMBERS = ("a", "b", "g")
"""Entries: int8_t, int32_t, fixed point in quarters. `f` is a bool, `t` a text, `o` is written by a stateful action."""
SIGNALS = ("Climate.Temperature", "Climate.Extra", "Desk.Wanted")
START = "b := 0; f := false; t := 'x'"
TYPES = {"a": "int8_t", "g": "int16_t*0.25", "o": "int32_t"}


class Writer:
    """`open`: also with what a circuit cannot follow: queues, handlers of halts, actions that write."""

    def __init__(self, seed: str, *, is_open: bool) -> None:
        self._chance = random.Random(seed)
        self._open = is_open
        self.models: list[str] = []

    def _pick(self, *choices: str) -> str:
        return self._chance.choice(choices)

    # Scripts

    def _number(self, depth: int) -> str:
        roll = self._chance.random()
        if depth == 0 or roll < 0.4:
            names = (*NUMBERS, "o") if self._open else NUMBERS
            return self._pick(*names, *names, "f", str(self._chance.randint(0, 9)), "2.5", "(7 / 2 * 2)", *SIGNALS)
        if roll < 0.8:
            return f"({self._number(depth - 1)} {self._pick('+', '-', '*')} {self._number(depth - 1)})"
        if roll < 0.9:
            return f"({self._pick('a', 'b')} {self._pick('&', '|', '^')} {self._pick('a', '7', '~b')})"
        return f"({self._number(depth - 1)} / {self._pick('2', '4', '0.5')})"

    def condition(self, depth: int = 2) -> str:
        """A script that is true or false."""
        roll = self._chance.random()
        if depth == 0 or roll < 0.5:
            left, right = self._number(1), self._number(depth and 1)
            return f"{left} {self._pick('<', '<=', '>', '>=')} {right}"
        if roll < 0.6:
            return self._pick("t == 'x'", "t != 'y'", "Climate.Door == Open", "Climate.Door != 'Shut'", "1 < b <= 5")
        if roll < 0.65:
            return "!Desk.fresh || Desk.Wanted > 50"
        sign = self._pick("&&", "||")
        return f"({self.condition(depth - 1)}) {sign} {self._pick('', '!')}({self.condition(depth - 1)})"

    def _action(self) -> str:
        return self._pick(
            f"b := {self._chance.randint(-3, 9)}",
            "b += 1",
            "b := b * 3 - a",
            "b := b * 1000 - a",
            "b := Desk.Wanted",
            "f := b > 2",
            "t := (f ? 'x' : 'y')",
            f"b := ({self.condition(1)}) ? 1 : b; f := !f",
            "b := b | 5",
            "b := 3 * (b + 1) - 7 / 2 * 4",
            "b := -(1 / 4) * 8 + b",
        )

    # Nodes

    def _attributes(self) -> str:
        found = []
        for name in ("_failureIf", "_successIf", "_skipIf", "_while"):
            if self._chance.random() < 0.05:
                found.append(f"{name}={quoteattr(self.condition(1))}")
        for name in ("_onSuccess", "_onFailure", "_post", *(["_onHalted"] if self._open else [])):
            if self._chance.random() < 0.05:
                found.append(f"{name}={quoteattr(self._action())}")
        return "".join(f" {one}" for one in found)

    def _leaf(self) -> str:
        number = len(self.models)
        kind = self._pick("Condition", "SyncAction", "StatefulAction")
        meta = self._pick("", "", ' reads="Climate"', ' reads="Desk" stale="SUCCESS"', ' reads="Climate.Extra"')
        returns = self._pick("", ' returns="SUCCESS FAILURE SKIPPED"')
        tag = "Condition" if kind == "Condition" else "Action"
        kind_text = "" if kind == "Condition" else f' kind="{kind}"'
        target = self._pick("a", "g", "")
        if kind == "StatefulAction":
            target = self._pick("o", "") if self._open else ""
            returns = ""
        port = f'<output_port name="n" type="{TYPES[target]}"/>' if target else ""
        metadata = f"<MetadataFields><Metadata{kind_text}{meta}{returns}/></MetadataFields>"
        self.models.append(f'<{tag} ID="Leaf{number}">{port}{metadata}</{tag}>')
        given = f' n="{{{target}}}"' if target else ""
        return f"<Leaf{number}{given}{self._attributes()}/>"

    def _small(self) -> str:
        roll = self._chance.random()
        if roll < 0.5:
            return self._leaf()
        entry = self._pick("a", "b", "f", "t")
        return self._pick(
            f"<Script code={quoteattr(self._action())}/>",
            f"<ScriptCondition code={quoteattr(self.condition())}/>",
            f'<WasEntryUpdated entry="{{{entry}}}"/>',
            '<SetBlackboard value="4" output_key="b"/>',
            '<SetBlackboard value="{Desk.Wanted}" output_key="b"/>',
            '<UnsetBlackboard key="b"/>',
            '<Sleep msec="25"/>',
            f'<TestNode return_status="{self._pick("SUCCESS", "FAILURE", "SKIPPED")}" async_delay="15" '
            f"success_script={quoteattr(self._action())} post_script={quoteattr(self._action())}/>",
        )

    def node(self, size: int) -> str:
        """A tree of about `size` nodes."""
        if size <= 1:
            return self._small()
        if size < 4 or self._chance.random() < 0.2:
            entry = self._pick("a", "b", "f")
            kinds = [
                "Inverter",
                "ForceSuccess",
                "KeepRunningUntilFailure",
                'Repeat num_cycles="3"',
                'Timeout msec="25"',
                f"Precondition if={quoteattr(self.condition())} else={quoteattr(self._pick('FAILURE', 'RUNNING'))}",
                f'SkipUnlessUpdated entry="{{{entry}}}"',
                f'WaitValueUpdate entry="{{{entry}}}"',
            ]
            if self._open:
                kinds.append('LoopInt queue="1;2;3" value="{o}"')
            return self._element(self._pick(*kinds), self.node(size - 1))
        parts = [self.node((size - 1) // 3) for _ in range(3)]
        kinds = ["Sequence", "Fallback", "ReactiveSequence", "ReactiveFallback", "WhileDoElse", "IfThenElse", "Switch"]
        kind = self._pick(*kinds, 'Parallel success_count="2" failure_count="2"', "AsyncSequence", "ParallelAll")
        if kind == "Switch":
            kind = self._pick(
                'Switch2 variable="{b}" case_1="1" case_2="{a}"',
                'Switch2 variable="{t}" case_1="x" case_2="y"',
                'Switch2 variable="{Climate.Door}" case_1="Open" case_2="2"',
            )
        return self._element(kind, "".join(parts))

    def _element(self, kind: str, body: str) -> str:
        return f"<{kind}{self._attributes()}>{body}</{kind.split()[0]}>"

    def document(self, size: int) -> str:
        """A whole file. Entries are there, and have their types, before anything reads them."""
        self.models.append(
            '<Action ID="Leaf0">'
            + "".join(f'<output_port name="{name}" type="{TYPES[name]}"/>' for name in "ag")
            + '<MetadataFields><Metadata kind="SyncAction" returns="SUCCESS"/></MetadataFields></Action>'
        )
        opened = ""
        if self._open:
            metadata = '<MetadataFields><Metadata kind="StatefulAction"/></MetadataFields>'
            self.models.append(f'<Action ID="Leaf1"><output_port name="o" type="int32_t"/>{metadata}</Action>')
            opened = '<ForceSuccess><Leaf1 o="{o}"/></ForceSuccess>'
        first = f'<RunOnce><Leaf0 a="{{a}}" g="{{g}}"/></RunOnce><RunOnce><Script code="{START}"/></RunOnce>'
        body = f"<Parallel>{first}{opened}{self.node(size)}</Parallel>"
        return (
            f'<root BTCPP_format="4"><BehaviorTree ID="T">{body}</BehaviorTree>'
            f"<TreeNodesModel>{''.join(self.models)}</TreeNodesModel></root>\n"
        )
