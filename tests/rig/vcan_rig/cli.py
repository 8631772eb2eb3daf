# SPDX-License-Identifier: MIT
"""Command line of with-vcan, and the choice of the mode."""

import argparse
import re
import shutil
from pathlib import Path

from vcan_rig import EXIT_RIG, log, native
from vcan_rig.options import Options
from vcan_rig.uml import run_uml

DESCRIPTION = """\
Runs CMD where CAN interfaces (vcan0, ...) exist, apart from every real network.

modes (auto takes the first that works):
  native  the kernel has CAN: a network namespace of its own, as root or as any user who may make one
  uml     Debian's user-mode-linux boots in about 1.4 s on this machine's files, as root or any user: everything is
          read-only but the current folder and --rw folders; /tmp, /var/tmp, /run and /dev/shm are empty
  which   only prints native, uml or none

In both, lo is up and has the multicast route that LCM needs, and nothing else is connected. Environment, current
folder, standard output and error are CMD's as usual; its standard input is empty in mode uml without --stdin."""

EPILOG = """\
exit status: CMD's (128+N if signal N ended it); 124 after --timeout; 125 when there is no way to have CAN interfaces
here or the guest died; 126 and 127 as a shell's. In mode native a command that ignores SIGTERM ends a --timeout
with 137.
SIGINT and SIGTERM are passed on to CMD; a third signal ends the guest."""


def memory(text: str) -> int:
    """Bytes from a number with K, M or G."""
    match = re.fullmatch(r"(\d+)([KMG])", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number with K, M or G")
    return int(match[1]) << {"K": 10, "M": 20, "G": 30}[match[2]]


def interfaces(text: str) -> list[str]:
    """Interface names from a list separated by commas."""
    names = text.split(",")
    for name in names:
        if not re.fullmatch(r"[A-Za-z0-9_-]{1,15}", name):
            raise argparse.ArgumentTypeError(f"{name!r} is not an interface name")
    return names


def make_parser() -> argparse.ArgumentParser:
    """The command line's parser; its destinations are the fields of Options."""
    parser = argparse.ArgumentParser(
        prog="with-vcan",
        usage="with-vcan [options] -- CMD ARGS...",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--iface", type=interfaces, default=["vcan0"], metavar="NAMES", help="interfaces to make, with commas (vcan0)")
    add("--mode", choices=("auto", "native", "uml", "which"), default="auto")
    add("--timeout", type=float, default=0.0, metavar="S", help="seconds for CMD, then SIGTERM (0: no limit)")
    add("--kill-after", type=float, default=5.0, metavar="S", help="seconds from SIGTERM to SIGKILL (5)")
    add("-v", "--verbose", action="store_true", help="show the guest kernel's messages")
    uml = parser.add_argument_group("mode uml")
    uml.add_argument("--rw", action="append", default=[], type=Path, metavar="DIR", help="keep DIR writable too")
    uml.add_argument("--ro", action="append", default=[], type=Path, metavar="DIR", help="keep DIR of a hidden folder")
    uml.add_argument("--hide", default="/tmp,/var/tmp", metavar="DIRS", help="folders shown empty (/tmp,/var/tmp)")
    uml.add_argument("--root", dest="as_caller", action="store_false", help="be root in the guest as an ordinary user")
    uml.add_argument("--stdin", action="store_true", help="read standard input to its end and hand it to CMD")
    uml.add_argument("--mem", dest="memory", type=memory, default=memory("512M"), metavar="SIZE", help="RAM (512M)")
    uml.add_argument("--cpu", default="auto", help="CPU the guest is pinned to: auto, none or a number")
    uml.add_argument("--boot-timeout", type=float, default=60.0, metavar="S", help="seconds to boot (60)")
    uml.add_argument("--retries", type=int, default=1, metavar="N", help="boots after one that failed (1)")
    uml.add_argument("--uml", default="linux.uml", metavar="FILE", help="the kernel to boot (linux.uml)")
    uml.add_argument("--karg", action="append", default=[], metavar="ARG", help="further kernel argument")
    uml.add_argument("--times", action="store_true", help="say how long boot, command and halt took")
    return parser


def main(arguments: list[str]) -> int:
    """Runs the command that follows `--`; returns the exit status. Mode native replaces this process."""
    split = arguments.index("--") if "--" in arguments else len(arguments)
    parser = make_parser()
    options = Options(**vars(parser.parse_args(arguments[:split])), command=arguments[split + 1 :])

    namespace = native.find_namespace() if options.mode != "uml" else None
    kernel = shutil.which(options.uml)
    if options.mode == "which":
        print("native" if namespace else "uml" if kernel else "none")
        return 0 if namespace or kernel else EXIT_RIG
    if not options.command:
        parser.error("there is no command: with-vcan [options] -- CMD ARGS...")
    if namespace:
        native.run(namespace, options)
    if options.mode == "native":
        log("this kernel cannot make a vcan interface for this user")
        return EXIT_RIG
    if kernel is None:
        log(f"this kernel has no vcan, and there is no {options.uml}: apt-get install user-mode-linux")
        return EXIT_RIG
    return run_uml(kernel, options)
