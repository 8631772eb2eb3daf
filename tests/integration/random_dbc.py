# SPDX-License-Identifier: MIT
"""Random DBC files with every feature.

Byte orders, signs, lengths, scales, ranges, value tables, floats, CAN FD, extended ids, and multiplexed signals, simple
and nested, with ranges of values.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field

HEAD = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: Controller Robot\n\n'
ATTRIBUTES = """
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","J1939PG","r4","r5","r6","r7","r8","r9","r10","r11","r12","r13","StandardCAN_FD","ExtendedCAN_FD";
BA_DEF_ SG_ "GenSigInactiveValue" INT -2147483648 2147483647;
BA_DEF_DEF_ "GenMsgCycleTime" 50;
BA_DEF_DEF_ "VFrameFormat" "StandardCAN";
"""  # noqa: E501
SCALES = [("1", "0"), ("0.5", "10"), ("0.01", "-40"), ("2", "0"), ("-0.25", "3"), ("0.001", "0")]
LENGTHS = [1, 2, 3, 5, 8, 9, 12, 16, 17, 24, 31, 32, 33, 40, 63, 64]


@dataclass
class RandomSignal:
    """What was written to the DBC. `low` and `high` are the raw range; for a float, the range of the number."""

    name: str
    bits: int
    signed: bool
    kind: str
    scale: str
    offset: str
    low: float
    high: float
    choices: dict[int, str] = field(default_factory=dict)


@dataclass
class RandomMessage:
    """What was written to the DBC."""

    name: str
    length: int
    signals: dict[str, RandomSignal]


class _Writer:
    """One message in the making. Bits are given away once, but the branches of a multiplexer share theirs."""

    def __init__(self, rng: random.Random, number: int) -> None:
        self.rng = rng
        self.number = number
        self.fd = rng.random() < 0.2
        self.length = rng.choice([8, 12, 16, 20, 24, 32, 48, 64]) if self.fd else rng.randint(1, 8)
        self.extended = rng.random() < 0.3
        self.id = (0x80000000 | (0x10000 + 8 * number)) if self.extended else 0x100 + number
        self.lines: list[str] = []
        self.tail: list[str] = []
        self.signals: dict[str, RandomSignal] = {}
        self.free = set(range(8 * self.length))

    def place(self, bits: int, free: set[int]) -> tuple[int, int, set[int]] | None:
        """(byte order, start, bits used) of a free place. A Motorola signal starts at its top bit."""
        for _ in range(8):
            order = self.rng.choice([0, 1])
            start = self.rng.randrange(8 * self.length)
            if order == 1:
                used = set(range(start, start + bits))
            else:
                top = 8 * (start // 8) + 7 - start % 8
                used = {8 * (p // 8) + 7 - p % 8 for p in range(top, top + bits)}
            if used <= free:
                return order, start, used
        return None

    def signal(self, free: set[int], marker: str = "", bits: int = 0, *, mux: bool = False) -> RandomSignal | None:
        """Adds a signal if there is room for it."""
        rng = self.rng
        kind = "int" if mux or rng.random() < 0.85 else rng.choice(["float", "double"])
        bits = bits or {"float": 32, "double": 64}.get(kind, min(rng.choice(LENGTHS), 8 * self.length))
        place = self.place(bits, free)
        if place is None:
            return None
        order, start, used = place
        free -= used
        signed = not mux and (kind != "int" or (bits > 1 and rng.random() < 0.5))
        scale, offset = ("1", "0") if mux else rng.choice(SCALES)
        result = RandomSignal(f"Signal{len(self.signals)}", bits, signed, kind, scale, offset, 0, 0)
        limits = self.limits(result, mux=mux)
        scale, offset = result.scale, result.offset
        self.signals[result.name] = result
        unit = rng.choice(["", "m", "%"])
        self.lines.append(
            f" SG_ {result.name}{marker} : {start}|{bits}@{order}{'-' if signed else '+'} ({scale},{offset}) "
            f'[{limits}] "{unit}" PEER\n'
        )
        if kind != "int":
            self.tail.append(f"SIG_VALTYPE_ {self.id} {result.name} : {1 if kind == 'float' else 2};\n")
        elif not mux and bits in (8, 12, 16) and rng.random() < 0.2:
            low = -(2 ** (bits - 1)) if signed else 0
            result.choices = {rng.randrange(low, low + 2**bits): f"Value {n}" for n in range(4)}
            table = " ".join(f'{value} "{text}"' for value, text in result.choices.items())
            self.tail.append(f"VAL_ {self.id} {result.name} {table} ;\n")
        return result

    def limits(self, signal: RandomSignal, *, mux: bool) -> str:
        """Chooses the range; the ends are exact in every unit."""
        rng = self.rng
        if signal.kind != "int":
            signal.low, signal.high = float("-inf"), float("inf")
            if rng.random() < 0.5:
                return "0|0"
            # Exact in binary, both the raw number and the physical one.
            signal.scale, signal.offset = rng.choice([("1", "0"), ("0.5", "2")])
            signal.low, signal.high = -float(rng.choice([0, 1, 8, 1024])), float(rng.choice([1, 64, 1e10]))
            ends = [end * float(signal.scale) + float(signal.offset) for end in (signal.low, signal.high)]
            return f"{ends[0]!r}|{ends[1]!r}"
        low = -(2 ** (signal.bits - 1)) if signal.signed else 0
        high = low + 2**signal.bits - 1
        signal.low, signal.high = low, high
        if mux or signal.bits > 40 or rng.random() < 0.5:
            return "0|0"
        ends = sorted(rng.randint(low, high) for _ in range(2))
        if ends[0] == ends[1]:
            return "0|0"
        signal.low, signal.high = ends
        scale, offset = (round(float(text) * 1000) for text in (signal.scale, signal.offset))
        thousandths = sorted(end * scale + offset for end in ends)
        return "|".join(f"{'-' if t < 0 else ''}{abs(t) // 1000}.{abs(t) % 1000:03d}" for t in thousandths)

    def branches(self, mux: RandomSignal, free: set[int], depth: int) -> None:
        """Adds the branches of a multiplexer: each has one or more of its values, and may have a multiplexer in it."""
        rng = self.rng
        values = rng.sample(range(2**mux.bits), min(2**mux.bits, rng.randint(2, 5)))
        left = [set(free) for _ in values]
        for value, room in zip(values, left, strict=True):
            for _ in range(rng.randint(1, 3)):
                nested = depth < 2 and rng.random() < 0.1
                if nested:
                    inner = self.signal(room, f" m{value}M", rng.choice([2, 4]), mux=True)
                    if inner is not None:
                        self.tail.append(f"SG_MUL_VAL_ {self.id} {inner.name} {mux.name} {value}-{value};\n")
                        self.branches(inner, room, depth + 1)
                    continue
                leaf = self.signal(room, f" m{value}")
                if leaf is None:
                    continue
                more = rng.choice([value, rng.choice(values)])
                if more != value and not self.fits(leaf, left[values.index(more)]):
                    more = value
                ranges = f"{value}-{value}" + (f", {more}-{more}" if more != value else "")
                self.tail.append(f"SG_MUL_VAL_ {self.id} {leaf.name} {mux.name} {ranges};\n")
        free.intersection_update(*left)

    def fits(self, signal: RandomSignal, room: set[int]) -> bool:
        """Takes the signal's bits from another branch, too, if they are free there."""
        start, order = self.lines[-1].split(" : ")[1].split("|")[0], self.lines[-1].split("@")[1][0]
        first = int(start)
        if order == "1":
            used = set(range(first, first + signal.bits))
        else:
            top = 8 * (first // 8) + 7 - first % 8
            used = {8 * (p // 8) + 7 - p % 8 for p in range(top, top + signal.bits)}
        if not used <= room:
            return False
        room -= used
        return True

    def message(self) -> None:
        rng = self.rng
        multiplexers = rng.choice([1, 1, 2]) if rng.random() < 0.35 else 0
        for _ in range(multiplexers):
            mux = self.signal(self.free, " M", rng.choice([2, 3, 8]), mux=True)
            if mux is not None:
                # Some bits for the branches, the others for what is always there.
                half = {bit for bit in self.free if bit < 4 * self.length} or set(self.free)
                room = half if multiplexers == 2 else {bit for bit in self.free if bit // 8 != self.length - 1}
                self.free -= room
                self.branches(mux, room, 0)
        for _ in range(rng.randint(0, 4)):
            self.signal(self.free)


def random_dbc(rng: random.Random, count: int) -> tuple[str, list[RandomMessage]]:
    """The text of a DBC, and what is in it. Controller and Robot send every other message."""
    text, tail, messages = HEAD, "", []
    for number in range(count):
        writer = _Writer(rng, number)
        writer.message()
        sender, peer = ("Robot", "Controller") if number % 2 else ("Controller", "Robot")
        text += f"BO_ {writer.id} Message{number}: {writer.length} {sender}\n"
        text += "".join(writer.lines).replace("PEER", peer) + "\n"
        tail += "".join(writer.tail)
        if writer.fd:
            tail = f'BA_ "VFrameFormat" BO_ {writer.id} {15 if writer.extended else 14};\n' + tail
        messages.append(RandomMessage(f"Message{number}", writer.length, writer.signals))
    attributes = [line for line in tail.splitlines(keepends=True) if line.startswith("BA_")]
    tables = [line for line in tail.splitlines(keepends=True) if line.startswith("VAL_")]
    types = [line for line in tail.splitlines(keepends=True) if line.startswith("SIG_VALTYPE_")]
    multiplexers = [line for line in tail.splitlines(keepends=True) if line.startswith("SG_MUL_VAL_")]
    return text + ATTRIBUTES + "".join(attributes + tables + types + multiplexers), messages
