# SPDX-License-Identifier: MIT
"""LCM works where it can, and where it cannot one line says which command mends it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from canopy.lcm_link import DEFAULT_URL
from integration.lcm_netns import NO_ROUTE, LcmNetwork

OPEN = "import sys; from canopy.lcm_link import open_lcm; print(open_lcm(sys.argv[1], 'tool') is not None)"
PEER = str(Path(__file__).with_name("lcm_peer.py"))


def run_open(enter: list[str], url: str = DEFAULT_URL, script: str = OPEN) -> subprocess.CompletedProcess[str]:
    command = [*enter, sys.executable, "-c", script, url]
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=True)


def hide(module: str) -> str:
    """The script, where importing the module fails as if it was not installed."""
    return f"import sys; sys.modules['{module}'] = None; {OPEN}"


def test_with_a_route_it_opens_and_says_nothing() -> None:
    with LcmNetwork() as network:
        done = run_open(network.command([]))
    assert (done.stdout, done.stderr) == ("True\n", "")


def test_without_a_route_one_line_says_the_command() -> None:
    done = run_open(NO_ROUTE)
    assert done.stdout == "False\n"
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("tool: going on without LCM: no route to the multicast group 239.255.76.67 (")
    assert "mend with: ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo" in done.stderr


@pytest.mark.parametrize(
    ("module", "text"),
    [
        ("lcm", "the Python package lcm is not installed; mend with: pip install lcm"),
        ("canopy_msgs", "mend with: cmake --build build/host --target lcm_types"),
    ],
)
def test_without_a_package_one_line_says_what_to_install(module: str, text: str) -> None:
    done = run_open([], script=hide(module))
    assert done.stdout == "False\n"
    assert done.stderr.count("\n") == 1
    assert text in done.stderr


def test_a_folder_of_that_name_is_no_package() -> None:
    done = run_open([], script=f"import sys, types; sys.modules['lcm'] = types.ModuleType('lcm'); {OPEN}")
    assert done.stdout == "False\n"
    assert (
        done.stderr
        == "tool: going on without LCM: the Python package lcm is not installed; mend with: pip install lcm\n"
    )


def test_without_glib_one_line_says_what_to_install() -> None:
    script = f"""import sys
class Broken:
    def find_spec(self, name, path=None, target=None):
        # As the wheel does: it asks for lcm._lcm, and when that fails for lcm.Release.
        if name == "lcm._lcm":
            raise ImportError("libglib-2.0.so.0: cannot open shared object file: No such file or directory")
sys.meta_path.insert(0, Broken())
{OPEN}"""
    done = run_open([], script=script)
    assert done.stdout == "False\n"
    assert done.stderr.count("\n") == 1
    assert "apt-get install libglib2.0-0" in done.stderr


@pytest.mark.parametrize("url", ["bogus://", "udpm://239.255.76.67:port", "udpm://["])
def test_a_wrong_url_is_said_and_nothing_raised(url: str) -> None:
    with LcmNetwork() as network:
        done = run_open(network.command([]), url)
    assert done.stdout == "False\n"
    assert "tool: going on without LCM: " in done.stderr


def test_messages_arrive_with_the_default_url() -> None:
    with LcmNetwork() as network:
        listen = [sys.executable, PEER, "listen", DEFAULT_URL, "30", "CANOPY_ROBOT_COMMAND=robot_command_t"]
        with subprocess.Popen(network.command(listen), stdout=subprocess.PIPE, text=True) as listener:
            assert listener.stdout is not None
            assert json.loads(listener.stdout.readline()) == {"listening": True}
            fields = '{"command": 1, "battery": 12.5}'
            send = [sys.executable, PEER, "send", DEFAULT_URL, "CANOPY_ROBOT_COMMAND", "robot_command_t", fields]
            subprocess.run(network.command(send), check=True, timeout=30)
            message = json.loads(listener.stdout.readline())
            listener.terminate()
    assert message["channel"] == "CANOPY_ROBOT_COMMAND"
    assert (message["command"], message["battery"], message["head_x"]) == (1, 12.5, 0.0)
