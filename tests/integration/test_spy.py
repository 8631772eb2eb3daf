# SPDX-License-Identifier: MIT
"""lcm-spy decodes Canopy's messages, and `canopy spy` starts it or says what is missing."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import lcm
import pytest

from canopy.live.lcm_messages import status_message, structure_message
from canopy.model import load_model
from canopy.spy import find_jar
from canopy.trace import TraceDecoder
from integration.lcm_peer import message_type
from integration.trace_source import TraceSource, write_model

CHECK = Path(__file__).with_name("SpyCheck.java")


@pytest.fixture
def jar(build_dir: Path) -> Path:
    path = build_dir / "lcm" / "canopy_msgs.jar"
    if not path.is_file():
        pytest.fail(f"{path} is missing: install a JDK (default-jdk-headless) and build the target lcm_types")
    return path


@pytest.fixture
def lcm_jar() -> Path:
    spec = find_spec("lcm")
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parents[1] / "share" / "java" / "lcm.jar"


def run_check(class_path: list[Path], log: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Compiles SpyCheck and lets it read the log."""
    options = ["-cp", os.pathsep.join(map(str, class_path)), "-d", str(folder)]
    subprocess.run(["javac", *options, str(CHECK)], check=True, capture_output=True, timeout=100)
    # lcm-spy's class discovery looks at this property alone, as the JVM sets it.
    command = ["java", "-cp", os.pathsep.join(map(str, [folder, *class_path])), "SpyCheck", str(log)]
    return subprocess.run(command, capture_output=True, text=True, timeout=100)


def write_log(path: Path, messages: dict[str, Any]) -> None:
    log = lcm.EventLog(path, "w")
    for number, (channel, message) in enumerate(messages.items()):
        log.write_event(number, channel, message.encode())
    log.close()


@pytest.fixture
def messages(tmp_path: Path) -> dict[str, Any]:
    """One of each type, by channel."""
    model = load_model(write_model(tmp_path))
    decoder = TraceDecoder(model)
    views = [view for frame in TraceSource(4).frames([1, 3, 9, 2]) for view in decoder.feed(*frame)]
    state = message_type("robot_state_t")()
    state.battery, state.charger_distance, state.charging, state.power_mode = 49.3, -0.932, True, 3
    command = message_type("robot_command_t")()
    command.command, command.head_x = 1, float("nan")
    return {
        "CANOPY_TREE": status_message(model, views[0], 5),
        "CANOPY_TREE_STRUCTURE": structure_message(model),
        "CANOPY_ROBOT": state,
        "CANOPY_ROBOT_COMMAND": command,
    }


def test_lcm_spy_finds_and_decodes_all_types(
    tmp_path: Path, jar: Path, lcm_jar: Path, messages: dict[str, Any]
) -> None:
    write_log(tmp_path / "log", messages)
    done = run_check([lcm_jar, jar], tmp_path / "log", tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    tree, structure, state, command = [text for text in done.stdout.splitlines() if text.startswith("CANOPY_")]
    assert tree.startswith("CANOPY_TREE canopy_msgs.tree_status_t utime=5 application=nao_home ")
    assert " tick=0 root=RUNNING bus=error-active num_running=0 running= num_failed=1 failed=n1 health= " in tree
    assert " num_nodes=4 code=1,3,9,2 certain=true,true,true,true since=0,0,0,0 " in tree
    assert structure.startswith("CANOPY_TREE_STRUCTURE canopy_msgs.tree_structure_t ")
    assert (
        " tree_id=GetHome num_nodes=4 parent=-1,0,0,0 type=ReactiveFallback,Look,Look,Look name=Get home,n1"
        in structure
    )
    assert state.startswith("CANOPY_ROBOT canopy_msgs.robot_state_t ")
    assert " battery=49.3 charger_distance=-0.932 " in state
    assert " charging=true power_mode=3 " in state
    assert command.startswith("CANOPY_ROBOT_COMMAND canopy_msgs.robot_command_t ")
    assert " command=1 battery=0.0 charger_distance=0.0 head_x=NaN " in command


def test_without_the_jar_it_does_not(tmp_path: Path, lcm_jar: Path, messages: dict[str, Any]) -> None:
    write_log(tmp_path / "log", messages)
    done = run_check([lcm_jar], tmp_path / "log", tmp_path)
    assert done.returncode == 1
    assert "CANOPY_TREE ?? " in done.stdout


def test_the_jar_holds_the_types_for_java_8_and_nothing_else(jar: Path) -> None:
    with zipfile.ZipFile(jar) as packed:
        files = sorted(name for name in packed.namelist() if not name.endswith("/"))
        robot = [f"robot_{name}_t" for name in ("command", "event", "health", "state")]
        assert files == [f"canopy_msgs/{name}.class" for name in (*robot, "tree_status_t", "tree_structure_t")]
        assert packed.read(files[0])[6:8] == b"\x00\x34"  # class file version 52
    assert sorted(path.name for path in jar.parent.iterdir()) == ["canopy_msgs.jar", "python", "python.stamp"]


def test_the_jar_is_found_beside_the_python_types() -> None:
    jar = find_jar()
    assert jar is not None
    assert jar.name == "canopy_msgs.jar"


FAKE_JAVA = """#!/bin/sh
if [ "$1" = -XshowSettings:properties ]; then
    echo "    java.home = $(dirname "$0")/home" >&2
    exit 0
fi
echo "java $*"
echo "url $LCM_DEFAULT_URL"
exit 42
"""


@pytest.fixture
def desk(tmp_path: Path) -> dict[str, str]:
    """An environment with a display and a Java that only says how it was called; status 42."""
    (tmp_path / "bin" / "home" / "lib").mkdir(parents=True)
    for name in ("libawt.so", "libawt_xawt.so"):
        (tmp_path / "bin" / "home" / "lib" / name).touch()
    java = tmp_path / "bin" / "java"
    java.write_text(FAKE_JAVA, encoding="ascii")
    java.chmod(0o755)
    environment = {name: text for name, text in os.environ.items() if name not in ("CLASSPATH", "LCM_JVM_OPT")}
    return {**environment, "DISPLAY": ":99", "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}"}


def spy(environment: dict[str, str], *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "canopy", "spy", *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment)


def test_lcm_spy_is_started_with_the_jar(jar: Path, desk: dict[str, str]) -> None:
    done = spy({**desk, "CLASSPATH": "/mine.jar"}, "--jar", str(jar), "--lcm-url", "udpm://239.255.1.1:1?ttl=0")
    assert done.returncode == 42, done.stderr
    started, url = done.stdout.splitlines()
    assert started.endswith(" lcm.spy.Spy")
    assert f":{jar}:/mine.jar " in started
    assert url == "url udpm://239.255.1.1:1?ttl=0"


def missing_display(environment: dict[str, str]) -> None:
    del environment["DISPLAY"]


def headless_java(environment: dict[str, str]) -> None:
    (Path(environment["PATH"].split(":")[0]) / "home" / "lib" / "libawt_xawt.so").unlink()


def no_java(environment: dict[str, str]) -> None:
    folder = Path(environment["PATH"].split(":")[0])
    (folder / "java").unlink()
    environment["PATH"] = str(folder)


@pytest.mark.parametrize(
    ("remove", "text"),
    [
        (missing_display, "lcm-spy needs a display, and DISPLAY is not set"),
        (headless_java, "this Java has no windows (headless); mend with: apt-get install default-jre"),
        (no_java, "lcm-spy needs Java; mend with: apt-get install default-jre"),
    ],
)
def test_what_is_missing_is_one_line(jar: Path, desk: dict[str, str], remove: Any, text: str) -> None:
    remove(desk)
    done = spy(desk, "--jar", str(jar))
    assert done.returncode == 1
    assert done.stderr.startswith(f"canopy spy: {text}")
    assert done.stderr.count("\n") == 1


def test_without_types_it_says_how_to_build_them(desk: dict[str, str], tmp_path: Path) -> None:
    # Types without a jar beside them, as the build makes them where there is no JDK.
    package = tmp_path / "lcm" / "python" / "canopy_msgs"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    done = spy({**desk, "PYTHONPATH": str(package.parent)})
    assert done.returncode == 1
    assert done.stderr.startswith("canopy spy: canopy_msgs.jar is not built; mend with: apt-get install default-jdk")
    assert shutil.which("java", path=desk["PATH"]) is not None
