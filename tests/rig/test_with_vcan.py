# SPDX-License-Identifier: MIT
"""with-vcan: exit statuses, streams, arguments, time limit, signals, and a CAN bus that foreign tools can use."""

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

WITH_VCAN = Path(__file__).with_name("with-vcan")


def run(*arguments: str, stdin: str = "", env: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(WITH_VCAN), *arguments],
        input=stdin,
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
        env=os.environ | (env or {}),
    )


def mode() -> str:
    return run("--mode", "which").stdout.strip()


@pytest.mark.parametrize(
    ("command", "status"),
    [("exit 0", 0), ("exit 7", 7), ("kill -SEGV $$", 139), ("exec /nowhere/to/be/found", 127)],
)
def test_exit_status_is_that_of_the_command(command: str, status: int) -> None:
    assert run("--", "sh", "-c", command).returncode == status


def test_streams_stay_apart_and_whole() -> None:
    result = run("--", "sh", "-c", "echo out; echo err >&2; head -c 3000000 /dev/zero | tr '\\0' x")
    assert result.returncode == 0
    assert result.stdout == "out\n" + 3_000_000 * "x"
    assert result.stderr == "err\n"


def test_arguments_environment_and_folder_arrive_unchanged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "a folder's name"
    folder.mkdir()
    monkeypatch.chdir(folder)
    words = ["", "a b", "it's", '"', "$HOME", "*", "line\nbreak", "\\", "µ"]
    script = 'pwd; printf "%s\\0" "$ODD" "$@"; echo kept >file'
    result = run("--", "sh", "-c", script, "sh", *words, env={"ODD": "x\n'y' $z"})
    assert result.stderr == ""
    where, _, rest = result.stdout.partition("\n")
    assert where == str(folder)
    assert rest.split("\0")[:-1] == ["x\n'y' $z", *words]
    assert (folder / "file").read_text() == "kept\n"


def test_standard_input_is_handed_over_when_asked_for() -> None:
    if mode() == "uml":
        assert run("--", "cat", stdin="not seen").stdout == ""
        assert run("--stdin", "--", "cat", stdin="seen").stdout == "seen"
    else:
        assert run("--", "cat", stdin="seen").stdout == "seen"


def test_candump_sees_what_cansend_sends() -> None:
    script = "candump -n 1 -T 5000 vcan1 & sleep 0.3; cansend vcan1 123#DEADBEEF; wait"
    result = run("--iface", "vcan0,vcan1", "--", "sh", "-c", script)
    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == ["vcan1", "123", "[4]", "DE", "AD", "BE", "EF"]


def test_only_loopback_and_vcan_are_there() -> None:
    names = run("--", "sh", "-c", "cd /sys/class/net && echo *").stdout.split()
    allowed = {"lo", "vcan0", "sit0", "tunl0", "ip6tnl0", "gre0", "gretap0", "erspan0"}  # tunnels of no address
    assert {"lo", "vcan0"} <= set(names) <= allowed


def test_threads_keep_their_registers() -> None:
    """Wide registers survive page faults and thread switches: big_xstate.c, where the processor needs it."""
    script = (
        "import hashlib, threading\n"
        "data = bytes(range(256)) * 20000\n"
        "want = hashlib.sha256(data).digest()\n"
        "wrong = []\n"
        "def work():\n"
        "    for _ in range(15):\n"
        "        if hashlib.sha256(bytearray(data)).digest() != want: wrong.append(1)\n"
        "threads = [threading.Thread(target=work) for _ in range(4)]\n"
        "[t.start() for t in threads]; [t.join() for t in threads]\n"
        "print(len(wrong))\n"
    )
    assert run("--", "python3", "-c", script).stdout == "0\n"


@pytest.mark.parametrize("command", ["sleep 60", "trap '' TERM; while :; do sleep 1; done"])
def test_time_limit(command: str) -> None:
    start = time.monotonic()
    result = run("--timeout", "1", "--kill-after", "1", "--", "sh", "-c", command)
    stubborn_and_native = "trap" in command and mode() == "native"
    assert result.returncode == (137 if stubborn_and_native else 124)
    assert time.monotonic() - start < 20


@contextmanager
def started(*command: str) -> Iterator[subprocess.Popen[str]]:
    """with-vcan, running the command; ended when the test has not done so."""
    with subprocess.Popen([str(WITH_VCAN), "--", *command], stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()


def next_line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline()


def test_interrupt_reaches_the_command() -> None:
    script = (
        "import sys, time\n"
        "try:\n"
        "    print('ready', flush=True); time.sleep(60)\n"
        "except KeyboardInterrupt:\n"
        "    sys.exit(42)\n"
    )
    with started("python3", "-c", script) as process:
        assert next_line(process) == "ready\n"
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20) == 42


def children_of(parent: int) -> list[Path]:
    numbers = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    return [Path("/proc") / number for number in numbers]


def test_nothing_is_left_when_it_is_killed() -> None:
    with started("sh", "-c", "echo up; exec sleep 300") as process:
        assert next_line(process) == "up\n"
        # In mode native with-vcan has become the command itself.
        left = children_of(process.pid)
        assert left or mode() == "native"
        process.kill()
        process.wait()
    deadline = time.monotonic() + 5
    while any(child.exists() for child in left):
        assert time.monotonic() < deadline, f"still there: {left}"
        time.sleep(0.05)


def test_rig_failure_is_told_from_the_commands() -> None:
    result = run("--mode", "uml", "--uml", "/nowhere/linux.uml", "--", "true")
    assert result.returncode == 125
    assert "apt-get install user-mode-linux" in result.stderr
    no_kernel = run("--mode", "uml", "--uml", "/bin/false", "--retries", "0", "--", "true")
    assert no_kernel.returncode == 125
    assert "did not boot" in no_kernel.stderr


def test_command_line_errors() -> None:
    assert run("--").returncode == 2
    assert run("--iface", "can 0", "--", "true").returncode == 2
    assert run("--mem", "much", "--", "true").returncode == 2
