# SPDX-License-Identifier: MIT
"""How much of what people have drawn compiles: the table of docs/xml.md, from a folder of checkouts.

    python tests/corpus/measure.py CHECKOUTS [--draw 50 --seed 1] [--vendor OWNER]

Each folder in CHECKOUTS is one repository; a file COMMIT in it, or its git, says which commit. Every file with a root
of format 4 and a <BehaviorTree> is compiled three times at most: alone; with --search over its repository; with one
model that `canopy model` wrote for it; all with floating point, unset ports and a header of C types allowed. A file
without a main tree counts when each of its trees that is no part of another one compiles.
"""

from __future__ import annotations

import argparse
import random
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from canopy.compiler.documents import read_files, roots
from canopy.compiler.emit import load_application
from canopy.compiler.errors import CombinedError, CompileError
from canopy.compiler.port_types import ANY_TYPE, Options
from canopy.compiler.tree_reader import built_in_names
from canopy.tree.guess import guess_models
from canopy.tree.model_file import model_text
from canopy.tree.search import complete

DBC = Path(__file__).parent / "bus.dbc"
STEPS = ("alone", "with its repository", "with one model", "not at all")
FAULT = "a fault of Canopy's"

# The first that matches a message names the class of the refusal.
CLASSES = {
    "not well-formed XML": r"not well-formed|encoding|document type",
    "format 3, or none": r"must be <root BTCPP_format",
    "no tree, several nodes or none in a tree": r"no <BehaviorTree>|needs exactly 1 node|is not supported here",
    "renamed since format 3": r"(SequenceStar|RetryUntilSuccesful|SubTreePlus|BlackboardCheck|threshold)",
    "a node that nobody declared": r"unknown node|no file declares",
    "a tree that is nowhere": r"names no tree",
    "wrong number of children": r"child node|cannot have children|can never be met",
    "an attribute that the node does not have": r"has no attribute|needs the attribute",
    "a misspelt name": r"unknown metadata",
    "two declarations that differ": r"declared again|is declared as|declared in two files|in two files",
    "entries of two types": r"but entry .* is |written as .* elsewhere|nothing gives",
    "an entry that nothing writes": r"nothing writes|needs an entry that is there",
    "the name of an entry": r"is not the name of an entry|cannot be the name of a port|is a signal",
    "a literal for what is written": r"is written, and",
    "a literal that the type does not have": r"is not a|cannot be a value|is outside|cannot be stored|finite number",
    "a type without a C type": r"unsupported type|floating point, which",
    "a script": r"<.*>: |in one row|fractions",
    "an include that is not there": r"included file|ros_pkg",
    "files that include each other": r"include each other|contain each other",
    "an ID that is no C name, or an ID twice": r"C identifier|needs an ID",
}  # fmt: skip


@dataclass
class Result:
    """What became of one file."""

    repository: str
    path: Path
    step: str = STEPS[3]
    classes: Counter[str] = field(default_factory=Counter)
    message: str = ""
    first: str = ""


def name_of(error: Exception) -> str:
    """The class of a refusal."""
    if not isinstance(error, CompileError):
        return FAULT
    for name, pattern in CLASSES.items():
        if re.search(pattern, error.message):
            return name
    return "another reason"


def tree_files(folder: Path) -> Iterator[Path]:
    """The files of a repository that are trees of format 4, in a fixed order."""
    for path in sorted([*folder.rglob("*.xml"), *folder.rglob("*.btproj")]):
        if "fuzzing" in path.parts:  # drawn by nobody
            continue
        try:
            text = path.read_bytes()
        except OSError:
            continue
        if b"<BehaviorTree" in text and re.search(rb"BTCPP_format\s*=\s*[\"']4[\"']", text):
            yield path


def _compile(path: Path, options: Options) -> None:
    """Compiles every tree that can be the main one."""
    documents = read_files(path, options, built_in_names())
    top = documents.top
    assert top is not None
    if "main_tree_to_execute" in top.attributes or not documents.trees:
        mains: list[str | None] = [None]
    else:
        own = [name for name, tree in documents.trees.items() if tree.place.file == str(path)]
        mains = list(roots(own or list(documents.trees), documents.trees))
    for main in mains:
        load_application("corpus", path, DBC, "Controller", 50, 500_000, options=replace(options, main_tree=main))


def _model(path: Path, options: Options, into: Path) -> Path:
    """What `canopy model` writes for the file."""
    documents = read_files(path, replace(ANY_TYPE, search=options.search), built_in_names())
    complete(documents, built_in_names())
    into.write_text(model_text(guess_models([documents])), encoding="utf-8")
    return into


def measure(repository: Path, path: Path, scratch: Path) -> Result:
    """Compiles a file with more and more help, until it does."""
    result = Result(repository.name.replace("+", "/"), path)
    plain = Options(floats=True, unset_ports=True, include="types.h")
    searching = replace(plain, search=(repository,))
    for step, options in zip(STEPS, (plain, searching, searching), strict=False):
        try:
            if step == STEPS[2]:
                options = replace(options, search=(repository, _model(path, searching, scratch / "nodes.xml")))
            _compile(path, options)
        except CompileError as error:
            errors = error.errors if isinstance(error, CombinedError) else (error,)
            result.classes = Counter({name_of(one): 1 for one in errors})
            result.message = str(error)
        except Exception as error:  # any other one is a fault, and is to be counted as such
            result.classes = Counter({FAULT: 1})
            result.message = f"{path}: {type(error).__name__}: {error}"
        else:
            result.step, result.classes, result.message = step, Counter(), ""
            return result
        result.first = result.first or result.message
    return result


def commit_of(repository: Path) -> str:
    """The commit of a checkout."""
    if (repository / "COMMIT").exists():
        return (repository / "COMMIT").read_text().strip()[:10]
    if (repository / ".git").exists():
        command = ["git", "-C", str(repository), "rev-parse", "--short=10", "HEAD"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    return "-"


def _row(name: str, results: list[Result]) -> str:
    counts = Counter(result.step for result in results)
    total = len(results)
    cells, sum_ = [], 0
    for step in STEPS[:3]:
        sum_ += counts[step]
        cells.append(f"{sum_} ({100 * sum_ / total:.0f} %)")
    return f"| {name} | {total} | {' | '.join(cells)} | {counts[STEPS[3]]} |"


def table(results: list[Result], vendors: tuple[str, ...]) -> str:
    """The table, in Markdown; each column counts those of the columns before it, too."""
    groups: dict[str, list[Result]] = {}
    for result in results:
        owner = result.repository.partition("/")[0]
        groups.setdefault(f"{owner}'s collection" if owner in vendors else "all others", []).append(result)
    lines = ["| trees of | files | alone | with their repository | with at most one model | not at all |"]
    lines += ["|---|---|---|---|---|---|"]
    lines += [_row(name, group) for name, group in sorted(groups.items())]
    reasons = Counter(name for result in results for name in result.classes)
    lines += ["", "| why not at all | files |", "|---|---|"]
    lines += [f"| {name} | {count} |" for name, count in reasons.most_common()]
    return "\n".join(lines)


def main() -> int:
    """Measures, and prints. Exit status 1: Canopy was at fault."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkouts", type=Path)
    parser.add_argument("--draw", type=int, default=0, help="print so many refusals to be read")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--vendor", action="append", default=[], help="an owner whose trees are counted apart")
    parser.add_argument("--verbose", action="store_true", help="print what became of each file")
    arguments = parser.parse_args()
    results = []
    commits = {}
    with tempfile.TemporaryDirectory() as scratch:
        for repository in sorted(folder for folder in arguments.checkouts.iterdir() if folder.is_dir()):
            for path in tree_files(repository):
                result = measure(repository, path, Path(scratch))
                results.append(result)
                commits[result.repository] = commit_of(repository)
                if arguments.verbose:
                    print(result.step, path.relative_to(arguments.checkouts), *result.classes, sep="\t", flush=True)
    print(table(results, tuple(arguments.vendor)))
    print("\n" + ", ".join(f"{name} at `{commit}`" for name, commit in sorted(commits.items())))
    refused = [result for result in results if result.message]
    for result in random.Random(arguments.seed).sample(refused, min(arguments.draw, len(refused))):
        print(f"\n[{', '.join(result.classes)}]\n{result.message}")
    return 1 if any(FAULT in result.classes for result in results) else 0


if __name__ == "__main__":
    sys.exit(main())
