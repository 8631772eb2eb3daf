# SPDX-License-Identifier: MIT
"""BehaviorTree.CPP's own test cases, in our words: each tree is compiled to C, and ticked by the real engine.

`cases.py` has the table. A case that differs names the row of docs/semantics.md that says so.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from click.testing import CliRunner

from btcpp_cases.cases import CASES as FIRST
from btcpp_cases.cases import REFUSED as FIRST_REFUSED
from btcpp_cases.cases import Case
from btcpp_cases.more_cases import MORE, MORE_REFUSED
from canopy.cli import main
from canopy.compiler.emit import load_application, render
from canopy.compiler.leaf_c import prototypes
from canopy.compiler.names import snake
from canopy.compiler.port_types import Options

ROOT = Path(__file__).parents[2]
DBC = ROOT / "tests" / "corpus" / "bus.dbc"
CASES = (*FIRST, *MORE)
REFUSED = FIRST_REFUSED | MORE_REFUSED
LETTERS = {"R": 1, "S": 2, "F": 3, "K": 4}
START, GO_ON, HALTED, TICK = range(4)
CALLBACK = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p)

MODEL = (
    "".join(f'<Action ID="{name}"/>' for name in "ABCDEF")
    + "".join(f'<Condition ID="{name}"/>' for name in "PQ")
    + "".join(
        f'<Action ID="{name}"><MetadataFields><Metadata kind="SyncAction"/></MetadataFields></Action>' for name in "TU"
    )
    + "".join(
        f'<Action ID="{name}"><{tag} name="{port}" type="{kind}"/>'
        '<MetadataFields><Metadata kind="SyncAction"/></MetadataFields></Action>'
        for name, tag, port, kind in (
            ("Num", "input_port", "v", "int"),
            ("Real", "input_port", "v", "double"),
            ("Say", "input_port", "text", "std::string"),
            ("Out", "output_port", "o", "int"),
            ("Put", "output_port", "o", "bool"),
            ("Byte", "input_port", "v", "uint8_t"),
            ("Any", "input_port", "x", ""),
            ("Paint", "input_port", "c", "Color"),
            ("Fill", "output_port", "o", "std::vector&lt;int&gt;"),
        )
    )
    + '<Action ID="WithDefault"><input_port name="v" type="int" default="42"/>'
    '<MetadataFields><Metadata kind="SyncAction"/></MetadataFields></Action>'
    '<Action ID="Twice"><input_port name="i" type="int"/><output_port name="o" type="int"/>'
    '<MetadataFields><Metadata kind="SyncAction"/></MetadataFields></Action>'
    '<Enum ID="Color"><value name="Red"/><value name="Blue"/><value name="Green"/></Enum>'
)
WRITES = {
    "Out": "out_set_o(ports, 42);",
    "Put": "put_set_o(ports, true);",
    "Twice": "twice_set_o(ports, 2 * ports->i);",
    "Fill": "fill_set_o(ports, &(canopy_queue_int32_16_t){.count = 2, .items = {10, 20}});",
}
TELLS = {
    "Num": '(void)snprintf(told, sizeof told, "Num(%d)", (int)ports->v);',
    "WithDefault": '(void)snprintf(told, sizeof told, "WithDefault(%d)", (int)ports->v);',
    "Paint": '(void)snprintf(told, sizeof told, "Paint(%d)", (int)ports->c);',
    "Real": '(void)snprintf(told, sizeof told, "Real(%g)", ports->v);',
    "Say": '(void)snprintf(told, sizeof told, "Say(%s)", ports->text);',
}


def _renamed(case: Case, number: int) -> tuple[str, str]:
    """Nodes and trees of a case, with names of trees that no other case has."""
    nodes, trees = case.nodes, case.trees
    for name in re.findall(r'<BehaviorTree ID="(\w+)"', trees):
        nodes = nodes.replace(f'<SubTree ID="{name}"', f'<SubTree ID="{name}_{number}"')
        trees = re.sub(rf'<(BehaviorTree|SubTree) ID="{name}"', rf'<\1 ID="{name}_{number}"', trees)
    return nodes, trees


def document(cases: tuple[Case, ...]) -> str:
    """One tree with all cases below a node that ticks the chosen one; a case's inputs are ports of the main tree."""
    calls, trees, ports = [], [], []
    for number, case in enumerate(cases):
        nodes, more = _renamed(case, number)
        given = ""
        for name, _, kind in (word.partition(":") for word in case.inputs.split()):
            outer = name if f"@{name}" in nodes else f"c{number}_{name}"
            ports.append(f'<input_port name="{outer}" type="{kind}"/>')
            given += f' {name}="{{{outer}}}"' if outer != name else ""
        calls.append(f'<SubTree ID="c{number}"{given}/>')
        trees.append(f'<BehaviorTree ID="c{number}">{nodes}</BehaviorTree>{more}')
    root = f'<BehaviorTree ID="M"><Choose>{"".join(calls)}</Choose></BehaviorTree>'
    model = f'{MODEL}<Control ID="Choose"/><SubTree ID="M">{"".join(ports)}</SubTree>'
    trees_text = "".join(trees)
    return f'<root BTCPP_format="4" main_tree_to_execute="M">{root}{trees_text}<TreeNodesModel>{model}</TreeNodesModel></root>'


@dataclass
class Tick:
    """One tick of a case, read from its text."""

    now_ms: int | None = None
    halts: bool = False
    answers: dict[str, int] = field(default_factory=dict)
    before: dict[str, float] = field(default_factory=dict)
    status: int = 0
    calls: list[str] | None = None
    after: dict[str, float] = field(default_factory=dict)


def read_tick(text: str) -> Tick:
    """`ANSWERS -> STATUS : CALLS | ENTRIES`."""
    tick = Tick()
    left, _, right = text.partition("->") if "->" in text else (text.partition(":")[0], "", text)
    tick.halts = left.strip() == "HALT"
    for word in left.split() if not tick.halts else ():
        if ":=" in word:
            name, _, value = word.partition(":=")
            tick.before[name.removeprefix("@")] = float(value)
        elif word.startswith("@"):
            tick.now_ms = int(word[1:])
        else:
            name, _, letter = word.partition("=")
            tick.answers[name] = LETTERS[letter]
    right, _, entries = right.partition("|")
    status, colon, calls = right.partition(":")
    tick.status = 0 if tick.halts else LETTERS[status.strip()]
    tick.calls = calls.split() if colon else None
    tick.after = {name: float(value) for name, _, value in (word.partition("=") for word in entries.split())}
    return tick


def leaf_functions(leaves: list[tuple[str, list[str]]]) -> str:
    """C of the leaves: each asks Python, and tells what it was given."""
    parts = []
    for leaf_id, heads in leaves:
        for head in heads if leaf_id != "Choose" else ():
            what = HALTED if "_on_halted(" in head else GO_ON if "_on_running(" in head else START
            names = re.findall(r"(\w+)(?=[,)])", head[head.index("(") :])
            used = "".join(f"(void){argument};" for argument in names)
            tells = TELLS.get(leaf_id, f'(void)snprintf(told, sizeof told, "{leaf_id}");')
            call = f'ask("{leaf_id}", {what}, told)'
            end = f"(void){call};" if what == HALTED else f"return (canopy_status_t){call};"
            parts.append(f"{head}\n{{ char told[80]; {used} {tells} {WRITES.get(leaf_id, '')} {end} }}\n")
    return "".join(parts)


DRIVER = """
#include <stdio.h>
#include <string.h>
#include "canopy/loop.h"
#include "cases_app.h"
#include "cases_leaves.h"
static int (*callback)(const char *, int, const char *);
static int chosen;
static int ask(const char *leaf, int what, const char *told) { return callback(leaf, what, told); }
canopy_step_t choose_enter(canopy_tree_instance_t *tree, uint16_t node, const cases_input_t *in)
{
    uint16_t child = node + 1u;

    (void)in;
    for (int number = 0; number < chosen; number++) { child = tree->tree->nodes[child].end; }
    return child;
}
canopy_step_t choose_child(canopy_tree_instance_t *tree, uint16_t node, uint16_t child, canopy_status_t status,
                           const cases_input_t *in)
{
    (void)node; (void)in;
    if (status != CANOPY_RUNNING) { canopy_reset_child(tree, child); }
    return canopy_done(status);
}
void choose_halt(canopy_tree_instance_t *tree, uint16_t node, const cases_input_t *in)
{
    (void)tree; (void)node; (void)in;
}
void begin(int number, int (*function)(const char *, int, const char *));
void begin(int number, int (*function)(const char *, int, const char *))
{
    const canopy_app_t *app = &cases_app;

    callback = function; chosen = number;
    canopy_tree_init(app->tree_instance, app->tree, app->status, app->words, app->memory);
    app->start(app->memory);
}
int tick(uint64_t now_us);
int tick(uint64_t now_us) { return (int)canopy_tree_tick(cases_app.tree_instance, now_us); }
void halt(void);
void halt(void) { canopy_tree_halt(cases_app.tree_instance); }
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """All cases in one program."""
    folder = tmp_path_factory.mktemp("cases")
    (folder / "cases.xml").write_text(document(CASES), encoding="utf-8")
    options = Options(floats=True)
    application = load_application("cases", folder / "cases.xml", DBC, "Controller", 50, 500_000, options=options)
    for written, content in render(application).items():
        (folder / written).write_bytes(content)
    leaves = [(use.leaf.id, prototypes(use.leaf, application.bus)) for use in application.table.users]
    numbers = [entry.c_name for entry in application.table.bindings.entries if entry.type.is_number]
    access = "".join(
        f'if (strcmp(name, "{name}") == 0) {{ if (write) {{ cases_entries->{name} = value; }} '
        f"return cases_entries->{name}; }}\n"
        for name in numbers
    )
    entry = "double entry(const char *name, int write, double value)"
    body = f"{entry};\n{entry}\n{{\n{access}return -1;\n}}\n"
    (folder / "driver.c").write_text(DRIVER + leaf_functions(leaves) + body)
    runtime = ROOT / "runtime"
    sources = [*folder.glob("*.c"), *(runtime / "src" / name for name in ("tree.c", "tree_validate.c"))]
    include = ["-I", str(runtime / "include"), "-I", str(folder)]
    command = ["gcc", "-std=c11", "-O0", "-Wno-conversion", "-fPIC", "-shared", *include, *map(str, sources)]
    subprocess.run([*command, "-o", str(folder / "cases.so")], check=True)
    loaded = ctypes.CDLL(str(folder / "cases.so"))
    loaded.entry.restype = ctypes.c_double
    return loaded


@pytest.mark.parametrize("number", range(len(CASES)), ids=[case.theirs for case in CASES])
def test_the_tree_ticks_as_theirs_does(library: ctypes.CDLL, number: int) -> None:
    case = CASES[number]

    def entry(name: str, value: float | None = None) -> float:
        c_name = (name if f"@{name}" in case.nodes else f"c{number}_{snake(name)}").encode()
        return float(library.entry(c_name, value is not None, ctypes.c_double(value or 0)))

    calls: list[str] = []
    answers: dict[str, int] = {}

    def answer(leaf: bytes, what: int, told: bytes) -> int:
        calls.append(("~" if what == HALTED else "") + told.decode().replace(" ", "_"))
        return answers.get(leaf.decode(), LETTERS["S"])

    callback = CALLBACK(answer)
    library.begin(number, callback)
    now_ms = 0
    for text in case.ticks:
        tick = read_tick(text)
        now_ms = tick.now_ms if tick.now_ms is not None else now_ms + 10
        answers, calls[:] = tick.answers, []
        for name, value in tick.before.items():
            assert entry(name, value) == value, f"{text}: no entry {name}"
        if tick.halts:
            library.halt()
        else:
            assert library.tick(ctypes.c_uint64(now_ms * 1000)) == tick.status, (text, calls)
        if tick.calls is not None:
            assert calls == tick.calls, text
        for name, value in tick.after.items():
            assert entry(name) == value, text


@pytest.mark.parametrize("name", REFUSED)
def test_what_they_throw_at_is_refused(tmp_path: Path, name: str) -> None:
    nodes, message = REFUSED[name]
    trees = '<BehaviorTree ID="mySubtree"><Say text="{param}"/></BehaviorTree>'
    (tmp_path / "m.xml").write_text(document((Case(name, nodes, (), trees),)), encoding="utf-8")
    arguments = ["compile", str(tmp_path / "m.xml"), "--dbc", str(DBC), "--node", "Controller", "--period-ms", "50"]
    result = CliRunner().invoke(main, [*arguments, "--allow-floating-point", "-o", str(tmp_path / "out")])
    assert result.exit_code == 2, result.output
    assert message in result.stderr


def test_what_differs_is_in_the_documentation() -> None:
    table = (ROOT / "docs" / "semantics.md").read_text(encoding="utf-8")
    for case in CASES:
        assert not case.differs or f"| {case.differs} |" in table, case.theirs
