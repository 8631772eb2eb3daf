# SPDX-License-Identifier: MIT
"""Test cases of BehaviorTree.CPP 4.10 in our words: a tree, and what each tick does.

A tick is `ANSWERS -> STATUS : CALLS | ENTRIES`; all but the status may be left out. Answers and statuses are letters:
S(UCCESS), F(AILURE), R(UNNING), K for SKIPPED; leaves that are not named answer S. A call is a leaf's name, `~A` that A
was halted. `@100` sets the time [ms], `x:=3` an entry, before the tick; `x=3` tells one after it. HALT halts the tree.

Leaves: A to F are stateful actions, P and Q conditions, T and U synchronous actions. `Num v`, `Say text` and `Real v` take
a value and tell it in CALLS; `Out o` writes 42, `Put o` true.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Case:
    """One case. `theirs` is its name there; `differs` names the row of docs/semantics.md that says why, if it does."""

    theirs: str
    nodes: str
    ticks: tuple[str, ...]
    trees: str = ""
    inputs: str = ""
    """Ports of the main tree, as `name:type`."""
    differs: str = ""


def _case(theirs: str, nodes: str, *ticks: str, trees: str = "", inputs: str = "", differs: str = "") -> Case:
    return Case(theirs, nodes, ticks, trees, inputs, differs)


ONE_CYCLE = "Repeat and RetryUntilSuccessful over a child that completes at once"
COMPLEX = "<Sequence><Sequence><P/><Q/></Sequence><A/></Sequence>"
MEMORY = "<SequenceWithMemory><SequenceWithMemory><P/><Q/></SequenceWithMemory><A/></SequenceWithMemory>"

SEQUENCES = (
    _case("SimpleSequenceTest.ConditionTrue", "<Sequence><P/><A/></Sequence>", "A=R -> R : P A"),
    _case(
        "SimpleSequenceTest.ConditionTurnToFalse",
        "<ReactiveSequence><P/><A/></ReactiveSequence>",
        "A=R -> R : P A",
        "P=F -> F : P ~A",
    ),
    _case("ComplexSequenceTest.ComplexSequenceConditionsTrue", COMPLEX, "A=R -> R : P Q A", "A=S -> S : A"),
    _case(
        "SequenceTripleActionTest.TripleAction",
        "<Sequence><A/><B/><C/></Sequence>",
        "A=R -> R : A",
        "B=S C=R -> R : A B C",
        "C=S -> S : C",
    ),
    _case(
        "ComplexSequence2ActionsTest.ConditionsTrue",
        "<Sequence><Sequence><P/><A/></Sequence><Sequence><Q/><B/></Sequence></Sequence>",
        "A=R -> R : P A",
        "B=R -> R : A Q B",
        "-> S : B",
    ),
    _case(
        "ComplexSequenceTest.ComplexSequenceConditions1ToFalse",
        "<ReactiveSequence><ReactiveSequence><P/><Q/></ReactiveSequence><A/></ReactiveSequence>",
        "A=R -> R : P Q A",
        "P=F -> F : P ~A",
    ),
    _case(
        "ComplexSequenceTest.ComplexSequenceConditions2ToFalse",
        "<ReactiveSequence><ReactiveSequence><P/><Q/></ReactiveSequence><A/></ReactiveSequence>",
        "A=R -> R : P Q A",
        "Q=F -> F : P Q ~A",
    ),
    _case(
        "SimpleSequenceWithMemoryTest.ConditionTrue",
        "<SequenceWithMemory><P/><A/></SequenceWithMemory>",
        "A=R -> R : P A",
    ),
    _case(
        "SimpleSequenceWithMemoryTest.ConditionTurnToFalse",
        "<SequenceWithMemory><P/><A/></SequenceWithMemory>",
        "A=R -> R : P A",
        "P=F A=R -> R : A",
        "A=F -> F : A",
        "P=F A=S -> S : A",
    ),
    _case("ComplexSequenceWithMemoryTest.ConditionsTrue", MEMORY, "A=R -> R : P Q A", "A=S -> S : A"),
    _case("ComplexSequenceWithMemoryTest.Conditions1ToFalse", MEMORY, "A=R -> R : P Q A", "P=F A=R -> R : A"),
    _case(
        "SequenceWithMemoryTest.Issue_636",
        '<SequenceWithMemory><Script code="a := 1"/><T _skipIf="a == 1"/><U/></SequenceWithMemory>',
        "-> S : U",
    ),
)

FALLBACKS = (
    _case("SimpleFallbackTest.ConditionTrue", "<Fallback><P/><A/></Fallback>", "-> S : P"),
    _case(
        "SimpleFallbackTest.ConditionChangeWhileRunning",
        "<Fallback><P/><A/></Fallback>",
        "P=F A=R -> R : P A",
        "P=S A=R -> R : A",
    ),
    _case(
        "ReactiveFallbackTest.Condition1ToTrue",
        "<ReactiveFallback><P/><Q/><A/></ReactiveFallback>",
        "P=F Q=F A=R -> R : P Q A",
        "P=S -> S : P ~A",
    ),
    _case(
        "ReactiveFallbackTest.Condition2ToTrue",
        "<ReactiveFallback><P/><Q/><A/></ReactiveFallback>",
        "P=F Q=F A=R -> R : P Q A",
        "P=F Q=S -> S : P Q ~A",
    ),
    _case("SimpleFallbackWithMemoryTest.ConditionFalse", "<Fallback><P/><A/></Fallback>", "P=F A=R -> R : P A"),
    _case(
        "SimpleFallbackWithMemoryTest.ConditionTurnToTrue",
        "<Fallback><P/><A/></Fallback>",
        "P=F A=R -> R : P A",
        "P=S A=R -> R : A",
    ),
    _case(
        "ComplexFallbackWithMemoryTest.ConditionsTrue",
        "<Fallback><Fallback><P/><Q/></Fallback><Fallback><A/><B/></Fallback></Fallback>",
        "-> S : P",
    ),
    _case(
        "ComplexFallbackWithMemoryTest.Condition1False",
        "<Fallback><Fallback><P/><Q/></Fallback><Fallback><A/><B/></Fallback></Fallback>",
        "P=F -> S : P Q",
    ),
    _case(
        "ComplexFallbackWithMemoryTest.ConditionsFalse",
        "<Fallback><Fallback><P/><Q/></Fallback><Fallback><A/><B/></Fallback></Fallback>",
        "P=F Q=F A=R -> R : P Q A",
    ),
    _case(
        "ComplexFallbackWithMemoryTest.Conditions1ToTrue",
        "<Fallback><Fallback><P/><Q/></Fallback><Fallback><A/><B/></Fallback></Fallback>",
        "P=F Q=F A=R -> R : P Q A",
        "P=S A=R -> R : A",
    ),
    _case(
        "ComplexFallbackWithMemoryTest.Action1Failed",
        "<Fallback><Fallback><P/><Q/></Fallback><Fallback><A/><B/></Fallback></Fallback>",
        "P=F Q=F A=R -> R : P Q A",
        "A=F B=R -> R : A B",
    ),
)

PARALLEL = '<Parallel success_count="{}" failure_count="{}"><P/><A/><Q/><B/></Parallel>'
PARALLELS = (
    _case("SimpleParallelTest.ConditionsTrue", PARALLEL.format(4, 1), "A=R B=R -> R : P A Q B", "-> S : A B"),
    _case("SimpleParallelTest.Threshold_3", PARALLEL.format(3, 1), "A=R B=R -> R : P A Q B", "A=S B=R -> S : A ~B"),
    _case("SimpleParallelTest.Threshold_neg2", PARALLEL.format(-2, 1), "A=R B=R -> R : P A Q B", "A=S B=R -> S : A ~B"),
    _case(
        "SimpleParallelTest.Threshold_neg1",
        PARALLEL.format(-1, 1),
        "A=R B=R -> R : P A Q B",
        "A=S B=R -> R : A B",
        "B=S -> S : B",
    ),
    _case(
        "SimpleParallelTest.Threshold_thresholdFneg1",
        PARALLEL.format(1, -1).replace("<P/>", "").replace("<Q/>", ""),
        "A=F B=R -> R : A B",
        "B=F -> F : B",
    ),
    _case("SimpleParallelTest.Threshold_2", PARALLEL.format(2, 3), "A=R B=R -> S : P A Q ~A"),
    _case(
        "ComplexParallelTest.ConditionsLeftFalse",
        '<Parallel success_count="2" failure_count="1"><Parallel success_count="2"><P/><A/></Parallel><B/></Parallel>',
        "P=F A=R B=R -> F : P",
    ),
    _case(
        "ComplexParallelTest.ConditionRightFalse",
        '<Parallel success_count="2" failure_count="1"><A/><P/></Parallel>',
        "A=R P=F -> F : A P ~A",
    ),
    _case(
        "ComplexParallelTest.ConditionRightFalse_thresholdF_2",
        '<Parallel success_count="1" failure_count="2"><A/><P/></Parallel>',
        "A=R P=F -> R : A P",
        "A=S -> S : A",
    ),
    _case(
        "Parallel.FailingParallel",
        '<Parallel success_count="2" failure_count="1"><A/><B/></Parallel>',
        "A=R B=R -> R : A B",
        "A=F B=R -> F : A ~B",
    ),
    _case(
        "Parallel.ParallelAll",
        '<ParallelAll max_failures="1"><A/><B/><C/></ParallelAll>',
        "A=R B=F C=R -> R : A B C",
        "A=S C=R -> R : A C",
        "C=S -> F : C",
    ),
    _case(
        "Parallel.ParallelAll (2)",
        '<ParallelAll max_failures="2"><A/><B/><C/></ParallelAll>',
        "A=R B=F C=R -> R : A B C",
        "A=S C=S -> S : A C",
    ),
    _case(
        "Parallel.Issue593",
        '<Sequence><Script code="test := true"/><Parallel failure_count="1" success_count="-1">'
        '<T _skipIf="test == true"/><U/></Parallel></Sequence>',
        "-> S : U",
    ),
    _case(
        "Parallel.Issue819_SequenceVsReactiveSequence",
        '<Parallel success_count="-1"><ReactiveSequence><P/><A/></ReactiveSequence><B/></Parallel>',
        "A=R B=R -> R : P A B",
        "A=R B=S -> R : P A B",
        "A=S -> S : P A",
    ),
)

DECORATORS = (
    _case(
        "DeadlineTest.DeadlineTriggeredTest",
        '<Timeout msec="300"><A/></Timeout>',
        "@0 A=R -> R : A",
        "@299 A=R -> R : A",
        "@300 A=R -> F : ~A",
    ),
    _case(
        "DeadlineTest.DeadlineNotTriggeredTest",
        '<Timeout msec="300"><A/></Timeout>',
        "@0 A=R -> R : A",
        "@200 -> S : A",
    ),
    _case(
        "RetryTest.RetryTestA",
        '<RetryUntilSuccessful num_attempts="3"><T/></RetryUntilSuccessful>',
        "T=F -> R : T",
        "T=F -> R : T",
        "T=F -> F : T",
        "T=S -> S : T",
        differs=ONE_CYCLE,
    ),
    _case(
        "RepeatTest.RepeatTestA",
        '<Repeat num_cycles="3"><T/></Repeat>',
        "T=F -> F : T",
        "-> R : T",
        "-> R : T",
        "-> S : T",
        differs=ONE_CYCLE,
    ),
    _case(
        "RepeatTestAsync.RepeatTestAsync",
        '<Repeat num_cycles="3"><A/></Repeat>',
        "A=R -> R : A",
        "-> R : A",
        "A=R -> R : A",
        "-> R : A",
        "A=R -> R : A",
        "-> S : A",
    ),
    _case(
        "TimeoutAndRetry.Issue57",
        '<RetryUntilSuccessful num_attempts="5"><Timeout msec="5000"><AlwaysFailure/></Timeout></RetryUntilSuccessful>',
        *("-> R",) * 4,
        "-> F",
        differs=ONE_CYCLE,
    ),
    _case(
        "Decorator.RunOnce", "<Sequence><RunOnce><T/></RunOnce><U/></Sequence>", "-> S : T U", "-> S : U", "-> S : U"
    ),
    _case(
        "Decorator.DelayWithXML",
        '<Delay delay_msec="200"><AlwaysSuccess/></Delay>',
        "@0 -> R",
        "@100 -> R",
        "@200 -> S",
    ),
    _case("Decorator.ForceFailure_ChildSuccess", "<ForceFailure><T/></ForceFailure>", "-> F : T"),
    _case("Decorator.ForceFailure_ChildFailure", "<ForceFailure><T/></ForceFailure>", "T=F -> F : T"),
    _case("Decorator.ForceSuccess_ChildFailure", "<ForceSuccess><T/></ForceSuccess>", "T=F -> S : T"),
    _case("Decorator.ForceSuccess_ChildSuccess", "<ForceSuccess><T/></ForceSuccess>", "-> S : T"),
    _case("Decorator.Inverter_ChildSuccess", "<Inverter><T/></Inverter>", "-> F : T"),
    _case("Decorator.Inverter_ChildFailure", "<Inverter><T/></Inverter>", "T=F -> S : T"),
    _case("Decorator.Inverter_InSequence", "<Sequence><Inverter><T/></Inverter><U/></Sequence>", "T=F -> S : T U"),
    _case(
        "Decorator.KeepRunningUntilFailure",
        "<KeepRunningUntilFailure><T/></KeepRunningUntilFailure>",
        "-> R : T",
        "-> R : T",
        "T=F -> F : T",
    ),
)

REACTIVE = (
    _case(
        "Reactive.RunningChildren",
        "<ReactiveSequence><Sequence name='first'><T/><U/></Sequence><A/></ReactiveSequence>",
        "A=R -> R : T U A",
        "A=R -> R : T U A",
        "-> S : T U A",
    ),
    _case(
        "Reactive.ReactiveSequence_FirstChildFails",
        "<ReactiveSequence><AlwaysFailure/><T/></ReactiveSequence>",
        "-> F :",
    ),
    _case(
        "Reactive.ReactiveSequence_HaltOnConditionChange",
        "<ReactiveSequence><P/><A/></ReactiveSequence>",
        "A=R -> R : P A",
        "P=F -> F : P ~A",
    ),
    _case(
        "Reactive.ReactiveFallback_FirstChildSucceeds",
        "<ReactiveFallback><AlwaysSuccess/><T/></ReactiveFallback>",
        "-> S :",
    ),
    _case(
        "Reactive.ReactiveFallback_AllChildrenFail",
        "<ReactiveFallback><AlwaysFailure/><AlwaysFailure/></ReactiveFallback>",
        "-> F",
    ),
    _case(
        "Reactive.ReactiveFallback_SecondChildSucceeds",
        "<ReactiveFallback><AlwaysFailure/><T/></ReactiveFallback>",
        "-> S : T",
    ),
    _case(
        "Reactive.ReactiveSequence_AllChildrenSucceed", "<ReactiveSequence><T/><U/></ReactiveSequence>", "-> S : T U"
    ),
    _case(
        "Reactive.ReactiveSequence_ReEvaluatesOnEveryTick",
        "<ReactiveSequence><P/><A/></ReactiveSequence>",
        "A=R -> R : P A",
        "A=R -> R : P A",
        "-> S : P A",
    ),
    _case(
        "Reactive.Issue587",
        '<Sequence><Script code="test := false"/><ReactiveSequence><RetryUntilSuccessful name="r" num_attempts="1" '
        '_skipIf="test"><T/></RetryUntilSuccessful><U/></ReactiveSequence></Sequence>',
        "-> S : T U",
    ),
    _case(
        "ReactiveBackchaining.EnsureWarm",
        "<ReactiveFallback name='warm'><P/><ReactiveSequence><Q/><A/></ReactiveSequence></ReactiveFallback>",
        "P=F A=R -> R : P Q A",
        "P=F A=R -> R : P Q A",
        "P=S -> S : P ~A",
    ),
)

CONTROL = (
    _case("IfThenElseTest.ConditionTrue_ThenBranch", "<IfThenElse><P/><T/><U/></IfThenElse>", "-> S : P T"),
    _case("IfThenElseTest.ConditionFalse_ElseBranch", "<IfThenElse><P/><T/><U/></IfThenElse>", "P=F -> S : P U"),
    _case(
        "IfThenElseTest.ConditionFalse_TwoChildren_ReturnsFailure", "<IfThenElse><P/><T/></IfThenElse>", "P=F -> F : P"
    ),
    _case("IfThenElseTest.ThenBranchFails", "<IfThenElse><P/><T/><U/></IfThenElse>", "T=F -> F : P T"),
    _case("IfThenElseTest.ElseBranchFails", "<IfThenElse><P/><T/><U/></IfThenElse>", "P=F U=F -> F : P U"),
    _case("IfThenElseTest.ConditionRunning", "<IfThenElse><A/><T/><U/></IfThenElse>", "A=R -> R : A", "-> S : A T"),
    _case(
        "IfThenElseTest.HaltBehavior",
        "<IfThenElse><P/><A/><B/></IfThenElse>",
        "A=R -> R : P A",
        "HALT : ~A",
        "A=R -> R : P A",
    ),
    _case("WhileDoElseTest.ConditionTrue_DoBranch", "<WhileDoElse><P/><T/><U/></WhileDoElse>", "-> S : P T"),
    _case("WhileDoElseTest.ConditionFalse_ElseBranch", "<WhileDoElse><P/><T/><U/></WhileDoElse>", "P=F -> S : P U"),
    _case(
        "WhileDoElseTest.ConditionFalse_TwoChildren_ReturnsFailure",
        "<WhileDoElse><P/><T/></WhileDoElse>",
        "P=F -> F : P",
    ),
    _case("WhileDoElseTest.DoBranchFails", "<WhileDoElse><P/><T/><U/></WhileDoElse>", "T=F -> F : P T"),
    _case("WhileDoElseTest.ElseBranchFails", "<WhileDoElse><P/><T/><U/></WhileDoElse>", "P=F U=F -> F : P U"),
    _case(
        "WhileDoElseTest.ConditionChanges_HaltsElse",
        "<WhileDoElse><P/><A/><B/></WhileDoElse>",
        "P=F B=R -> R : P B",
        "A=R -> R : P ~B A",
    ),
    _case(
        "WhileDoElseTest.ConditionChanges_HaltsDo",
        "<WhileDoElse><P/><A/><B/></WhileDoElse>",
        "A=R -> R : P A",
        "P=F B=R -> R : P ~A B",
    ),
    _case("WhileDoElseTest.HaltBehavior", "<WhileDoElse><P/><A/><B/></WhileDoElse>", "A=R -> R : P A", "HALT : ~A"),
    _case("WhileDoElseTest.ConditionRunning", "<WhileDoElse><A/><T/><U/></WhileDoElse>", "A=R -> R : A", "-> S : A T"),
    _case("TryCatchTest.AllTryChildrenSucceed", "<TryCatch><T/><U/><A/></TryCatch>", "-> S : T U"),
    _case("TryCatchTest.FirstChildFails_CatchExecuted", "<TryCatch><AlwaysFailure/><T/><U/></TryCatch>", "-> F : U"),
    _case("TryCatchTest.SecondChildFails_CatchExecuted", "<TryCatch><T/><AlwaysFailure/><U/></TryCatch>", "-> F : T U"),
    _case(
        "TryCatchTest.CatchReturnsFailure_NodeStillReturnsFAILURE",
        "<TryCatch><AlwaysFailure/><T/></TryCatch>",
        "T=F -> F : T",
    ),
    _case(
        "TryCatchTest.CatchReturnsSuccess_NodeStillReturnsFAILURE",
        "<TryCatch><AlwaysFailure/><T/></TryCatch>",
        "-> F : T",
    ),
    _case("TryCatchTest.TryChildRunning", "<TryCatch><A/><T/></TryCatch>", "A=R -> R : A", "-> S : A"),
    _case(
        "TryCatchTest.CatchChildRunning", "<TryCatch><AlwaysFailure/><A/></TryCatch>", "A=R -> R : A", "A=F -> F : A"
    ),
    _case("TryCatchTest.ReExecuteAfterSuccess", "<TryCatch><T/><U/></TryCatch>", "-> S : T", "HALT :", "-> S : T"),
    _case("TryCatchTest.ReExecuteAfterFailure", "<TryCatch><T/><U/></TryCatch>", "T=F -> F : T U", "-> S : T"),
    _case("TryCatchTest.CatchOnHalt_Disabled", "<TryCatch><A/><T/></TryCatch>", "A=R -> R : A", "HALT : ~A"),
    _case(
        "TryCatchTest.CatchOnHalt_Enabled",
        '<TryCatch catch_on_halt="true"><A/><T/></TryCatch>',
        "A=R -> R : A",
        "HALT : ~A T",
    ),
    _case(
        "TryCatchTest.CatchOnHalt_NotTriggeredWhenAlreadyInCatch",
        '<TryCatch catch_on_halt="true"><AlwaysFailure/><A/></TryCatch>',
        "A=R -> R : A",
        "HALT : ~A",
    ),
    _case("TryCatchTest.SingleTryChild_Success", "<TryCatch><T/><U/></TryCatch>", "-> S : T"),
    _case(
        "TryCatchTest.ManyTryChildren_ThirdFails",
        "<TryCatch><T/><U/><AlwaysFailure/><A/><B/></TryCatch>",
        "-> F : T U B",
    ),
)

SWITCH = '<Switch2 variable="{v}" case_1="1" case_2="42"><A/><B/><C/></Switch2>'
SWITCHES = (
    _case("SwitchTest.DefaultCase", SWITCH, "v:=0 C=R -> R : C", "-> S : C", inputs="v:int"),
    _case("SwitchTest.Case1", SWITCH, "v:=1 A=R -> R : A", "-> S : A", inputs="v:int"),
    _case("SwitchTest.Case2", SWITCH, "v:=42 B=R -> R : B", "-> S : B", inputs="v:int"),
    _case("SwitchTest.CaseNone", SWITCH, "v:=7 C=R -> R : C", "-> S : C", inputs="v:int"),
    _case(
        "SwitchTest.CaseSwitchToDefault",
        SWITCH,
        "v:=1 A=R -> R : A",
        "A=R -> R : A",
        "v:=0 C=R -> R : ~A C",
        "-> S : C",
        inputs="v:int",
    ),
    _case(
        "SwitchTest.CaseSwitchToAction2",
        SWITCH,
        "v:=1 A=R -> R : A",
        "v:=42 B=R -> R : ~A B",
        "-> S : B",
        inputs="v:int",
    ),
    _case("SwitchTest.ActionFailure", SWITCH, "v:=1 A=R -> R : A", "A=F -> F : A", inputs="v:int"),
    _case(
        "SwitchStringEquality.RejectsTrailingCharacters",
        '<Sequence><Script code="v := \'5\'"/><Switch2 variable="{v}" case_1="5abc" case_2="5.0"><T/><U/>'
        "<AlwaysFailure/></Switch2></Sequence>",
        "-> S : U",
    ),
)

LOOPS = (
    _case(
        "LoopNode.StaticIntQueue",
        '<LoopInt queue="1;2;3" value="{v}"><Num v="{v}"/></LoopInt>',
        "-> R : Num(1)",
        "-> R : Num(2)",
        "-> R : Num(3)",
        "-> S :",
        differs=ONE_CYCLE,
    ),
    _case(
        "LoopNode.StaticDoubleQueue",
        '<LoopDouble queue="1.5;2.5" value="{v}"><Real v="{v}"/></LoopDouble>',
        "-> R : Real(1.5)",
        "-> R : Real(2.5)",
        "-> S :",
        differs=ONE_CYCLE,
    ),
    _case(
        "LoopNode.StaticStringQueue",
        '<LoopString queue="hello;world" value="{v}"><Say text="{v}"/></LoopString>',
        "-> R : Say(hello)",
        "-> R : Say(world)",
        "-> S :",
        differs=ONE_CYCLE,
    ),
    _case(
        "LoopNode.EmptyQueue_ReturnsSuccess",
        '<LoopInt queue="" if_empty="SUCCESS" value="{v}"><T/></LoopInt>',
        "-> S :",
    ),
    _case(
        "LoopNode.EmptyQueue_ReturnsFailure",
        '<LoopInt queue="" if_empty="FAILURE" value="{v}"><T/></LoopInt>',
        "-> F :",
    ),
    _case(
        "LoopNode.EmptyQueue_ReturnsSkipped",
        '<LoopInt queue="" if_empty="SKIPPED" value="{v}"><T/></LoopInt>',
        "-> K :",
    ),
    _case(
        "LoopNode.ChildFailure_StopsLoop",
        '<LoopInt queue="1;2;3" value="{v}"><T/></LoopInt>',
        "-> R : T",
        "T=F -> F : T",
        differs=ONE_CYCLE,
    ),
    _case(
        "LoopNode.BoolQueue",
        '<LoopBool queue="true;false" value="{v}"><Num v="7"/></LoopBool>',
        "-> R : Num(7) | v=1",
        "-> R : Num(7) | v=0",
        "-> S :",
        differs=ONE_CYCLE,
    ),
    _case(
        "LoopNode.RestartAfterCompletion",
        '<LoopInt queue="1;2" value="{v}"><Num v="{v}"/></LoopInt>',
        "-> R : Num(1)",
        "-> R : Num(2)",
        "-> S :",
        "-> R : Num(1)",
        differs=ONE_CYCLE,
    ),
)

SUB = '<BehaviorTree ID="Sub1"><Sequence><SubTree ID="Sub2" _skipIf="param != true"/></Sequence></BehaviorTree>'
CONDITIONS = (
    _case(
        "PreconditionsDecorator.Integers",
        '<Sequence><Script code="A:=1; B:=1; C:=3"/><Precondition if="A==B" else="FAILURE"><T/></Precondition>'
        '<Precondition if="A==C" else="SUCCESS"><U/></Precondition><Precondition if="A!=C" else="FAILURE"><A/></Precondition>'
        "</Sequence>",
        "-> S : T A",
    ),
    _case(
        "PreconditionsDecorator.DoubleEquals",
        '<Sequence><Script code="A:=1.5; B:=(1.0+0.5); C:=2.0"/><Precondition if="A==B" else="FAILURE"><T/></Precondition>'
        '<Precondition if="A==C" else="SUCCESS"><U/></Precondition></Sequence>',
        "-> S : T",
    ),
    _case(
        "PreconditionsDecorator.StringEquals",
        "<Sequence><Script code=\"A:='hello'\"/><Script code=\"B:='world'\"/><Script code=\"C:='world'\"/>"
        '<Precondition if="A==B" else="SUCCESS"><T/></Precondition><Precondition if="B==C" else="FAILURE"><U/></Precondition>'
        "</Sequence>",
        "-> S : U",
    ),
    _case(
        "PreconditionsDecorator.ChecksConditionOnce",
        '<Sequence><Precondition if="a==0" else="FAILURE"><A _while="b==0"/></Precondition></Sequence>',
        "a:=0 b:=0 A=R -> R : A",
        "a:=1 A=R -> R : A",
        "b:=1 -> K : ~A",
        inputs="a:int b:int",
        differs="a composite all of whose children were SKIPPED",
    ),
    _case(
        "Preconditions.Basic",
        '<Sequence><Script code="A:=1"/><A _successIf="A==1"/><B _successIf="A==2"/><Fallback><C _failureIf="A==1"/>'
        '<D _failureIf="A!=1"/></Fallback></Sequence>',
        "-> S : B D",
    ),
    _case(
        "Preconditions.Issue533",
        '<Sequence><T _skipIf="a!=1"/><U _skipIf="a!=2" _onSuccess="a=1"/><A _skipIf="a!=3" _onSuccess="a=2"/></Sequence>',
        "a:=3 -> S : A | a=2",
        "-> S : U | a=1",
        "-> S : T",
        inputs="a:int",
    ),
    _case("Preconditions.Issue585", '<Sequence><Script code="A:=1"/><A _skipIf="A==1"/></Sequence>', "-> S :"),
    _case(
        "Preconditions.Issue615_NoSkipWhenRunning_A",
        '<KeepRunningUntilFailure _skipIf="check == true"><AlwaysSuccess/></KeepRunningUntilFailure>',
        "check:=0 -> R",
        "check:=1 -> R",
        inputs="check:bool",
    ),
    _case(
        "Preconditions.Issue615_NoSkipWhenRunning_B",
        '<A _skipIf="check == false"/>',
        "check:=0 -> K :",
        "check:=1 A=R -> R : A",
        "check:=0 A=R -> R : A",
        inputs="check:bool",
    ),
    _case(
        "Preconditions.Remapping",
        '<Sequence><Put o="{param}"/><Script code="value:=true"/><SubTree ID="Sub1" param="{param}"/>'
        '<SubTree ID="Sub1" param="{value}"/><SubTree ID="Sub1" param="true"/><T/></Sequence>',
        "-> S : Put U U U T",
        trees=SUB + '<BehaviorTree ID="Sub2"><U/></BehaviorTree>',
    ),
    _case(
        "Preconditions.WhileCallsOnHalt",
        '<Sequence><A _while="b == 0" _onHalted="c := 5"/></Sequence>',
        "b:=0 A=R -> R : A",
        "b:=1 -> K : ~A | c=5",
        inputs="b:int",
        differs="a composite all of whose children were SKIPPED",
    ),
    _case(
        "PostConditions.BasicTest",
        '<Sequence><Script code="A:=1; B:=1; C:=1; D:=1"/><AlwaysSuccess _onSuccess="B=42"/><ForceSuccess>'
        '<AlwaysSuccess _failureIf="A!=0" _onFailure="C=42"/></ForceSuccess><ForceSuccess>'
        '<AlwaysFailure _onFailure="D=42"/></ForceSuccess></Sequence>',
        "-> S | B=42 C=42 D=42",
    ),
    _case(
        "PostConditions.Issue539",
        '<Sequence><Script code="x:=1"/><ForceSuccess><AlwaysFailure _post="x += 1"/></ForceSuccess>'
        '<AlwaysSuccess _post="x += 1"/></Sequence>',
        "-> S | x=3",
    ),
    _case(
        "PostConditions.Issue601",
        "<Sequence><Script code=\"test := 'A'\"/><T _skipIf=\"test != 'A'\" _onSuccess=\"test := 'B'\"/>"
        "<U _skipIf=\"test == 'B'\"/></Sequence>",
        "-> S : T",
    ),
    _case(
        "SkippingLogic.Sequence",
        '<Sequence><Script code="A:=1"/><T _successIf="A==2" _failureIf="A!=1" _skipIf="A==1"/><U/></Sequence>',
        "-> S : U",
    ),
    _case(
        "SkippingLogic.SkipAll",
        '<Sequence><T _skipIf="a==1"/><U _skipIf="a&lt;2"/><A _skipIf="a&gt;0"/></Sequence>',
        "a:=1 -> K :",
        inputs="a:int",
    ),
    _case(
        "SkippingLogic.SkipSubtree",
        '<Sequence><T/><Script code="data:=true"/><SubTree ID="sub" _skipIf="data"/></Sequence>',
        "-> S : T",
        trees='<BehaviorTree ID="sub"><U/></BehaviorTree>',
    ),
    _case(
        "SkippingLogic.ReactiveSingleChild",
        '<ReactiveSequence><AlwaysSuccess _skipIf="flag"/></ReactiveSequence>',
        "flag:=1 -> K",
        inputs="flag:bool",
    ),
    _case(
        "SkippingLogic.SkippingReactiveSequence",
        '<ReactiveSequence><Script code="value:=50"/><T _skipIf="value &lt; 25"/><A/></ReactiveSequence>',
        "A=R -> R : T A",
        "-> S : T A",
    ),
    _case(
        "SkippingLogic.SkippingReactiveSequence (2)",
        '<ReactiveSequence><Script code="value:=10"/><T _skipIf="value &lt; 25"/><A/></ReactiveSequence>',
        "A=R -> R : A",
        "-> S : A",
    ),
    _case(
        "SkippingLogic.WhileSkip",
        '<Sequence><Script code="doit:=true"/><Sequence><T _while="doit"/></Sequence></Sequence>',
        "-> S : T",
    ),
    _case(
        "SkippingLogic.WhileSkip (2)",
        '<Sequence><Script code="doit:=false"/><Sequence><T _while="doit"/></Sequence></Sequence>',
        "-> S :",
    ),
    _case(
        "EntryUpdates.UpdateOnce",
        '<Sequence><Script code="value := 1"/><Repeat num_cycles="2"><Sequence><SkipUnlessUpdated entry="{value}"><T/>'
        "</SkipUnlessUpdated><U/></Sequence></Repeat></Sequence>",
        "-> R : T U",
        "-> S : U",
        differs=ONE_CYCLE,
    ),
    _case(
        "EntryUpdates.UpdateTwice",
        '<Sequence><Repeat num_cycles="2"><Sequence><Script code="value := 1"/><SkipUnlessUpdated entry="{value}"><T/>'
        "</SkipUnlessUpdated><U/></Sequence></Repeat></Sequence>",
        "-> R : T U",
        "-> S : T U",
        differs=ONE_CYCLE,
    ),
)

SAY = '<BehaviorTree ID="mySubtree"><Say text="{param}"/></BehaviorTree>'
COPY = '<BehaviorTree ID="Copy"><SetBlackboard value="{in_arg}" output_key="out_arg"/></BehaviorTree>'
SUBTREES = (
    _case(
        "SubTree.SiblingPorts_Issue_72",
        '<Sequence><Script code="myParam = \'hello\'"/><SubTree ID="mySubtree" param="{myParam}"/>'
        '<Script code="myParam = \'world\'"/><SubTree ID="mySubtree" param="{myParam}"/></Sequence>',
        "-> S : Say(hello) Say(world)",
        trees=SAY,
    ),
    _case(
        "SubTree.GoodRemapping",
        '<Sequence><Script code="thoughts := \'hello\'"/><SubTree ID="Copy" in_arg="{thoughts}" out_arg="{greetings}"/>'
        '<Say text="{greetings}"/></Sequence>',
        "-> S : Say(hello)",
        trees=COPY,
    ),
    _case(
        "SubTree.SubtreePlusA",
        '<Sequence><Script code="myParam = \'Hello\'"/><SubTree ID="mySubtree" param="{myParam}"/>'
        '<SubTree ID="mySubtree" param="World"/><Script code="param = \'Auto remapped\'"/>'
        '<SubTree ID="mySubtree" _autoremap="1"/></Sequence>',
        "-> S : Say(Hello) Say(World) Say(Auto_remapped)",
        trees=SAY,
    ),
    _case(
        "SubTree.SubtreePlusB",
        "<Sequence><Script code=\"myParam = 'Hello World'; param3='Auto remapped'\"/>"
        '<SubTree ID="B" _autoremap="1" param1="{myParam}" param2="Straight Talking"/></Sequence>',
        "-> S : Say(Hello_World) Say(Straight_Talking) Say(Auto_remapped)",
        trees='<BehaviorTree ID="B"><Sequence><Say text="{param1}"/><Say text="{param2}"/><Say text="{param3}"/></Sequence>'
        "</BehaviorTree>",
    ),
    _case(
        "SubTree.ScriptRemap",
        '<Sequence><Script code="value:=0"/><SubTree ID="S" value="{value}"/></Sequence>',
        "-> S | value=1",
        trees='<BehaviorTree ID="S"><Script code="value:=1"/></BehaviorTree>',
    ),
    _case(
        "SubTree.SubtreeIssue592",
        '<Sequence><Out o="{v}"/><SubTree ID="In" w="{v}"/></Sequence>',
        "-> S : Out Num(42)",
        trees='<BehaviorTree ID="In"><Num v="{w}"/></BehaviorTree>',
    ),
    _case(
        "SubTree.RemappingIssue696",
        '<Sequence><SubTree ID="S1" msg="hello"/><SubTree ID="S2" pose="7"/></Sequence>',
        "-> S : Say(hello) Num(7)",
        trees='<BehaviorTree ID="S1"><Say text="{msg}"/></BehaviorTree><BehaviorTree ID="S2"><Num v="{pose}"/></BehaviorTree>',
    ),
    _case(
        "SubTree.PrivateAutoRemapping",
        '<Sequence><SetBlackboard output_key="public_value" value="5"/><SetBlackboard output_key="_private_value" value="5"/>'
        '<SubTree ID="Sub" _autoremap="true"/></Sequence>',
        "-> S : Num(5) | public_value=3 _private_value=5",
        trees='<BehaviorTree ID="Sub"><Sequence><Num v="{public_value}"/><Script code="public_value := 3"/>'
        '<Script code="_private_value := 4"/></Sequence></BehaviorTree>',
    ),
    _case(
        "SubTree.SubtreeNav2_Issue563",
        '<SubTree ID="Nested" mission="{@x}"/>',
        "@x:=9 -> S : Num(9)",
        inputs="x:int",
        trees='<BehaviorTree ID="Nested"><Num v="{mission}"/></BehaviorTree>',
    ),
    _case(
        "BlackboardTest.RootBlackboard",
        '<Sequence><SetBlackboard output_key="@value" value="2"/><SubTree ID="A1"/></Sequence>',
        "-> S : Num(2) | value=3",
        trees='<BehaviorTree ID="A1"><Sequence><Num v="{@value}"/><Script code="@value := 3"/></Sequence></BehaviorTree>',
    ),
    _case(
        "BlackboardTest.IssueSetBlackboard",
        '<Sequence><SetBlackboard output_key="value" value="42"/><Num v="{value}"/></Sequence>',
        "-> S : Num(42)",
    ),
    _case(
        "BlackboardTest.SetBlackboard_Issue725",
        '<Sequence><Out o="{v}"/><SetBlackboard output_key="w" value="{v}"/><Num v="{w}"/></Sequence>',
        "-> S : Out Num(42)",
    ),
    _case(
        "ours: SetBlackboard from an entry",
        '<Sequence><SetBlackboard value="1" output_key="a"/><SetBlackboard value="{a}" output_key="b"/>'
        '<ScriptCondition code="b == 1"/></Sequence>',
        "-> S | a=1 b=1",
    ),
    _case(
        "ours: an entry that is unset",
        '<Sequence><Script code="a := 5"/><UnsetBlackboard key="a"/><ScriptCondition code="a == 0"/></Sequence>',
        "-> S | a=0",
    ),
    _case("ours: numbers", '<Sequence><Num v="7"/><Num v="-3"/></Sequence>', "-> S : Num(7) Num(-3)"),
    _case("ours: a text", '<Say text="a;b c"/>', "-> S : Say(a;b_c)"),
    _case(
        "ours: an entry with the port's name", '<Sequence><Out o="{=}"/><Num v="{o}"/></Sequence>', "-> S : Out Num(42)"
    ),
)

SCRIPTS = (
    _case(
        "ParserTest.Equations",
        '<Sequence><Script code="x := 3; y := 5; z := x * y - 2"/>'
        '<ScriptCondition code="z == 13 &amp;&amp; x &lt; y"/></Sequence>',
        "-> S | z=13",
    ),
    _case(
        "ParserTest.NotInitializedComparison",
        '<ScriptCondition code="x != 3"/>',
        "x:=4 -> S",
        "x:=3 -> F",
        inputs="x:int",
    ),
    _case(
        "ours: a text in a comparison",
        "<Sequence><Script code=\"mode := 'fast'\"/><ScriptCondition code=\"mode == 'fast'\"/></Sequence>",
        "-> S",
    ),
    _case("ParserTest.Issue605_whitespaces", '<Script code=" x := 1 ;&#10; y := x + 1 ; "/>', "-> S | x=1 y=2"),
    _case(
        "ParserTest.OperatorPrecedence",
        '<Script code="a := 1 || 0 &amp;&amp; 0; b := 1 | 2 &amp; 2; c := 2 + 3 &amp; 4"/>',
        "-> S | a=1 b=3 c=4",
    ),
    _case(
        "ParserTest.TernaryExpressions",
        '<Script code="a := 5 &gt; 3 ? 10 : 20; b := 5 &lt; 3 ? 10 : 20"/>',
        "-> S | a=10 b=20",
    ),
    _case(
        "ParserTest.OperatorAssociativity_Issue1029",
        '<Script code="a := 10 - 3 - 2; b := 2 * 3 + 4"/>',
        "-> S | a=5 b=10",
    ),
    _case(
        "Enums.SwitchNodeWithEnum",
        '<Sequence><Script code="color := Red"/><Switch3 variable="{color}" case_1="Red" case_2="Blue" case_3="Green"><T/>'
        "<U/><A/><AlwaysFailure/></Switch3></Sequence>",
        "-> S : T",
    ),
    _case(
        "ParserTest.EnumsBasic",
        '<Sequence><Script code="c := Blue"/><ScriptCondition code="c == Blue &amp;&amp; c != Red"/></Sequence>',
        "-> S | c=1",
    ),
)

CASES = (
    *SEQUENCES,
    *FALLBACKS,
    *PARALLELS,
    *DECORATORS,
    *REACTIVE,
    *CONTROL,
    *SWITCHES,
    *LOOPS,
    *CONDITIONS,
    *SUBTREES,
    *SCRIPTS,
)

# Theirs that throw when the tree is made, and what the compiler says.
REFUSED = {
    "IfThenElseTest.InvalidChildCount_One": ("<IfThenElse><P/></IfThenElse>", "needs 2 to 3 child node(s), and has 1"),
    "IfThenElseTest.InvalidChildCount_Four": ("<IfThenElse><P/><T/><T/><T/></IfThenElse>", "and has 4"),
    "WhileDoElseTest.InvalidChildCount_One": ("<WhileDoElse><P/></WhileDoElse>", "and has 1"),
    "WhileDoElseTest.InvalidChildCount_Four": ("<WhileDoElse><P/><T/><T/><T/></WhileDoElse>", "and has 4"),
    "TryCatchTest.MinimumTwoChildren_ParseTimeValidation": ("<TryCatch><T/></TryCatch>", "needs at least 2"),
    "SubTree.BadRemapping": ('<SubTree ID="mySubtree"/>', "nothing writes entry 'param'"),
    "PortTest.MissingPort": ('<Num w="1"/>', "<Num> has no attribute 'w'"),
    "PortTypeRules.StringLiteralValidation_InvalidFormat": ('<Num v="a"/>', "'a' is not a whole number"),
    "ParserTest.AnyTypes_Failing": ('<Script code="1 +"/>', "a value is expected here"),
    "ours: an assignment to nothing": ('<Script code="x = 1"/>', "'=' needs an entry that is there"),
    "BehaviorTreeFactory.WrongTreeName": ('<SubTree ID="Nobody"/>', "names no tree: 'Nobody'"),
    "ours: an unknown node": ("<Nobody/>", "unknown node 'Nobody'"),
    "SubTree.RecursiveCycle": ('<SubTree ID="M"/>', "trees contain each other in a cycle"),
    "EntryUpdates.NoEntry": ('<SkipUnlessUpdated entry="{nothing}"><T/></SkipUnlessUpdated>', "nothing writes entry 'nothing'"),
}  # fmt: skip
