# SPDX-License-Identifier: MIT
"""Large trees as XML: `PYTHONPATH=tests python -m logic.large 2000 FILE` writes the one in docs/verify.md."""

from __future__ import annotations

import random
import sys
from pathlib import Path

CONTROL = (
    "Sequence", "Fallback", "ReactiveSequence", "ReactiveFallback", "SequenceWithMemory", "AsyncSequence",
    "AsyncFallback", 'Parallel success_count="2"', "ParallelAll", 'ReactiveParallel success_count="2"', "IfThenElse",
    "WhileDoElse", "TryCatch",
)  # fmt: skip
DECORATORS = (
    "Inverter", "ForceSuccess", "ForceFailure", 'Repeat num_cycles="3"', 'RetryUntilSuccessful num_attempts="3"',
    "KeepRunningUntilFailure", "RunOnce", 'Delay delay_msec="50"', 'Timeout msec="200"',
)  # fmt: skip
LEAVES = ("Check", "Act", "Do")


class _Writer:
    """Control nodes have three children, one of them above a decorator, and are balanced or lean to the last child."""

    def __init__(self, seed: int) -> None:
        self._chance = random.Random(seed)
        self.leaves = 0

    def _element(self, kind: str, body: str) -> str:
        return f"<{kind}>{body}</{kind.split()[0]}>"

    def node(self, size: int) -> str:
        """A tree of exactly `size` nodes."""
        if size == 1:
            self.leaves += 1
            return f'<{self._chance.choice(LEAVES)} name="leaf{self.leaves}"/>'
        if size < 4 or self._chance.random() < 0.1:
            return self._element(self._chance.choice(DECORATORS), self.node(size - 1))
        rest = size - 1
        first = self._chance.randint(1, rest - 2)
        second = self._chance.randint(1, rest - first - 1)
        body = "".join(self.node(part) for part in (first, second, rest - first - second))
        return self._element(self._chance.choice(CONTROL), body)


def document(body: str) -> str:
    """A tree file with the leaves that are declared here."""
    models = '<Condition ID="Check"/><Action ID="Act"/><Action ID="Do"/>'
    told = '<input_port name="speed"/><MetadataFields><Metadata returns="SUCCESS"/></MetadataFields>'
    models += f'<Action ID="Told">{told}</Action>'
    port = '<output_port name="n" type="int32_t"/><MetadataFields><Metadata kind='
    models += f'<Action ID="Count">{port}"SyncAction"/></MetadataFields></Action>'
    models += f'<Action ID="Drive">{port}"StatefulAction"/></MetadataFields></Action>'
    return (
        f'<root BTCPP_format="4"><BehaviorTree ID="T">{body}</BehaviorTree>'
        f"<TreeNodesModel>{models}</TreeNodesModel></root>\n"
    )


def large_tree(size: int, seed: int = 1) -> str:
    """A file whose tree has `size` nodes, at least 12: a random one, beside a small part that is asked about."""
    part = '<Sequence name="asked"><Act name="first"/><Act name="second"/></Sequence>'
    body = _Writer(seed).node(size - 5)
    return document(f"<ReactiveFallback><ForceFailure>{body}</ForceFailure>{part}</ReactiveFallback>")


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(large_tree(int(sys.argv[1])))
