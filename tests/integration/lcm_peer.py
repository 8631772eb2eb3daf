# SPDX-License-Identifier: MIT
"""The other end of LCM in tests, as a process: run it inside an LcmNetwork.

    python lcm_peer.py listen URL SECONDS CHANNEL=TYPE...   one JSON object a message: {"channel": …, fields…}
    python lcm_peer.py send URL CHANNEL TYPE JSON           one message; fields that JSON does not name stay 0

`listen` first prints {"listening": true}: what is sent from then on is heard.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from importlib import import_module
from typing import Any

import lcm


def message_type(name: str) -> Any:
    """The generated class of the type, e.g. tree_status_t."""
    return getattr(import_module(f"canopy_msgs.{name}"), name)


def listen(url: str, seconds: float, channels: list[str]) -> None:
    link = lcm.LCM(url)
    for channel, name in (item.split("=") for item in channels):
        link.subscribe(channel, printer(message_type(name))).set_queue_capacity(0)
    print(json.dumps({"listening": True}), flush=True)
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        link.handle_timeout(max(1, int(left * 1000)))


def printer(kind: Any) -> Callable[[str, bytes], None]:
    def show(channel: str, data: bytes) -> None:
        message = kind.decode(data)
        print(json.dumps({"channel": channel, **{name: getattr(message, name) for name in kind.__slots__}}), flush=True)

    return show


def send(url: str, channel: str, name: str, fields: str) -> None:
    message = message_type(name)()
    for field, value in json.loads(fields).items():
        setattr(message, field, value)
    lcm.LCM(url).publish(channel, message.encode())


if __name__ == "__main__":
    if sys.argv[1] == "listen":
        listen(sys.argv[2], float(sys.argv[3]), sys.argv[4:])
    else:
        send(*sys.argv[2:6])
