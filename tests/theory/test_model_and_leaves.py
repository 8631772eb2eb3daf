# SPDX-License-Identifier: MIT
"""What is proven and what runs is one thing: compiled leaves return and write what their model says, at every border.

And a mistake is found: in 100 seeded mutations of leaf, model and tree, by this tie or by `canopy verify`.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from canopy.compiler.errors import CompileError
from canopy.verify.run import load, verify
from theory.leaves import APPLICATIONS, NAO, Application, Build, differences

MUTANTS = 100


@pytest.fixture(scope="module")
def builds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Build]:
    folder = tmp_path_factory.mktemp("tie")
    return {name: Build(application, folder / name) for name, application in APPLICATIONS.items()}


@pytest.mark.parametrize("name", APPLICATIONS)
def test_the_compiled_leaves_do_what_the_model_says(builds: dict[str, Build], name: str) -> None:
    build = builds[name]
    found, compared = differences(build.subject, build.leaves(build.application.leaves))
    assert found == []
    assert compared > 10_000


def mutated_leaves(text: str, chance: random.Random) -> str:
    """A constant of the C moved by one step of its sensor, a comparison changed, or a mode or status exchanged."""
    kind = chance.choice(("threshold", "comparison", "mode", "status"))
    if kind == "threshold":
        found = chance.choice(list(re.finditer(r"(#define \w+ \w+\()([\d.]+)(\))", text)))
        step = 0.1 if "LEVEL" in found[1] else 0.001
        value = round(float(found[2]) + chance.choice((-1, 1)) * step, 3)
        return text[: found.start()] + f"{found[1]}{value}{found[3]}" + text[found.end() :]
    if kind == "comparison":
        found = chance.choice(list(re.finditer(r"(?<=in->)(\w+\.\w+ )(<=|>=|<|>)(?= )", text)))
        other = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}[found[2]]
        return text[: found.start()] + found[1] + other + text[found.end() :]
    pattern = r"_MODE_(?!STOP)\w+" if kind == "mode" else r"return CANOPY_(SUCCESS|FAILURE|RUNNING)"
    found = chance.choice(list(re.finditer(pattern, text)))
    words = sorted({one[0] for one in re.finditer(pattern, text)} - {found[0]})
    if kind == "mode":
        words.append("_MODE_STOP")
    return text[: found.start()] + chance.choice(words) + text[found.end() :]


def mutated_model(text: str, chance: random.Random) -> str:
    """A threshold moved by one step of its sensor, or two regions of a leaf exchanged."""
    head, claims = text.split("[[claims]]", 1)
    if chance.random() < 0.7:
        lines = list(re.finditer(r'^(?:success|failure|when) = "(?!else)[^"]*"', head, re.MULTILINE))
        numbers = [one for line in lines for one in re.finditer(r"(x[12] (?:<=|>=|<|>) )([\d.]+)", line[0])]
        places = [
            (line.start() + one.start(2), line.start() + one.end(2), one)
            for line in lines
            for one in re.finditer(r"(x[12] (?:<=|>=|<|>) )([\d.]+)", line[0])
        ]
        assert len(places) == len(numbers)
        start, end, one = chance.choice(places)
        step = 0.1 if "Battery" in head and one[1].startswith("x2") else 0.001
        value = round(float(one[2]) + chance.choice((-1, 1)) * step, 3)
        head = head[:start] + str(max(value, 0)) + head[end:]
    else:
        leaf = chance.choice(
            list(re.finditer(r'success = ("[^"]*")\n(?:failure = ("[^"]*")\n)?running = "else"', head))
        )
        swapped = leaf[0].replace("success", "x").replace("running", "success").replace("x =", "running =")
        head = head[: leaf.start()] + swapped + head[leaf.end() :]
    return f"{head}[[claims]]{claims}"


def mutated_tree(text: str, chance: random.Random) -> str:
    """Two children exchanged, the control node changed, or a leaf taken out."""
    body = re.search(r"(<Reactive\w+ name=.*?>\n)(.*?)(\n    </Reactive\w+>)", text, re.DOTALL)
    assert body is not None
    children = body[2].split("\n")
    kind = chance.choice(("swap", "node", "drop"))
    if kind == "swap":
        first, second = chance.sample(range(len(children)), 2)
        children[first], children[second] = children[second], children[first]
    elif kind == "drop":
        del children[chance.randrange(len(children))]
    text = text[: body.start(2)] + "\n".join(children) + text[body.end(2) :]
    if kind == "node":
        names = {"ReactiveSequence": "ReactiveFallback", "ReactiveFallback": "ReactiveSequence"}
        text = re.sub(r"Reactive(?:Sequence|Fallback)", lambda found: names[found[0]], text)
    return text


def mutants(application: Application, folder: Path, count: int, seed: int) -> Iterator[tuple[str, Path, Path, Path]]:
    """(Kind, tree, model, leaves), each with one mistake."""
    chance = random.Random(seed)
    files = {"leaf": application.leaves, "model": application.model, "tree": application.tree}
    change = {"leaf": mutated_leaves, "model": mutated_model, "tree": mutated_tree}
    for number in range(count):
        kind = ("leaf", "model", "tree")[number % 3]
        original = files[kind].read_text()
        text = original
        while text == original:
            text = change[kind](original, chance)
        place = folder / f"{number}-{files[kind].name}"
        place.write_text(text)
        changed = {**files, kind: place}
        yield kind, changed["tree"], changed["model"], changed["leaf"]


def found_by(build: Build, kind: str, tree: Path, model: Path, leaves: Path, name: str) -> str:
    """Who finds the mistake: reading, the tie, or a claim; nobody: an empty text."""
    try:
        subject = load(tree, model, NAO / "nao.dbc", "Controller")
    except CompileError as error:
        return f"reader: {error.message}"
    if kind != "tree":
        wrong, _ = differences(subject, build.leaves(leaves, name), first=True, sweep=20)
        return f"tie: {wrong[0]}" if wrong else ""
    for claim in subject.plant.claims:
        try:
            result = verify(subject, claim, 20)
        except CompileError as error:
            return f"reader: {error.message}"
        if not result.expected:
            return f"claim: {claim.name}"
    return ""


@pytest.mark.timeout(300)
def test_each_of_100_mistakes_is_found(builds: dict[str, Build], tmp_path: Path) -> None:
    missed, by = [], dict.fromkeys(("reader", "tie", "claim"), 0)
    for name, build in builds.items():
        folder = tmp_path / name
        folder.mkdir()
        made = mutants(build.application, folder, MUTANTS // 2, seed=2018)
        for number, (kind, tree, model, leaves) in enumerate(made):
            found = found_by(build, kind, tree, model, leaves, f"mutant{number}")
            if found:
                by[found.split(":")[0]] += 1
            else:
                missed.append((kind, tree, model, leaves))
    assert missed == []
    assert sum(by.values()) == MUTANTS
    assert by["tie"] > 20
    assert by["claim"] > 10
