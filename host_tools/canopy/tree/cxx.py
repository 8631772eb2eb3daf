# SPDX-License-Identifier: MIT
"""C++ types and values as models have them, in the words that Canopy's own types and literals have."""

from __future__ import annotations

import re

from canopy.compiler.names import snake

LIST_CAPACITY = 16
"""How many items a std::vector<T> can hold that no --type-map gives a capacity."""

_WRAPPERS = re.compile(r"(?:std::)?optional<(?P<optional>.+)>")
_ALLOCATOR = re.compile(r"_<(?:std::)?allocator<void>>|,(?:std::)?allocator<[^<>]*(?:<[^<>]*>)?[^<>]*>")
_LISTS = re.compile(
    r"(?:std::)?(?:vector|deque|list)<(?P<item>[^<>]*(?:<[^<>]*>)?)>|"
    r"(?:BT::)?SharedQueue<(?P<shared>[^<>]+)>|(?:std::)?shared_ptr<(?:std::)?deque<(?P<queue>[^<>]+)>>"
)
ITEMS = ("bool", "int", "float", "text")


def without_allocators(name: str) -> str:
    """`Pose` of `Pose_<std::allocator<void>>`, as the messages of ROS are called by compilers; likewise of lists."""
    shorter = _ALLOCATOR.sub("", name)
    while shorter != name:
        name, shorter = shorter, _ALLOCATOR.sub("", shorter)
    return name


def without_optional(name: str) -> str:
    """`T` of std::optional<T>: what is not given is 0, false or NULL."""
    match = _WRAPPERS.fullmatch(name)
    return match["optional"] if match else name


def list_item(name: str) -> str | None:
    """The item's type of a std::vector, std::deque or BT::SharedQueue; None for another type."""
    match = _LISTS.fullmatch(name)
    return (match["item"] or match["shared"] or match["queue"]) if match else None


def c_type_of(name: str) -> str:
    """The C type that stands for a C++ type in the user's header: `nav_msgs_path_t` of `nav_msgs::Path`."""
    return f"{snake(name).strip('_')}_t"


_LIMIT = re.compile(
    r"(?:(?:std::)?numeric_limits<(?P<type>[^>]*)>::)?(?P<sign>[+-]?)(?P<what>infinity|inf|max|min|lowest)\(\)"
)
_WORDS = {"inf": "inf", "infinity": "inf", "+inf": "inf", "-inf": "-inf", "-infinity": "-inf"}


def limit_of(text: str) -> str | None:
    """`inf`, `max`, `min` or `lowest`, with a sign, of `std::numeric_limits<T>::max()` and the like; else None."""
    stripped = text.strip()
    if stripped.lower() in _WORDS:
        return _WORDS[stripped.lower()]
    sign, _, rest = ("-", "", stripped[1:]) if stripped.startswith("-") else ("", "", stripped)
    match = _LIMIT.fullmatch(rest.strip())
    if match is None:
        return None
    what = "inf" if match["what"].startswith("inf") else match["what"]
    return f"{sign or match['sign'].strip('+')}{what}"
