# SPDX-License-Identifier: MIT
"""The benchmark itself: it runs, counts the same twice, and what it counts is what it says.

No figure is asserted but those that hold on every machine: sizes, no allocator, and a stack that does not depend on the
tree.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bench import build, cortex_m, cycle, image, instructions, measure, report


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build.host_program(build.HOSTS[0], tmp_path_factory.mktemp("bench"))


def ran(program: Path, workload: str, n: int, ticks: int) -> dict[str, Any]:
    result: dict[str, Any] = json.loads(build.run(program, "run", workload, str(n), str(ticks)))
    return result


@pytest.mark.parametrize(
    ("workload", "n", "nodes", "leaf_calls", "status"),
    [
        ("sequence", 10, 11, 10, 2),
        ("fallback", 10, 11, 10, 3),
        ("reactive", 10, 11, 10, 2),
        ("reactive_running", 10, 11, 10, 1),
        ("memory_running", 10, 11, 10, 1),
        ("balanced", 6, 5461, 256, 2),
        ("inverters", 3, 4, 1, 3),
        ("sequence", 60000, 60001, 60000, 2),
        ("inverters", 60000, 60001, 1, 2),
    ],
)
def test_the_trees_are_what_they_are_called(
    program: Path, workload: str, n: int, nodes: int, leaf_calls: int, status: int
) -> None:
    expected = {"nodes": nodes, "leaf_calls": leaf_calls, "status": status}
    assert ran(program, workload, n, 1) == expected


def test_a_resumed_sequence_calls_only_the_action(program: Path) -> None:
    assert ran(program, "memory_running", 10, 11)["leaf_calls"] == 10 + 10


@pytest.mark.parametrize("workload", ["halt_reactive", "halt_parallel", "halt_timeout"])
def test_what_halts_halts_in_the_second_tick(program: Path, workload: str) -> None:
    assert ran(program, workload, 5, 1)["status"] == 1
    assert ran(program, workload, 5, 2)["status"] in (2, 3)
    assert ran(program, workload, 5, 3)["status"] == 1


def test_sizes(program: Path) -> None:
    sizes = json.loads(build.run(program, "sizes"))
    assert sizes["flash_per_node"] == 12
    assert sizes["ram_per_node"] == 1


@pytest.mark.parametrize(
    "target",
    [
        pytest.param(target, id=target.name, marks=[pytest.mark.clang] if target.name == "clang" else [])
        for target in (*build.HOSTS, *build.CORTEX_M4, *build.CORTEX_M0)
    ],
)
def test_the_engine_calls_no_allocator(tmp_path: Path, target: build.Target) -> None:
    outside = build.undefined_symbols(target, build.engine_object(target, tmp_path))
    assert not set(outside) & set(measure.ALLOCATORS)


def test_wrong_arguments_are_refused(program: Path) -> None:
    with pytest.raises(RuntimeError, match="exit status 2"):
        build.run(program, "run", "sequence", "60001", "1")


def test_workloads_are_numbered_as_in_c(program: Path) -> None:
    source = (build.HERE / "workloads.c").read_text(encoding="utf-8")
    names = source.partition("bench_names[BENCH_WORKLOADS] = {")[2].partition("}")[0]
    assert [name.strip().strip('"') for name in names.split(",") if name.strip()] == measure.WORKLOADS


def test_instruction_counts_repeat_exactly(program: Path) -> None:
    first, second = (instructions.canopy_per_leaf(program, "sequence", 10) for _ in range(2))
    assert first == second
    # The leaf itself is three or four instructions: less would mean that it was not counted.
    assert 10 < first < 200


def test_the_stack_on_cortex_m_does_not_depend_on_depth(tmp_path: Path) -> None:
    for target in build.CORTEX_M4:
        bare = build.bare_program(target, tmp_path)
        for workload, (few, many) in measure.STACK_ROWS:
            shallow, deep = (measure.tick_stack(bare, workload, n) for n in (few, min(many, 200)))
            assert shallow == deep <= 160, (target.name, workload)


@pytest.mark.timeout(600)  # half a minute alone: every instruction is looked at
def test_no_node_type_takes_more_stack_than_promised(tmp_path: Path) -> None:
    for target in build.CORTEX_M4:
        stacks = measure.stack_of_types(build.bare_program(target, tmp_path))
        assert max(stacks.values()) <= 160, (target.name, stacks)


def test_loading_an_image_is_counted(tmp_path: Path) -> None:
    images = image.measure(build.CORTEX_M4[1], image.generate(tmp_path), tmp_path)
    assert all(found["instructions"] > 8 * found["bytes"] for found in images.values()), "the CRC takes each bit"


@pytest.fixture(scope="module")
def nao_power(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return cycle.generate(cycle.APPLICATIONS[0], tmp_path_factory.mktemp("cycle"))


def test_parts_of_a_cycle_add_up(nao_power: Path, tmp_path: Path) -> None:
    application = cycle.APPLICATIONS[0]
    host = cycle.measure_host(cycle.host_program(build.HOSTS[0], application, nao_power, tmp_path))
    bare = cycle.measure_cortex(cycle.bare_program(build.CORTEX_M4[0], application, nao_power, tmp_path))
    assert bare.pop("worst") > bare["whole"]
    for counts in (host, bare):
        assert counts.pop("interrupts") == 0
        # Two frames of 8 bytes checked, one of 3 bytes protected, each byte in five instructions or more.
        assert 2 * 8 * 5 < counts["e2e"] < counts["receive"] + counts["transmit"]
        assert all(count > 0 for count in counts.values())
        parts = sum(counts[part] for part in report.PARTS_OF_WHOLE)
        assert 0.7 * counts["whole"] < parts < counts["whole"]


def test_transmit_interrupts_come_on_top_of_a_cycle(nao_power: Path, tmp_path: Path) -> None:
    application = replace(cycle.APPLICATIONS[0], mailboxes=1)
    host = cycle.measure_host(cycle.host_program(build.HOSTS[0], application, nao_power, tmp_path))
    bare = cycle.measure_cortex(cycle.bare_program(build.CORTEX_M4[0], application, nao_power, tmp_path))
    for counts in (host, bare):
        # Two commands and three or four trace frames leave, each with an interrupt that takes note of it.
        assert counts["interrupts"] > 5 * 50
        assert 0 < counts["transmit"] < counts["whole"]


def test_a_cycle_that_rejects_a_frame_is_not_measured(tmp_path: Path) -> None:
    own = {"PowerCommand": {"E2E_CRC": 0, "E2E_Counter": 0, "Mode": 0}}
    application = replace(cycle.APPLICATIONS[0], frames=own)
    generated = cycle.generate(application, tmp_path)
    with pytest.raises(RuntimeError, match="100 frames were lost or rejected"):
        cycle.measure_cortex(cycle.bare_program(build.CORTEX_M4[0], application, generated, tmp_path))
    with pytest.raises(RuntimeError, match="failures"):
        cycle.measure_host(cycle.host_program(build.HOSTS[0], application, generated, tmp_path))


def test_what_has_run_uncounted_is_counted_when_it_runs_again(nao_power: Path, tmp_path: Path) -> None:
    program = cycle.bare_program(build.CORTEX_M4[0], cycle.APPLICATIONS[0], nao_power, tmp_path)
    counts = []
    for calls_before in (0, 3):
        core = cortex_m.Core(program)
        data = cortex_m.STACK_TOP - 0x1000
        for _ in range(calls_before):
            core.call("canopy_e2e_crc", 1, data, 8)
        counts.append(core.count("canopy_e2e_crc", 1, data, 8))
    assert counts[0] == counts[1]


def test_tables_have_a_cell_for_everything() -> None:
    column = {
        "per_leaf": {"sequence 100": 22.0, "inverters 60000": 60001.0},
        "stack": {"sequence 10": 48},
        "worst_stack": {"bytes": 160, "of": ["Parallel"]},
    }
    peer = {"version": "1", "per_leaf": {"sequence": 1.0}, "nanoseconds": {"sequence": 1.0}}
    sizes = {"flash_per_node": 12, "ram_per_node": 1, "ram_per_word": 2, "instance": 48}
    memory = {"sizes": sizes, "allocators": 0, "calls_outside": {"gcc": []}, "code_bytes": {"gcc": 1000}}
    cycle_parts = dict.fromkeys(("whole", *cycle.PARTS), 1.0)
    text = report.markdown(
        {
            "machine": "x86_64",
            "host": {"gcc": column},
            "cortex_m4": {"cortex-m4 -O2": column},
            "cycles": {"nao_power": {"gcc": cycle_parts, "cortex-m4 -O2": {**cycle_parts, "worst": 2}}},
            "images": {"cortex-m4 -O2": {"main": {"nodes": 22, "bytes": 872, "instructions": 53201}}},
            "memory": memory,
            "peers": {
                "Canopy": {
                    **peer,
                    "per_leaf": {"sequence": 22.0, "balanced": 46.0},
                    "nanoseconds": {"sequence": 1.0, "balanced": 1.0},
                }
            },
        }
    )
    tables = [block.splitlines() for block in text.split("\n\n") if block.startswith("|")]
    assert len(tables) == 6
    assert all(len({line.count("|") for line in table}) == 1 for table in tables)
