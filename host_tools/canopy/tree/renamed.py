# SPDX-License-Identifier: MIT
"""Nodes of older versions of BehaviorTree.CPP that format 4 calls otherwise, and what to write instead.

From its notes on migrating from version 3 to 4, and from the old versions' own lists of nodes.
"""

from __future__ import annotations

RENAMED = {
    "SequenceStar": "write <SequenceWithMemory>: format 3's SequenceStar, which goes on at the child that failed",
    "FallbackStar": "write <Fallback>: format 4's goes on at its RUNNING child, as FallbackStar of version 2 did",
    "SelectorStar": "write <Fallback>: format 4's goes on at its RUNNING child, as SelectorStar of version 2 did",
    "Selector": "write <Fallback>, or <ReactiveFallback> if its first children have to be asked in every tick",
    "RetryUntilSuccesful": "write <RetryUntilSuccessful>: the name was misspelt in format 3",
    "SubTreePlus": 'write <SubTree … _autoremap="true">, or give each port a value, as a SubTree of format 4 may',
    "Subtree": "write <SubTree>",
    "SubtreePlus": 'write <SubTree … _autoremap="true">, or give each port a value, as a SubTree of format 4 may',
    "Negation": "write <Inverter>",
    "BlackboardCheckInt": 'write <Precondition if="entry == 5" else="FAILURE">, or _failureIf at its child',
    "BlackboardCheckDouble": 'write <Precondition if="entry == 5" else="FAILURE">, or _failureIf at its child',
    "BlackboardCheckBool": 'write <Precondition if="entry" else="FAILURE">, or _failureIf="!entry" at its child',
    "BlackboardCheckString": 'write <Precondition if="entry == \'text\'" else="FAILURE">, or _failureIf at its child',
    "ConsumeQueue": 'write <LoopDouble queue="{queue}" value="{item}">, or another of the Loop nodes',
}

# Attributes of built-in nodes in format 3, by node.
RENAMED_ATTRIBUTES = {
    ("Parallel", "threshold"): "write success_count",
    ("Parallel", "success_threshold"): "write success_count",
    ("Parallel", "failure_threshold"): "write failure_count",
    ("SubTree", "__shared_blackboard"): 'write _autoremap="true"',
    ("SubTree", "__autoremap"): "write _autoremap",
}
