# SPDX-License-Identifier: MIT
"""The model file: what is right is read, what is wrong is named."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from canopy.model import TRACE_MESSAGES, ModelError, load_model
from integration.trace_source import model_data, write_model


def test_the_compilers_models_are_read(build_dir: Path) -> None:
    for application, nodes in (("nao_home", 4), ("nao_power", 3)):
        path = build_dir / "examples" / "nao" / "generated" / application / f"{application}.model.json"
        model = load_model(path)
        assert model.application == application
        assert len(model.nodes) == nodes
        assert [model.depth(node.index) for node in model.nodes] == [0] + [1] * (nodes - 1)
        assert set(model.trace) == set(TRACE_MESSAGES)


def change(*place: str | int, to: Any) -> Callable[[Any], None]:
    def apply(data: Any) -> None:
        for key in place[:-1]:
            data = data[key]
        data[place[-1]] = to

    return apply


def remove(*place: str | int) -> Callable[[Any], None]:
    def apply(data: Any) -> None:
        for key in place[:-1]:
            data = data[key]
        del data[place[-1]]

    return apply


@pytest.mark.parametrize(
    ("edit", "text"),
    [
        (change("format", to=2), "format: is 2, these tools read 1: build the application again"),
        (remove("hash"), "hash: is missing"),
        (change("hash", to="0123456789ABCDEF"), "hash: is '0123456789ABCDEF', must be 16 hexadecimal digits"),
        (change("application", to=7), "application: is 7, must be of type str"),
        (change("period_us", to=True), "period_us: is True, must be of type int"),
        (change("period_us", to=0), "period_us: is 0, must be 1 to 3600000000"),
        (change("tree", to=[]), "tree: is [], must be of type dict"),
        (change("tree", "nodes", to=[]), "tree.nodes: is empty"),
        (change("tree", "nodes", 1, to=3), "tree.nodes[1]: must be a JSON object"),
        (remove("tree", "nodes", 2, "name"), "tree.nodes[2].name: is missing"),
        (
            change("tree", "nodes", 2, "category", to="leaf"),
            "tree.nodes[2].category: is 'leaf', must be one of control",
        ),
        (change("tree", "nodes", 2, "parent", to=1), "tree.nodes[2]: is not in depth-first order"),
        (change("tree", "nodes", 2, "index", to=3), "tree.nodes[2]: is not in depth-first order"),
        (change("tree", "nodes", 0, "end", to=3), "tree.nodes[3]: is not in depth-first order"),
        (change("tree", "nodes", 2, "end", to=9), "tree.nodes[2].end: is 9, must be 3…4"),
        (change("bus", "send", 1, to=None), "bus.send[1]: is None, must be a text"),
        (remove("trace", "CanopyTick"), "trace: has no CanopyTick"),
        (change("trace", "CanopyChange", to=0x600), "trace: gives two messages the same id"),
        (change("bus", "dbc", to="other.dbc"), "other.dbc is not there"),
    ],
)
def test_a_wrong_place_is_named(tmp_path: Path, edit: Callable[[Any], None], text: str) -> None:
    path = write_model(tmp_path)
    data = model_data(4)
    edit(data)
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        load_model(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert text in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"{", b"[1]", b"null", b"[" * 100_000])
def test_what_is_no_model_is_an_error(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.model.json"
    path.write_bytes(content)
    with pytest.raises(ModelError, match=str(path)):
        load_model(path)


def test_a_missing_file_says_who_writes_it(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="the build writes it"):
        load_model(tmp_path / "nothing.model.json")
