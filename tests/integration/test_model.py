# SPDX-License-Identifier: MIT
"""The model file: what is right is read, what is wrong is named."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from canopy.model import ModelError, load_model
from integration.trace_source import IDS, SLOTS, TEXTS, VALUES, model_data, write_model


def test_the_compilers_models_are_read(build_dir: Path) -> None:
    for application, nodes in (("nao_home", 4), ("nao_power", 3)):
        path = build_dir / "examples" / "nao" / "generated" / application / f"{application}.model.json"
        model = load_model(path)
        assert model.application == application
        assert len(model.nodes) == nodes
        assert [model.depth(node.index) for node in model.nodes] == [0] + [1] * (nodes - 1)
        assert (model.trace.base, model.trace.extended, model.trace.guard) == (0x600, False, None)
        assert list(model.trace.ids.items()) == list(IDS.items())


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
        (change("format", to=1), "format: is 1, these tools read 2: build the application again; a log that an older"),
        (change("format", to=3), "format: is 3, these tools read 2: use the release of Canopy that"),
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
        (change("trace", to=None), "trace: is null: the application was built without a trace"),
        (change("trace", to=None), "build it with TRACE 0x600 (canopy_add_application) or --trace 0x600"),
        (change("trace", to={"CanopyTick": 1536}), "trace.version: is missing"),
        (change("trace", "version", to=3), "trace.version: is 3, these tools read 2: use the release of Canopy that"),
        (change("trace", "base", to=0x7F9), "trace.base: is 2041, must be 0 to 2040"),
        (change("trace", "base", to=-1), "trace.base: is -1, must be 0 to 2040"),
        (change("trace", "extended", to=1), "trace.extended: is 1, must be of type bool"),
        (change("trace", "guard", to=65536), "trace.guard: is 65536, must be 0 to 65535"),
        (change("trace", "changes_max", to=0), "trace.changes_max: is 0, must be 1 to 32"),
        (remove("trace", "known_within_ms"), "trace.known_within_ms: is missing"),
        (change("trace", "texts", 1, to=1), "trace.texts[1]: is 1, must be a text"),
        (change("trace", "values", 1, to=1), "trace.values[1]: must be a JSON object"),
        (change("trace", "values", 1, "slot", to=2), "trace.values[1].slot: is 2, must be 1"),
        (change("trace", "values", 1, "slots", to=1), "trace.values[1].slots: is 1, must be 2 for uint64_t"),
        (change("trace", "values", 0, "type", to="pose_t"), "trace.values[0].type: is 'pose_t', must be one of bool"),
        (change("trace", "values", 0, "kind", to="port"), "trace.values[0].kind: is 'port', must be entry or reason"),
        (change("trace", "values", 3, "node", to=4), "trace.values[3].node: is 4, must be 0 to 3"),
        (change("trace", "values", 3, "enum", to={"a": "b"}), "trace.values[3].enum.a: is 'b', must be of type int"),
        (change("trace", "values", 2, "scale", to="1/0"), "trace.values[2].scale: is '1/0', must be a number such as"),
        (change("trace", "values", 2, "scale", to="0.0"), "trace.values[2].scale: is '0.0', must be a number such as"),
        (change("trace", "values", 2, "scale", to="1e9"), "trace.values[2].scale: is '1e9', must be a number such as"),
        (change("bus", "dbc", to="other.dbc"), "other.dbc is not there"),
    ],
)
def test_a_wrong_place_is_named(tmp_path: Path, edit: Callable[[Any], None], text: str) -> None:
    path = write_model(tmp_path)
    data = model_data(4)
    data["trace"] |= {"values": copy.deepcopy(VALUES), "texts": list(TEXTS)}
    edit(data)
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        load_model(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert text in str(caught.value)


def test_29_bit_ids_and_values_are_read(tmp_path: Path) -> None:
    model = load_model(write_model(tmp_path, base=0x18FF0000, extended=True, guard=7, values=VALUES, texts=TEXTS))
    assert (model.trace.ids["CanopyModel"], model.trace.guard, model.trace.slots) == (0x18FF0007, 7, SLOTS)
    assert [value.title for value in model.trace.values][:3] == ["count", "arm/far", "warm"]
    assert model.trace.values[3].words == {1: "dark", 0: ""}


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"{", b"[1]", b"null", b"[" * 100_000])
def test_what_is_no_model_is_an_error(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.model.json"
    path.write_bytes(content)
    with pytest.raises(ModelError, match=str(path)):
        load_model(path)


def test_a_missing_file_says_who_writes_it(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="the build writes it"):
        load_model(tmp_path / "nothing.model.json")
