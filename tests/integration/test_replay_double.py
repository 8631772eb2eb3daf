# SPDX-License-Identifier: MIT
"""canopy replay of real runs on a bus that takes its time: tests/bus_double, with nao_home at one end."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from canopy.cli import main
from integration.test_replay import differs, model_file, refused

TICKS = 401
CANNOT_BE = {"overloaded": 5, "long_block": 90}
"""So much of the trace is lost that the run cannot be replayed to its end, but for at least so many ticks."""


@pytest.fixture(scope="module")
def run(build_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[Path, dict[str, int]]]:
    """Runs a scenario: the log of the wire, and what the program says of it."""
    folder = tmp_path_factory.mktemp("double")

    def run_it(scenario: str) -> tuple[Path, dict[str, int]]:
        log = folder / f"{scenario}.log"
        command = [str(build_dir / "tests" / "bus_double" / "record_double"), scenario, str(log)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stderr) == (0, "")
        told = done.stdout.splitlines()[-1]
        ticks = re.search(r"(\d+) ticks", told)
        assert ticks is not None
        return log, {"ticks": int(ticks[1]), **{name: int(value) for name, value in re.findall(r"(\S+) (\d+)", told)}}

    return run_it


@pytest.fixture
def replay(build_dir: Path) -> Callable[..., Result]:
    def replay_it(log: Path, *options: str) -> Result:
        program = str(build_dir / "examples" / "nao" / "nao_home")
        command = ["replay", str(log), "--model", str(model_file(build_dir)), "--program", program, "--json", *options]
        return CliRunner().invoke(main, command)

    return replay_it


BLOCKED = ["replaced", "one_mailbox", "no_abort", "socket", "blocked"]


@pytest.mark.parametrize("name", ["calm", "fifos", "backlog", "loaded", "bursts", "bus_off", *BLOCKED])
def test_a_run_is_equal(
    run: Callable[[str], tuple[Path, dict[str, int]]], replay: Callable[..., Result], name: str
) -> None:
    log, told = run(name)
    result = replay(log)
    assert result.exit_code == 0, (result.output, result.exception)
    data = json.loads(result.stdout)
    assert (data["equal"], data["ticks"], told["ticks"]) == (True, TICKS, TICKS)
    # Of those that did not leave, two were of the last tick: the safe values replaced them, and nothing counts them.
    assert told["dropped"] == 0
    assert 0 <= told["replaced"] + told["expired"] - data["dropped"] - data["uncounted"] <= 2
    assert data["uncounted"] <= 8  # behind the last CanopyHealth that counts them, a second before the end
    assert data["inputs"] > (70 if name == "backlog" else 300)
    if name == "backlog":
        assert told["oldest"] > 400  # [ms], eight periods
        assert told["backlogs"] > 300
    elif name == "fifos":
        assert data["inputs"] > 3900
        assert told["oldest"] <= 11
    elif name in ("calm", "loaded"):
        assert data["dropped"] == data["uncounted"] == data["unheard"] == 0
    elif name == "bursts":
        assert data["dropped"] > 100
        assert told["oldest"] > 150
    elif name == "bus_off":
        assert told["bus-offs"] == 10
        assert data["dropped"] >= 30
        assert data["unheard"] > 30
    else:
        assert data["dropped"] >= 38
        assert data["unheard"] > 100


@pytest.mark.parametrize("name", CANNOT_BE)
def test_without_the_trace_it_is_replayed_up_to_the_gap(
    run: Callable[[str], tuple[Path, dict[str, int]]], replay: Callable[..., Result], name: str
) -> None:
    log, told = run(name)
    result = replay(log)
    refused(result, "missing; a replay needs all of them; --ticks ")
    cut = int(re.findall(r"--ticks (\d+)", result.stderr)[0])
    assert CANNOT_BE[name] <= cut < TICKS
    assert told["dropped"] > 20
    data = json.loads(replay(log, "--ticks", str(cut)).stdout)
    assert (data["equal"], data["ticks"]) == (True, cut)


@pytest.mark.parametrize("name", ["replaced", "socket"])
def test_a_command_that_was_sent_and_is_missing_is_a_difference(
    run: Callable[[str], tuple[Path, dict[str, int]]], replay: Callable[..., Result], tmp_path: Path, name: str
) -> None:
    """One more than CanopyHealth has counted, of a run in which others are missing."""
    log, _ = run(name)
    lines = log.read_text().splitlines(keepends=True)
    at = [place for place, line in enumerate(lines) if " 210#" in line][150]
    left = tmp_path / "left.log"
    left.write_text("".join(lines[:at] + lines[at + 1 :]))
    result = replay(left)
    found = differs(result, json.loads(result.stdout)["ticks"])
    assert 100 < found[0]["tick"] < 250
    assert {one["message"] for one in found} == {"PostureCommand"}
