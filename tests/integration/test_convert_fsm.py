# SPDX-License-Identifier: MIT
"""`canopy convert fsm` and `to-fsm`: state machines into trees and back, in the model, the engine and compiled C."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from canopy.cli import main
from canopy.compiler.errors import CompileError
from canopy.compiler.tree import Script
from canopy.compiler.tree_reader import read_tree
from canopy.convert import fsm_files, to_fsm
from canopy.convert.chart_machine import ChartMachine
from canopy.convert.equivalence import Answers, AnythingGoes, compare
from canopy.convert.fsm_c import CompiledMachine, write_c
from canopy.convert.machine import AskingWorld, RunnableTree, TreeMachine, ask_each, show_calls
from canopy.convert.read_back import runnable
from canopy.convert.scripts import entry_names, program
from canopy.convert.scxml import read_scxml
from canopy.semantics.spec import CONTINUE, HALTED, START, Spec
from integration.engine import Engine, build
from integration.test_convert import bad, cases, convert, good, written

REPOSITORY = Path(__file__).parents[2]
PAPERS = sorted((REPOSITORY / "examples" / "papers" / "trees").glob("*.xml"))
KINDS = {"tick": START, "running": CONTINUE, "halt": HALTED}

FETCH = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="Fetch" initial="idle">
  <state id="idle">
    <onentry><send event="LightOff"/></onentry>
    <transition event="HaveTask" cond="!DoorBlocked" target="work"/>
  </state>
  <state id="work" initial="go">
    <onentry><send event="LightOn"/></onentry>
    <onexit><send event="Park"/></onexit>
    <transition event="StopPressed Timeup" target="idle"><send event="Beep"/></transition>
    <state id="grasp">
      <onexit><send event="OpenHand"/></onexit>
      <invoke id="GraspObject"/>
      <transition event="done.invoke.GraspObject" target="finished"/>
      <transition event="Knock"><send event="Beep"/></transition>
    </state>
    <state id="go">
      <invoke id="DriveToShelf"/>
      <transition event="done.invoke.DriveToShelf" target="grasp"/>
      <transition event="error.platform.DriveToShelf" target="work"/>
    </state>
  </state>
  <final id="finished"/>
</scxml>
"""


def random_chart(rng: random.Random) -> str:
    """A chart of up to three levels, with transitions from anywhere to anywhere."""
    names: list[str] = []
    inside: dict[str, list[str]] = {}

    def sends(stem: str) -> str:
        return "".join(f'<send event="Do{stem}{n}"/>' for n in range(rng.randint(0, 2)))

    def make(depth: int) -> str:
        name = f"s{len(names)}"
        names.append(name)
        children = [make(depth + 1) for _ in range(rng.randint(1, 3))] if depth < 3 and rng.random() < 0.4 else []
        inside[name] = children
        return name

    top = [make(1) for _ in range(rng.randint(1, 3))]

    def text(name: str) -> str:
        children = inside[name]
        initial = f' initial="{rng.choice(children)}"' if children and rng.random() < 0.5 else ""
        parts = [f"<onentry>{sends(f'In{name}')}</onentry>", f"<onexit>{sends(f'Out{name}')}</onexit>"]
        if not children and rng.random() < 0.5:
            parts.append(f'<invoke id="Act{rng.randint(0, 2)}"/>')
        for _ in range(rng.randint(0, 2)):
            events = " ".join(rng.sample(["E0", "E1"], rng.randint(1, 2)))
            activity = re.search(r'invoke id="(\w+)"', parts[-1])
            if activity is not None and rng.random() < 0.6:
                events = rng.choice(["done.invoke.", "error.platform."]) + activity[1]
            cond = rng.choice(["", ' cond="G"', ' cond="!G"'])
            target = f' target="{rng.choice(names)}"' if rng.random() < 0.8 else ""
            parts.insert(
                rng.randint(0, len(parts) - 1), f'<transition event="{events}"{cond}{target}>{sends("T")}</transition>'
            )
        return f'<state id="{name}"{initial}>{"".join(parts + [text(child) for child in children])}</state>'

    return f'<scxml version="1.0" name="Random">{"".join(text(name) for name in top)}</scxml>'


def random_tree(rng: random.Random, most: int = 12) -> str:
    """A tree of memoryless nodes in which leaves are used once or several times."""
    left = rng.randint(2, most)

    def make(depth: int) -> str:
        nonlocal left
        left -= 1
        if depth == 0 or left <= 0 or rng.random() < 0.3:
            return rng.choice(
                ["<A/>", "<B/>", "<C/>", "<Is/>", "<Has/>", "<Do/>", "<AlwaysSuccess/>", "<AlwaysFailure/>"]
            )
        kind = rng.choice(["ReactiveSequence", "ReactiveFallback"] * 3 + ["WhileDoElse", *DECORATORS])
        if kind in DECORATORS:
            return f"<{kind}>{make(depth - 1)}</{kind}>"
        if kind == "WhileDoElse":
            condition = rng.choice(
                ["<Is/>", "<Inverter><Has/></Inverter>", "<ReactiveSequence><Is/><Has/></ReactiveSequence>"]
            )
            branches = "".join(make(depth - 1) for _ in range(rng.randint(1, 2)))
            return f"<{kind}>{condition}{branches}</{kind}>"
        return f"<{kind}>{''.join(make(depth - 1) for _ in range(rng.randint(1, 4)))}</{kind}>"

    root = make(4)
    model = '<Action ID="A"/><Action ID="B"/><Action ID="C"/><Condition ID="Is"/><Condition ID="Has"/>'
    model += '<Action ID="Do"><MetadataFields><Metadata kind="SyncAction"/></MetadataFields></Action>'
    tree = f'<BehaviorTree ID="Random">{root}</BehaviorTree><TreeNodesModel>{model}</TreeNodesModel>'
    return f'<root BTCPP_format="4">{tree}</root>'


DECORATORS = ["Inverter", "ForceSuccess", "ForceFailure", "KeepRunningUntilFailure"]
LEAVES = ["A", "B", "C", "Is", "Has", "Do", "AlwaysSuccess", "AlwaysFailure"]
CONDITIONS = ["<Is/>", "<Inverter><Has/></Inverter>", "<ReactiveSequence><Is/><Has/></ReactiveSequence>"]


def run_in_engine(tree: Path, folder: Path, chart: ChartMachine, rng: random.Random, ticks: int) -> None:
    """The engine's calls and statuses, and the chart's, in a random run."""
    read = read_tree(tree)
    entries = {name: number for number, name in enumerate(entry_names(list(read.scripts)))}
    world = AskingWorld(RunnableTree(Spec("AlwaysSuccess", []), {}, entries=tuple(entries)), ask_each)
    answers = Answers(AnythingGoes())

    def answer(index: int) -> int:
        node = engine.nodes[index]
        assert node.leaf is not None
        options = (1, 2, 3) if node.type.name == "StatefulAction" else (2, 3)
        return answers.ask((node.leaf.id, ()), options)

    def ask(script: Script) -> int:
        value = int(program(script, entries)(world))
        return value if script.role == "condition" else 1

    engine = Engine(build(folder), read, answer, ask)
    state = chart.start()
    for _ in range(ticks):
        answers = Answers(AnythingGoes(), rng=rng)
        state, (status, calls) = chart.step(state, answers)
        assert engine.tick() == status
        acting = [
            ((engine.nodes[index].name, ()), KINDS[what])
            for index, what in engine.calls
            if engine.nodes[index].type.name != "Condition"
        ]
        assert tuple(acting) == calls


def test_a_state_machine_becomes_a_tree(tmp_path: Path) -> None:
    output = tmp_path / "fetch.xml"
    result = convert("fsm", written(tmp_path, FETCH, "fetch.scxml"), "-o", output)
    assert result.exit_code == 0 and "exhaustive" in result.stderr and "not exhaustive" not in result.stderr
    assert cases(result.stderr) > 100
    chart = ChartMachine(read_scxml(tmp_path / "fetch.scxml"))
    run_in_engine(output, tmp_path, chart, random.Random(1), 3000)


def test_the_order_of_a_transition_is_scxmls(tmp_path: Path) -> None:
    """Out from the inside, the transition's own, in from the outside."""
    good("fsm", written(tmp_path, FETCH, "fetch.scxml"), "-o", tmp_path / "fetch.xml")
    machine = ChartMachine(read_scxml(tmp_path / "fetch.scxml"))
    at_grasp = (frozenset(("work", "grasp")), 0, True)
    answers = Answers(AnythingGoes())
    answers.given = {("Knock", ()): 3, ("StopPressed", ()): 2, ("Timeup", ()): 3}
    state, (_, calls) = machine.step(at_grasp, answers)
    assert [key[0] for key, _ in calls] == ["OpenHand", "Park", "Beep", "LightOff", "GraspObject"]
    assert calls[-1][1] == HALTED and state[0] == {"idle"}


def test_random_state_machines(tmp_path: Path) -> None:
    rng = random.Random(20)
    for number in range(25):
        source = written(tmp_path, random_chart(rng), "random.scxml")
        output = tmp_path / "random.xml"
        result = convert("fsm", source, "-o", output, "--limit", "1500")
        assert result.exit_code == 0, (number, result.output, source.read_text())
        if number % 5 == 0:
            run_in_engine(output, tmp_path, ChartMachine(read_scxml(source)), rng, 200)


def test_a_wrong_tree_of_a_state_machine_is_found(tmp_path: Path) -> None:
    """Every assignment of another state, every guard of another state, every action that is left out."""
    good("fsm", written(tmp_path, FETCH, "fetch.scxml"), "-o", tmp_path / "fetch.xml")
    text = (tmp_path / "fetch.xml").read_text(encoding="utf-8")
    chart = ChartMachine(read_scxml(tmp_path / "fetch.scxml"))
    patterns: list[tuple[str, Callable[[re.Match[str]], str]]] = [
        (r"fsm_state := (\d)", lambda m: f"fsm_state := {int(m[1]) % 4 + 1}"),
        (r"fsm_state == (\d)", lambda m: f"fsm_state == {int(m[1]) + 1}"),
        (r"<(LightOn|LightOff|Park|Beep|OpenHand)/>", lambda _m: "<AlwaysSuccess/>"),
        (r"fsm_ended == ([12])", lambda m: f"fsm_ended == {3 - int(m[1])}"),
    ]
    found = 0
    for pattern, replace in patterns:
        for match in re.finditer(pattern, text):
            changed = text[: match.start()] + replace(match) + text[match.end() :]
            tree = runnable(read_tree(written(tmp_path, changed, "changed.xml")), per_use=False)
            verdict = compare(chart, TreeMachine(tree, show_calls))
            assert not verdict.equal, (match[0], changed)
            found += 1
    assert found >= 20


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("<parallel/>", "<parallel> is not supported"),
        ("<history id='h'/>", "<history> is not supported"),
        ("<datamodel/>", "<datamodel> is not supported"),
        ("<onentry><script>x</script></onentry>", "<script> is not supported"),
        ("<onentry><raise event='x'/></onentry>", "<raise> is not supported"),
        ("<onexit><if cond='x'/></onexit>", "<if> is not supported"),
        ("<onexit><log/></onexit>", "<log> is not supported"),
        ("<initial/>", "<initial> is not supported"),
        ("<final id='f'/>", "<final> inside a state is not supported"),
        ("<transition target='a'/>", "a transition without an event is not supported"),
        ("<transition event='*' target='a'/>", "event '*' is not supported"),
        ("<transition event='x.y' target='a'/>", "event 'x.y' is not supported"),
        ("<transition event='E' target='nowhere'/>", "no state 'nowhere'"),
        ("<transition event='E' target='a' type='internal'/>", "only external transitions are supported"),
        ("<transition event='E' cond='x &gt; 3' target='a'/>", "cond='x > 3' is not supported"),
        ("<transition event='done.invoke.Work' target='a'/>", "'Work' is no activity of 'a'"),
        ("<invoke id='W'/><invoke id='V'/>", "a second <invoke> in 'a'"),
        ("<invoke id='W'/><state id='b'/>", "<invoke> in 'a', which has states inside"),
        ("<invoke type='x' id='W'/>", "type='…' of <invoke> is not supported"),
        ("<onentry><send event='A' delay='3s'/></onentry>", "delay='…' of <send> is not supported"),
        ("<onentry><send event='Sequence'/></onentry>", "'Sequence' is the name of a built-in node"),
        ("<onentry><send event='E'/></onentry><transition event='E'/>", "'E' is used as"),
        ("<state id='a'/>", "needs an id of its own"),
        ("<stat id='b'/>", "did you mean 'state'?"),
    ],
)
def test_what_scxml_has_and_this_has_not_is_named_with_its_line(tmp_path: Path, line: str, message: str) -> None:
    source = (
        f'<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">\n<state id="a">\n{line}\n</state>\n</scxml>'
    )
    told = bad("fsm", written(tmp_path, source, "x.scxml"))
    assert message in told
    assert re.match(r".*x\.scxml:[123](:\d+)?: error: ", told)


def test_a_file_that_is_no_state_machine(tmp_path: Path) -> None:
    assert "the root is not <scxml>" in bad("fsm", written(tmp_path, "<root/>", "x.scxml"))
    assert "there is no state" in bad("fsm", written(tmp_path, "<scxml/>", "x.scxml"))
    assert "<!DOCTYPE" in bad("fsm", written(tmp_path, "<!DOCTYPE a><scxml/>", "x.scxml"))
    deep = "<scxml>" + "".join(f'<state id="s{n}">' for n in range(30)) + "</state>" * 30 + "</scxml>"
    assert "inside each other" in bad("fsm", written(tmp_path, deep, "x.scxml"))


# -- trees into state machines


MEMORYLESS = [
    file for file in PAPERS if file.stem in ("fig2", "fig3", "fig6", "fig7", "fig19", "fig21", "fig22", "fig24")
]


@pytest.mark.parametrize("form", ["scxml", "dot", "c"])
@pytest.mark.parametrize("tree", MEMORYLESS, ids=[file.stem for file in MEMORYLESS])
def test_the_papers_trees_become_state_machines(tmp_path: Path, tree: Path, form: str) -> None:
    result = convert("to-fsm", tree, "--format", form, "-o", tmp_path / f"machine.{form}")
    assert result.exit_code == 0 and "exhaustive" in result.stderr and "not exhaustive" not in result.stderr


def test_figs_9_to_11(tmp_path: Path) -> None:
    """A leaf's FAILURE in a Fallback, and its SUCCESS in a Sequence, go to the next leaf; all else goes out."""
    folder = REPOSITORY / "examples" / "papers" / "trees"
    figures = {
        "fig2": [("EnterThroughFrontDoor", 3, "EnterThroughBackDoor")],
        "fig3": [("OpenFrontDoor", 2, "PassThroughDoor")],
        "fig6": [
            ("OpenFrontDoor", 2, "PassThroughDoor"),
            ("OpenFrontDoor", 3, "OpenBackDoor"),
            ("PassThroughDoor", 3, "OpenBackDoor"),
            ("OpenBackDoor", 2, "PassThroughDoor_2"),
        ],
    }
    for figure, wanted in figures.items():
        machine = to_fsm.to_machine(read_tree(folder / f"{figure}.xml"))
        edges = [
            (vertex.id, status, machine.vertices[jump.target].id)
            for vertex in machine.vertices
            for status, jump in vertex.jumps.items()
            if jump.target is not None
        ]
        assert sorted(edges) == sorted(wanted), figure
        assert len([jump for vertex in machine.vertices for jump in vertex.jumps.values()]) == 3 * len(machine.vertices)


def test_random_trees_become_state_machines(tmp_path: Path) -> None:
    rng = random.Random(11)
    converted = 0
    for number in range(150):
        path = written(tmp_path, random_tree(rng), "random.xml")
        try:
            machine = to_fsm.to_machine(read_tree(path))
        except CompileError as error:
            assert "can be RUNNING" in str(error)
            continue
        if not machine.vertices:
            continue
        source = TreeMachine(runnable(read_tree(path), declared=False), show_calls)
        for form, write, read in (
            ("scxml", fsm_files.write_scxml, fsm_files.read_scxml_back),
            ("dot", fsm_files.write_dot, fsm_files.read_dot_back),
        ):
            file = written(tmp_path, write(machine), f"machine.{form}")
            verdict = compare(source, to_fsm.TableMachine(*read(file, machine.vertices)), limit=20_000)
            assert verdict.equal, (form, path.read_text(), verdict.difference)
        if number % 10 == 0:
            header = written(tmp_path, write_c(machine), "machine.h")
            verdict = compare(source, CompiledMachine(header, machine.name, machine.vertices), limit=20_000)
            assert verdict.equal, (path.read_text(), verdict.difference)
        converted += 1
    assert converted > 100


def test_a_wrong_state_machine_is_found(tmp_path: Path) -> None:
    """Each transition of Fig. 7 that leads elsewhere, returns something else, or halts less than it must."""
    tree = read_tree(REPOSITORY / "examples" / "papers" / "trees" / "fig7.xml")
    machine = to_fsm.to_machine(tree)
    source = TreeMachine(runnable(tree, declared=False), show_calls)
    text = fsm_files.write_scxml(machine)
    found = 0
    for match in re.finditer(r'target="(\w+)"|canopy:returns="(\w+)"', text):
        if match[0].startswith("target"):
            name = next(v.id for v in machine.vertices if v.id not in (match[1], "BatteryAbove10"))
            changed = text[: match.start(1)] + name + text[match.end(1) :]
            if match[1] == "tick_source" or f'id="{name}"' in text[: match.start()]:
                continue  # would go round for ever
        else:
            other = "SUCCESS" if match[2] != "SUCCESS" else "FAILURE"
            changed = text[: match.start(2)] + other + text[match.end(2) :]
        file = written(tmp_path, changed, "changed.scxml")
        read = fsm_files.read_scxml_back(file, machine.vertices)
        assert not compare(source, to_fsm.TableMachine(*read)).equal, match[0]
        found += 1
    assert found > 15
    read = fsm_files.read_scxml_back(
        written(tmp_path, re.sub(r' canopy:halts="[^"]*"', "", text), "x.scxml"), machine.vertices
    )
    assert not compare(source, to_fsm.TableMachine(*read)).equal


@pytest.mark.parametrize(
    ("root", "message"),
    [
        ("<Sequence><A/></Sequence>", "<Sequence> cannot become states"),
        ("<ReactiveParallel success_count='1'><A/></ReactiveParallel>", "<ReactiveParallel> cannot become states"),
        ("<ReactiveSequence><Script code='x := 1'/></ReactiveSequence>", "<Script> cannot become states"),
        ("<ReactiveSequence><A _skipIf='false'/></ReactiveSequence>", "can be SKIPPED"),
        ("<WhileDoElse><A/><A/></WhileDoElse>", "a condition of <WhileDoElse> that can be RUNNING has a memory"),
    ],
)
def test_what_is_no_state_machine_is_named_with_its_line(tmp_path: Path, root: str, message: str) -> None:
    text = f'<root BTCPP_format="4"><BehaviorTree ID="T">\n{root}\n</BehaviorTree>'
    told = bad("to-fsm", written(tmp_path, f'{text}<TreeNodesModel><Action ID="A"/></TreeNodesModel></root>', "t.xml"))
    assert message in told and "t.xml:2:" in told


def test_c_that_cannot_be_checked_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    tree, output = MEMORYLESS[0], tmp_path / "machine.h"
    told = bad("to-fsm", tree, "--format", "c", "-o", output)
    assert "there is no C compiler 'no-such-compiler'" in told and not output.exists()
    result = convert("to-fsm", tree, "--format", "c", "--unchecked", "-o", output)
    assert result.exit_code == 0 and "not checked" in result.stderr and output.exists()


def test_names_that_are_no_words(tmp_path: Path) -> None:
    text = (REPOSITORY / "examples" / "papers" / "trees" / "fig2.xml").read_text(encoding="utf-8")
    text = text.replace("EnterThroughFrontDoor", "Enter-Front.Door").replace("TwoDoors", "a &quot;b&quot; c")
    assert "&quot;" in text
    tree = written(tmp_path, text, "names.xml")
    for form in ("scxml", "dot", "c"):
        good("to-fsm", tree, "--format", form)
    for name in ("7 dwarfs */", "int"):
        good("to-fsm", written(tmp_path, text.replace("a &quot;b&quot; c", name), "names.xml"), "--format", "c")


def test_the_command_is_listed() -> None:
    assert "convert" in main.list_commands(main.make_context("canopy", [], resilient_parsing=True))
