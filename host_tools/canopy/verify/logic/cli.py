# SPDX-License-Identifier: MIT
"""`canopy verify --never` and `--always`: what is asked and how it is shown."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from canopy.compiler.errors import CompileError, Place
from canopy.compiler.port_types import Options
from canopy.compiler.tree_reader import read_tree
from canopy.escape.json_text import dumps
from canopy.escape.terminal import echo, echo_lines
from canopy.semantics.spec import STATUS_NAMES
from canopy.verify.expression import ExpressionError
from canopy.verify.logic.ask import Verdict, ask, called
from canopy.verify.logic.engine import EngineError
from canopy.verify.logic.formula import Formula, parse
from canopy.verify.logic.subject import LogicTree

SHOWN = 8
NOT_PROVEN = 1


def _read(tree: LogicTree, option: str, text: str) -> Formula:
    """The formula that has to hold in every tick."""
    try:
        formula = parse(text, tree.number)
    except ExpressionError as error:
        message = f"column {error.at + 1}: {error.message}"
        raise CompileError(Place(option), message, error.help_text) from None
    return Formula("not", (formula,)) if option == "--never" else formula


def _trace(tree: LogicTree, verdict: Verdict, whole: bool) -> list[str]:
    lines = []
    for tick, (inputs, moments) in enumerate(zip(verdict.inputs, verdict.trace, strict=True), 1):
        answers = ", ".join(f"{path} {status}" for path, status in called(tree, inputs, moments))
        lines.append(f"{tick:>6}  {answers or 'no leaf is called'}: the tree is {STATUS_NAMES[moments[0].returned]}")
    if whole or len(lines) <= SHOWN + 1:
        return lines
    return [*lines[: SHOWN // 2], f"     …  {len(lines) - SHOWN} more (--trace shows all)", *lines[-SHOWN // 2 :]]


def _print(tree: LogicTree, question: str, verdict: Verdict, whole: bool) -> None:
    texts = {
        "proven": "whatever the leaves answer",
        "refuted": f"in tick {len(verdict.trace)}, replayed in the reference model",
    }
    echo(f"{verdict.verdict:8} {question}")
    echo(f"         {texts.get(verdict.verdict, verdict.reason)} ({verdict.seconds:.2f} s)")
    for line in _trace(tree, verdict, whole):
        echo(f"  {line}")


def _as_json(tree: LogicTree, question: str, verdict: Verdict) -> dict[str, Any]:
    paths = [node.path.lstrip("/") for node in tree.nodes]
    return {
        "question": question,
        "verdict": verdict.verdict,
        "reason": verdict.reason,
        "seconds": round(verdict.seconds, 3),
        "trace": [
            {
                "answers": dict(called(tree, inputs, moments)),
                "statuses": {path: STATUS_NAMES[one.code] for path, one in zip(paths, moments, strict=True)},
                "halted": [path for path, one in zip(paths, moments, strict=True) if one.halted],
            }
            for inputs, moments in zip(verdict.inputs, verdict.trace, strict=True)
        ],
    }


def run(
    path: Path,
    questions: Sequence[tuple[str, str]],
    options: Options,
    *,
    period_ms: int | None,
    timeout: float,
    whole: bool,
    json_: bool,
) -> int:
    """Answers questions, each an option (--never, --always) and its formula. Returns the exit status.

    Raises:
        CompileError: The tree or a formula is wrong, or berkeley-abc cannot be run.
    """
    tree = LogicTree(read_tree(path, options))
    formulas = [(f"{option[2:]} {text}", _read(tree, option, text)) for option, text in questions]
    results = []
    for question, formula in formulas:
        try:
            verdict = ask(tree, formula, period_ms, timeout)
        except EngineError as error:
            raise CompileError(Place(str(path)), str(error), error.help_text) from error
        results.append((question, verdict))
        if not json_:
            _print(tree, question, verdict, whole)
    if json_:
        echo_lines(dumps([_as_json(tree, *one) for one in results], indent=1))
    return 0 if all(verdict.verdict == "proven" for _, verdict in results) else NOT_PROVEN
