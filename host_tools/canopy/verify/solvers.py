# SPDX-License-Identifier: MIT
"""The two solvers behind one function. What they are asked is SMT-LIB text, so that neither sees the other's API."""

from __future__ import annotations

import importlib
from typing import Any, Literal

Answer = Literal["sat", "unsat", "unknown"]
SOLVERS = ("z3", "cvc5")
LIMIT_MS = 60_000
"""Longest time for one question [ms]; then the answer is "unknown"."""


def decide(script: str, solver: str) -> Answer:
    """Is a set of assertions satisfiable?

    Args:
        script: SMT-LIB 2 declarations and assertions, without (check-sat).
        solver: One of SOLVERS.

    Raises:
        ModuleNotFoundError: The solver's package is not installed; it is in the extra `verify`.
    """
    return _z3(script) if solver == "z3" else _cvc5(script)


def _answer(text: str) -> Answer:
    if text == "sat":
        return "sat"
    return "unsat" if text == "unsat" else "unknown"


def _z3(script: str) -> Answer:
    z3: Any = importlib.import_module("z3")
    solver = z3.Solver()
    solver.set("timeout", LIMIT_MS)
    solver.from_string(script)
    return _answer(str(solver.check()))


def _cvc5(script: str) -> Answer:
    cvc5: Any = importlib.import_module("cvc5")
    solver = cvc5.Solver(cvc5.TermManager())
    solver.setOption("tlimit-per", str(LIMIT_MS))
    parser = cvc5.InputParser(solver)
    text = f"(set-logic ALL)\n{script}\n(check-sat)\n"
    parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, text, "question")
    symbols = parser.getSymbolManager()
    answer = ""
    while True:
        command = parser.nextCommand()
        if command.isNull():
            return _answer(answer)
        answer = str(command.invoke(solver, symbols)).strip() or answer
