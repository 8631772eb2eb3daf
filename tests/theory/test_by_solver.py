# SPDX-License-Identifier: MIT
"""The right forms of Lemmas 2 to 5 for every state space, finite or not, by two solvers.

A time bound is a rank: a whole number that each step makes smaller, 1 at least. So a lemma is a statement about one
state x and where it goes: y = f1(x), z = f2(x). The states are a sort without structure, and what holds is asked for as
"there is no state that breaks it".
"""

from __future__ import annotations

import pytest

from canopy.verify.solvers import SOLVERS, decide

DECLARATIONS = """
(declare-sort State 0)
(declare-fun f1 (State) State) (declare-fun f2 (State) State)
(declare-fun S1 (State) Bool) (declare-fun R1 (State) Bool) (declare-fun F1 (State) Bool)
(declare-fun S2 (State) Bool) (declare-fun R2 (State) Bool) (declare-fun F2 (State) Bool)
(declare-fun A1 (State) Bool) (declare-fun A2 (State) Bool)
(declare-fun rank1 (State) Int) (declare-fun rank2 (State) Int)
(declare-const tau1 Int) (declare-const tau2 Int)
(declare-const x State)
(define-fun y () State (f1 x)) (define-fun z () State (f2 x))
"""


def partition(child: int, point: str) -> str:
    s, r, f = (f"({part}{child} {point})" for part in "SRF")
    return f"(assert (and (or {s} {r} {f}) (not (and {s} {r})) (not (and {s} {f})) (not (and {r} {f}))))\n"


def attracted(child: int, point: str, *, goes: str = "") -> str:
    """A is in R, and its rank between 1 and tau; and, where `goes` is given, the step goes down in A, or into S."""
    n = child
    text = f"(assert (=> (A{n} {point}) (and (R{n} {point}) (<= 1 (rank{n} {point}) tau{n}))))\n"
    if goes:
        down = f"(and (A{n} {goes}) (< (rank{n} {goes}) (rank{n} {point})))"
        text += f"(assert (=> (A{n} {point}) (or {down} (S{n} {goes}))))\n"
    return text


def premises() -> str:
    text = DECLARATIONS + "(assert (and (<= 1 tau1) (<= 1 tau2)))\n"
    for child in (1, 2):
        text += "".join(partition(child, point) for point in "xyz")
    text += attracted(1, "x", goes="y") + attracted(1, "y") + attracted(1, "z")
    return text + attracted(2, "x", goes="z") + attracted(2, "y") + attracted(2, "z")


def broken(whole: dict[str, str]) -> str:
    """Some x of A0 is not RUNNING, has a rank out of 1..tau0, or steps neither down in A0 nor into S0."""
    names = {"A": "Bool", "S": "Bool", "R": "Bool", "rank": "Int"}
    text = "".join(f"(define-fun {n}0 ((s State)) {kind} {whole[n]})\n" for n, kind in names.items())
    text += f"(define-fun w () State {whole['next']})\n"
    good = "(and (R0 x) (<= 1 (rank0 x) (+ tau1 tau2)) (or (S0 w) (and (A0 w) (< (rank0 w) (rank0 x)))))"
    return text + f"(assert (and (A0 x) (not {good})))\n"


SEQUENCE = {
    "A": "(or (A1 s) (A2 s))",
    "S": "(and (S1 s) (S2 s))",
    "R": "(ite (S1 s) (R2 s) (R1 s))",
    "rank": "(ite (A1 s) (+ (rank1 s) tau2) (rank2 s))",
    "next": "(ite (S1 x) z y)",
}
FALLBACK = {
    "A": "(and (or (A1 s) (A2 s)) (not (S1 s)))",
    "S": "(ite (F1 s) (S2 s) (S1 s))",
    "R": "(ite (F1 s) (R2 s) (R1 s))",
    "rank": "(ite (A1 s) (rank1 s) (+ (rank2 s) tau1))",
    "next": "(ite (F1 x) z y)",
}
# Each premise as a list: the same one at several points.
LEMMA_2 = [
    [f"(=> (A2 {point}) (S1 {point}))" for point in "xyz"],
    ["(=> (and (A1 x) (not (A1 y))) (or (A2 y) (S2 y)))"],
    ["(=> (and (A2 x) (not (A2 z))) (S1 z))"],
]
LEMMA_3 = [
    [f"(=> (and (A2 {point}) (R1 {point})) (A1 {point}))" for point in "xyz"],
    ["(=> (and (A2 x) (F1 x) (not (A2 z))) (or (A1 z) (S1 z)))"],
]
LEMMA_3_AS_PRINTED = [[f"(=> (S2 {point}) (A1 {point}))" for point in "xyz"]]


def asserted(form: list[list[str]]) -> str:
    return "".join(f"(assert {formula})\n" for premise in form for formula in premise)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("whole", "form"), [(SEQUENCE, LEMMA_2), (FALLBACK, LEMMA_3)], ids=["lemma 2", "lemma 3"])
def test_the_form_that_canopy_uses_holds_in_every_state_space(
    whole: dict[str, str], form: list[list[str]], solver: str
) -> None:
    assert decide(premises() + asserted(form) + broken(whole), solver) == "unsat"


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("whole", "form"), [(SEQUENCE, LEMMA_2), (FALLBACK, LEMMA_3)], ids=["lemma 2", "lemma 3"])
def test_every_premise_is_needed(whole: dict[str, str], form: list[list[str]], solver: str) -> None:
    """Without any one of them there is a model that breaks the lemma."""
    for premise in form:
        rest = [other for other in form if other is not premise]
        assert decide(premises() + asserted(rest) + broken(whole), solver) == "sat", premise


@pytest.mark.parametrize("solver", SOLVERS)
def test_lemma_3_as_printed_has_a_counterexample(solver: str) -> None:
    assert decide(premises() + asserted(LEMMA_3_AS_PRINTED) + broken(FALLBACK), solver) == "sat"


LEMMA_5 = """
(declare-sort State 0)
(declare-fun f1 (State) State)
(declare-fun S1 (State) Bool) (declare-fun O (State) Bool) (declare-fun I (State) Bool)
(declare-fun Safe (State) Bool) ; what the guard's runs from I meet until it succeeds
(declare-fun near (State State) Bool) ; a step that the guarded child may take
(declare-const x State) (declare-const w State)
(assert (=> (I x) (Safe x))) (assert (=> (I w) (Safe w)))
(assert (=> (and (Safe x) (not (S1 x))) (Safe (f1 x))))
(assert (=> (Safe x) (not (O x)))) (assert (=> (Safe w) (not (O w)))) (assert (=> (Safe (f1 x)) (not (O (f1 x)))))
; the step of the sequence
(assert (ite (S1 x) (near x w) (= w (f1 x))))
; Safe is an invariant without O: broken?
(assert (and (Safe x) (or (not (Safe w)) (O w))))
"""


@pytest.mark.parametrize("solver", SOLVERS)
def test_lemma_5_in_its_right_form_holds_in_every_state_space(solver: str) -> None:
    margin = "(assert (=> (and (S1 x) (near x w)) (I w)))\n"
    assert decide(LEMMA_5 + margin, solver) == "unsat"
    assert decide(LEMMA_5, solver) == "sat"
