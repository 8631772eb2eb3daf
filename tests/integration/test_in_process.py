# SPDX-License-Identifier: MIT
"""Compiled applications in this process: signals by name and in physical units, ticks, outputs, entries, statuses."""

from __future__ import annotations

import shutil
import threading
from fractions import Fraction
from itertools import groupby
from pathlib import Path

import pytest

from canopy.inprocess import Application, InProcessError
from canopy.live.codes import Status
from canopy_sim.plant import Profile
from integration import paper
from integration.big_mission import model_file


def generated(build_dir: Path, name: str, room: str = "examples/nao") -> Path:
    return build_dir / room / "generated" / name / f"{name}.model.json"


@pytest.fixture
def big(build_dir: Path) -> Application:
    return Application(model_file(build_dir))


@pytest.fixture
def language(build_dir: Path) -> Application:
    """The test application with every construct of the tree language; it has no world."""
    return Application(generated(build_dir, "language", "tests/unit"))


def test_example_4_has_the_papers_phases(build_dir: Path) -> None:
    """The robot of nao.dbc is in the library: plant, codec, loop and tree run in C."""
    application = Application(generated(build_dir, "nao_power"))
    modes = []
    for _ in range(2000):
        application.tick()
        modes.append(str(application.output("PowerCommand.Mode")))
    phases = [(mode, len(list(run))) for mode, run in groupby(modes)]
    exact = paper.phases(paper.example_4(Fraction(80), Fraction(50)), 2000)
    assert phases == [(paper.MODES[phase], length) for phase, length in exact]


def test_example_5_has_the_papers_phases(build_dir: Path) -> None:
    application = Application(generated(build_dir, "nao_home"))
    statuses = []
    while application.tick() is Status.RUNNING:
        leaf = next(n for n in ("Walk Home", "Sit to Stand", "Lie down to Sit up") if application.status(n) == 1)
        statuses.append(leaf)
    assert [(leaf, len(list(run))) for leaf, run in groupby(statuses)] == [
        ("Lie down to Sit up", 10),
        ("Sit to Stand", 4),
        ("Walk Home", 5),
    ]
    assert application.root is Status.SUCCESS


def test_signals_are_set_in_physical_units_and_by_name(build_dir: Path) -> None:
    """Its cases remember what they have come to: an instance each."""
    for temperature, cold, warm in ((10, Status.SUCCESS, Status.IDLE), (20, Status.FAILURE, Status.SUCCESS)):
        application = Application(generated(build_dir, "language", "tests/unit"))
        application.set({"Climate.Door": "Open"})
        application.set({"Climate.Temperature": temperature})  # the door stays open
        application.tick()
        assert application.entry("seen_door") == 2
        assert (application.last_status("cold"), application.last_status("warm")) == (cold, warm)
        assert (application.rejected, application.faults) == (0, 0)


def test_entries_are_read_and_written(big: Application) -> None:
    assert set(big.entries) == {"activity", "handled"}
    big.set_entry("activity", 4)
    assert big.entry("activity") == 4
    for wrong in (256, -1, 1.5):
        with pytest.raises(InProcessError, match=r"entry 'activity' is uint8_t"):
            big.set_entry("activity", wrong)
    assert big.entry("activity") == 4
    with pytest.raises(InProcessError, match="did you mean 'activity'"):
        big.entry("activty")


def test_entries_of_all_types(language: Application) -> None:
    """Each is a number or a text, or says that it is neither."""
    kinds = {}
    language.tick(5)
    for name in language.entries:
        try:
            kinds[name] = type(language.entry(name)).__name__
        except InProcessError as error:
            assert "neither a number nor a text" in str(error)
            kinds[name] = "other"
    assert {"int", "bool", "str", "float", "other"} == set(kinds.values()), kinds
    assert language.entry("text") in ("red", "green", "blue")
    language.set_entry("gain", -1.25)
    assert language.entry("gain") == -1.25
    with pytest.raises(InProcessError, match="holds a text of the tree"):
        language.set_entry("text", 1)


def test_what_is_not_there_is_named(big: Application) -> None:
    wrongs = {
        "Batery.Level": "did you mean 'Battery'",
        "Battery.Levl": "did you mean 'Level'",
        "PowerCommand.Mode": "no input message 'PowerCommand'",
    }
    for name, text in wrongs.items():
        with pytest.raises(InProcessError, match=text):
            big.set({name: 1})
    with pytest.raises(InProcessError, match="did you mean 'PowerCommand'"):
        big.output("PowrCommand.Mode")
    with pytest.raises(InProcessError, match="nodes have the name 'Lie down to Sit up'; give one of the indices"):
        big.status("Lie down to Sit up")
    with pytest.raises(InProcessError, match="did you mean 'Throw Ball'"):
        big.status("Throw Bal")
    with pytest.raises(InProcessError, match="the tree has 60"):
        big.status(60)
    with pytest.raises(InProcessError, match="no input message 'Batery'"):
        big.silence("Batery")


def test_what_a_signal_cannot_be_is_refused_and_changes_nothing(build_dir: Path) -> None:
    application = Application(generated(build_dir, "nao_home"))
    for value, text in ((111, "range is 0 to 110"), (-0.1, "range is 0 to 110"), ("Full", "has no value 'Full'")):
        with pytest.raises(InProcessError, match=text):
            application.set({"Battery.Charging": 1, "Battery.Level": value})
    with pytest.raises(InProcessError, match="cannot be nan"):
        application.set({"Battery.Level": float("nan")})


def test_a_message_falls_silent_and_is_stale(language: Application) -> None:
    language.set({"Climate.Door": "Open", "Climate.Temperature": 21})
    language.tick(100)  # more frames than a counter of E2E has numbers
    assert language.last_status("warm") is Status.SUCCESS
    language.silence("Climate")
    language.tick(1000)
    assert language.last_status("warm") is Status.FAILURE
    language.set({"Climate.Door": "Open"}, age=100)  # a frame that was on the wire long ago does not count
    language.tick()
    assert language.last_status("warm") is Status.FAILURE


def test_each_load_is_an_instance(build_dir: Path) -> None:
    first, second = (Application(generated(build_dir, "nao_home")) for _ in range(2))
    first.tick(12)
    assert first.output("PostureCommand.Mode") == "StandUp"
    assert second.now == 0
    second.tick()
    assert second.output("PostureCommand.Mode") == "SitUp"


def test_instances_run_at_the_same_time(build_dir: Path) -> None:
    """Each thread has its own; the loop is in C, and waits for no lock of Python's."""
    applications = [Application(generated(build_dir, "nao_power")) for _ in range(4)]
    threads = [threading.Thread(target=one.run, args=(20_000,)) for one in applications]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {one.now for one in applications} == {1000.0}
    assert len({bytes(one.library.statuses()) for one in applications}) == 1


def test_a_run_ends_with_a_status(build_dir: Path) -> None:
    application = Application(generated(build_dir, "nao_home"))
    assert application.run(1000, until=[Status.SUCCESS]) == 20
    assert application.now == pytest.approx(1.0)
    with pytest.raises(InProcessError, match="cannot go back"):
        application.now = 0.5
    with pytest.raises(InProcessError, match="is not a number of ticks"):
        application.run(-1)


def test_another_tree_is_loaded_and_its_nodes_have_their_names(build_dir: Path, big: Application) -> None:
    big.tick(5)
    folder = model_file(build_dir).parent
    with pytest.raises(InProcessError, match="rejected with error"):
        big.library.run_image(b"no image")
    assert big.status("Guarantee Power Supply") is not None
    big.run_image(folder / "nao_big_as_printed.img", folder / "nao_big_as_printed.model.json")
    assert len(big.model.nodes) == 52
    big.tick(5)
    assert big.status("NAO") is Status.RUNNING
    small = Application(generated(build_dir, "nao_home"))
    with pytest.raises(InProcessError, match="IMAGE"):
        small.library.run_image((folder / "nao_big_as_printed.img").read_bytes())


def test_a_library_that_does_not_fit_is_refused(build_dir: Path, tmp_path: Path) -> None:
    home, power = generated(build_dir, "nao_home"), generated(build_dir, "nao_power")
    with pytest.raises(InProcessError, match="another build"):
        Application(home, power.with_name("nao_power.so"))
    with pytest.raises(InProcessError, match="cannot be loaded"):
        Application(home, tmp_path / "none.so")
    (tmp_path / "text.so").write_text("no library")
    with pytest.raises(InProcessError, match="cannot be loaded"):
        Application(home, tmp_path / "text.so")
    with pytest.raises(InProcessError, match="canopy compile"):
        Application(tmp_path / "none.model.json")
    shutil.copy(home, tmp_path)
    with pytest.raises(InProcessError, match="is not there"):
        Application(tmp_path / home.name, home.with_name("nao_home.so"))


def test_profiles_have_the_names_of_the_command_line() -> None:
    assert [profile.name for profile in Profile] == ["paper", "nao"]
