# SPDX-License-Identifier: MIT
"""Certificates: accepted where they show a claim, rejected after any change, by a checker that is small and apart."""

from __future__ import annotations

import ast
import copy
import hashlib
import json
import random
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from canopy.certificate.check import check, decoded, encoded
from canopy.certificate.formula import RejectedError
from canopy.certificate.obligations import Claim as Asked
from canopy.certificate.system import Files
from canopy.cli import main
from canopy.verify.certify import certificate
from canopy.verify.question import ask
from canopy.verify.run import load, model_path

ROOT = Path(__file__).parents[2]
CHECKER = ROOT / "host_tools/canopy/certificate"
HOME = ROOT / "examples/nao/trees/get_home.xml"
POWER = ROOT / "examples/nao/trees/power_supply.xml"
ALTITUDE = ROOT / "examples/papers/trees/fig16.xml"
# One of each kind of evidence: a ranking, an invariant, a backward set.
CLAIMS = [
    (HOME, "Lemma 11, as tight as it is true", "within 19 steps"),
    (POWER, "The battery is never empty", "never"),
    (POWER, "Lemma 10: whatever the other task is, if its steps are shorter than 5", "never"),
    (POWER, "The guard alone has done its work within 196 steps", "within 196 steps"),
    (ALTITUDE, "A mission with steps of up to 1000 ft is the most", "never"),
    (ALTITUDE, "In spite of gusts the guard has climbed above 1000 ft within 11 steps", "within 10 steps"),
]
CHANGES = 1_000
FORGERIES = 300


def made(tree: Path, name: str, model: Path | None = None) -> bytes:
    model = model or model_path(tree)
    claim = next(one for one in load(tree, model).plant.claims if one.name == name)
    return certificate(claim, tree, model)


@pytest.fixture(scope="module")
def certificates() -> dict[str, tuple[Path, bytes]]:
    return {name: (tree, made(tree, name)) for tree, name, _ in CLAIMS}


@pytest.mark.parametrize(("tree", "name", "shows"), CLAIMS, ids=[name for _, name, _ in CLAIMS])
def test_a_certificate_shows_its_claim(
    certificates: dict[str, tuple[Path, bytes]], tree: Path, name: str, shows: str
) -> None:
    assert check(certificates[name][1], tree, model_path(tree)) == shows


@pytest.mark.timeout(300)
def test_the_exact_bound_of_the_battery_has_a_certificate_too() -> None:
    """Evidence of the third kind, with hundreds of regions."""
    name = "It never has less than 5 %, as tight as it is true"
    assert check(made(POWER, name), POWER, model_path(POWER)) == "never"


def test_one_changed_bit_is_rejected_1000_of_1000(certificates: dict[str, tuple[Path, bytes]]) -> None:
    chance = random.Random(1)
    rejected = 0
    for number in range(CHANGES):
        tree, text = certificates[CLAIMS[number % len(CLAIMS)][1]]
        changed = bytearray(text)
        changed[chance.randrange(len(changed))] ^= 1 << chance.randrange(8)
        with pytest.raises(RejectedError):
            check(bytes(changed), tree, model_path(tree))
        rejected += 1
    assert rejected == CHANGES


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where a certificate has numbers."""
    if isinstance(value, list):
        for index, one in enumerate(value):
            yield from places(one, (*path, index))
    elif isinstance(value, (str, int)):
        yield path


def forged(content: dict[str, Any], chance: random.Random) -> dict[str, Any]:
    """One number changed a little, or a proof left out; the digest is made new."""
    content = copy.deepcopy(content)
    key = chance.choice([key for key in ("invariant", "ranking", "proofs", "backward") if content[key]])
    *path, last = chance.choice(list(places(content[key])))
    holder = content[key]
    for index in path:
        holder = holder[index]
    old = holder[last]
    if isinstance(old, bool):
        holder[last] = not old
    elif isinstance(old, int):
        holder[last] = old + chance.choice((-1, 1))
    elif old in ("", "low", "high"):
        holder[last] = chance.choice([word for word in ("", "low", "high") if word != old])
    else:
        holder[last] = str(Fraction(old) + Fraction(chance.choice((-1, 1)), chance.choice((1, 10, 1000))))
    return content


def test_a_forger_who_renews_the_digest_shows_nothing_else(certificates: dict[str, tuple[Path, bytes]]) -> None:
    """What is still accepted shows the same: an invariant may be a little wider, and its proofs still add up."""
    chance = random.Random(2)
    accepted = 0
    for number in range(FORGERIES):
        tree, name, shows = CLAIMS[number % len(CLAIMS)]
        text = encoded(forged(decoded(certificates[name][1]), chance))
        try:
            assert check(text, tree, model_path(tree)) == shows
            accepted += 1
        except RejectedError:
            continue
    assert accepted < FORGERIES // 10


def test_a_smaller_bound_is_rejected(certificates: dict[str, tuple[Path, bytes]]) -> None:
    name = "Lemma 11, as tight as it is true"
    content = decoded(certificates[name][1])
    content["bound"] = 18
    with pytest.raises(RejectedError, match="shows 19 steps"):
        check(encoded(content), HOME, model_path(HOME))
    content = decoded(certificates[name][1])
    content["ranking"][2][4] = "-2/5"  # from 0.4 m instead of 0.5 m: four steps
    content["bound"] = 18
    with pytest.raises(RejectedError, match="does not add up"):
        check(encoded(content), HOME, model_path(HOME))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"Do Other Task" = 5 }', '"Do Other Task" = 11 }'),
        ('x2 >= 0.1"\nnext = { x1 = "x1 - 1", x2 = "x2 - 0.1"', 'x2 >= 0.1"\nnext = { x1 = "x1 - 1", x2 = "x2 - 0.2"'),
        ("0.1 and x2 > 20)", "0.1 and x2 > 2)"),
        ("range = [-0.9, 100]", "range = [-0.9, 200]"),
        ("x1 >= 0 and x2 >= 15 and x2 <= 100", "x1 >= 0 and x2 >= 5 and x2 <= 100"),
    ],
)
def test_a_certificate_does_not_fit_another_model(
    certificates: dict[str, tuple[Path, bytes]], tmp_path: Path, old: str, new: str
) -> None:
    """Also when its digest of the model is renewed: the sums do not add up any more."""
    name = "Lemma 10: whatever the other task is, if its steps are shorter than 5"
    text = model_path(POWER).read_text()
    assert old in text
    model = tmp_path / "other.toml"
    model.write_text(text.replace(old, new))
    content = decoded(certificates[name][1])
    with pytest.raises(RejectedError, match="not the one of the certificate"):
        check(encoded(content), POWER, model)
    content["model"] = hashlib.sha256(model.read_bytes()).hexdigest()
    with pytest.raises(RejectedError):
        check(encoded(content), POWER, model)


def test_what_is_false_gets_no_certificate() -> None:
    for tree, name in ((HOME, "18 steps are not enough"), (POWER, "5 % can happen")):
        with pytest.raises(RejectedError):
            made(tree, name)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('<BehaviorTree ID="GetHome">', '<include path="other.xml"/><BehaviorTree ID="GetHome">'),
        (' main_tree_to_execute="GetHome"', ""),
        ("<WalkHome name", '<WalkHome _skipIf="true" name'),
        ("ReactiveFallback", "Fallback"),
        ("<LieDownToSitUp name", "<SubTree ID"),
    ],
)
def test_a_tree_that_the_checker_does_not_know_is_rejected(tmp_path: Path, old: str, new: str) -> None:
    tree = tmp_path / "tree.xml"
    text = HOME.read_text().replace(old, new)
    other = '<BehaviorTree ID="Other"><WalkHome/></BehaviorTree><TreeNodesModel>'
    tree.write_text(text.replace("<TreeNodesModel>", other) if "main" in old else text)
    with pytest.raises(RejectedError):
        Asked(Files(tree, model_path(HOME)), 1)


def test_certificates_are_about_the_main_tree(tmp_path: Path) -> None:
    arguments = ["verify", str(HOME), "--main-tree", "GetHome", "--certificate", str(tmp_path)]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2
    assert "leave --main-tree out" in result.output


def test_the_checker_is_small_and_apart() -> None:
    lines = 0
    for file in CHECKER.glob("*.py"):
        text = file.read_text()
        lines += len(text.splitlines())
        for node in ast.walk(ast.parse(text)):
            names = [one.name for one in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                assert name.split(".")[0] not in ("z3", "cvc5", "cantools")
                assert not name.startswith("canopy.") or name.startswith("canopy.certificate"), (file.name, name)
    assert lines < 1_000


@pytest.mark.parametrize(
    "tree", [HOME, POWER, ALTITUDE, ROOT / "examples/papers/trees/fig34.xml"], ids=lambda one: one.stem
)
def test_checker_and_verify_read_the_same_system(tree: Path) -> None:
    """Two readers of one model: in each of many states the same status, and the same next states."""
    chance = random.Random(3)
    subject, files = load(tree, model_path(tree)), Files(tree, model_path(tree))
    for claim in subject.plant.claims:
        if claim.kind not in ("reaches", "avoids"):
            continue
        ours, theirs = ask(claim, subject.plant, subject.reader, subject.tree, 1), Asked(files, claim.index)
        for _ in range(60):
            state = tuple(
                one.low + (one.high - one.low) * Fraction(chance.randint(0, 40), 40) for one in subject.plant.variables
            )
            one = {
                (piece.status, tuple(m.at(state) for m in piece.step.maps), piece.step.noise, piece.step.shorter)
                for piece in (ours.system.pieces[index] for index in ours.system.at(state))
            }
            other = set()
            for plain in theirs.pieces:
                values = (
                    sum((c * x for c, x in zip(row.coefficients, state, strict=True)), Fraction(0))
                    for row in plain.rows
                )
                if all(v < r.bound or (v == r.bound and not r.strict) for v, r in zip(values, plain.rows, strict=True)):
                    after = tuple(
                        sum((c * x for c, x in zip(s.coefficients, state, strict=True)), s.constant)
                        for s in plain.step.sums
                    )
                    other.add((plain.status, after, plain.step.noise, plain.step.shorter))
            assert one == other, (claim.name, state)


def test_the_command_writes_and_checks_certificates(tmp_path: Path) -> None:
    folder = tmp_path / "proofs"
    result = CliRunner().invoke(main, ["verify", str(HOME), "--certificate", str(folder)])
    assert result.exit_code == 0, result.output
    result = CliRunner().invoke(main, ["verify", str(HOME), "--check", str(folder)])
    assert result.exit_code == 0, result.output
    assert "accepted claim-02.certificate: Lemma 11, as tight as it is true: within 19 steps" in result.output
    file = folder / "claim-02.certificate"
    text = bytearray(file.read_bytes())
    text[100] ^= 1
    file.write_bytes(bytes(text))
    result = CliRunner().invoke(main, ["verify", str(HOME), "--check", str(folder)])
    assert result.exit_code == 1
    assert "rejected claim-02.certificate: the certificate is damaged" in result.output
    result = CliRunner().invoke(main, ["verify", str(HOME), "--check", str(tmp_path)])
    assert result.exit_code == 2
    assert json.loads('"no certificates"') in result.output
