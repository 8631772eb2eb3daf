# SPDX-License-Identifier: MIT
"""Small random DBC files with hostile texts and numbers in them."""

from __future__ import annotations

import random

from fuzz.generated.hostile import Hostile

CYCLES_OF_A_FAULT = [65535, 65536, 65537, 131072]
"""In periods: canopy_tx_message_t.every has 16 bits."""
_LENGTHS = [1, 1, 4, 7, 8, 8, 12, 16, 16, 31, 32, 33, 63, 64]
_SCALES = ["1", "1", "1", "0.1", "0.01", "2", "-1", "0.5"]
_DEFINITIONS = """BA_DEF_ BO_ "GenMsgCycleTime" INT -2147483648 2147483647;
BA_DEF_ BO_ "GenMsgTimeoutTime" FLOAT -1e30 1e30;
BA_DEF_ BO_ "E2EDataId" INT -1 65535;
BA_DEF_ SG_ "GenSigInactiveValue" INT -2147483648 2147483647;
"""


class BusMaker:
    """One DBC. `inputs` and `outputs` are the signals, as scripts name them."""

    def __init__(self, rng: random.Random, hostile: Hostile, period_ms: int) -> None:
        self._rng = rng
        self._hostile = hostile
        self._period_ms = period_ms
        self.inputs: list[str] = []
        self.outputs: list[str] = []
        self._messages = ""
        self._tail = ""
        for number in range(rng.randint(1, 2)):
            self._message(f"In{number}", 0x100 + number, sent=False)
        for number in range(rng.randint(0, 2)):
            self._message(f"Out{number}", 0x200 + number, sent=True)

    def dbc(self) -> str:
        """The whole file."""
        period = self._period_ms
        defaults = (
            f'BA_DEF_DEF_ "GenMsgCycleTime" {self._hostile.integer(self._rng.choice([period, 5 * period]), 0.02)};\n'
            f'BA_DEF_DEF_ "GenMsgTimeoutTime" {self._hostile.integer(0, 0.02)};\n'
            f'BA_DEF_DEF_ "E2EDataId" -1;\nBA_DEF_DEF_ "GenSigInactiveValue" 0;\n'
        )
        attributes = "".join(line for line in self._tail.splitlines(keepends=True) if line.startswith("BA_ "))
        tables = self._tail.replace(attributes, "") if attributes else self._tail
        other = "".join(line for line in tables.splitlines(keepends=True) if not line.startswith("BA_ "))
        comments = "".join(part for part in self._comments)
        head = f'VERSION "{self._quoted("1")}"\nBU_: Controller Robot\n\n'
        return head + self._messages + comments + _DEFINITIONS + defaults + attributes + other

    @property
    def _comments(self) -> list[str]:
        rng = self._rng
        names = [*self.inputs, *self.outputs]
        ids = {"In0": 0x100, "In1": 0x101, "Out0": 0x200, "Out1": 0x201}
        result = []
        for name in names:
            message, _, signal = name.partition(".")
            if rng.random() < 0.3:
                result.append(f'CM_ SG_ {ids[message]} {signal} "{self._quoted("a signal")}";\n')
            if rng.random() < 0.2:
                result.append(f'CM_ BO_ {ids[message]} "{self._quoted("a message")}";\n')
        return result

    def _quoted(self, plain: str) -> str:
        return self._hostile.text(plain).replace("\\", "\\\\").replace('"', '\\"')

    def _message(self, name: str, identifier: int, *, sent: bool) -> None:
        rng, hostile = self._rng, self._hostile
        sender, receiver = ("Controller", "Robot") if sent else ("Robot", "Controller")
        at, lines, protected = 0, "", rng.random() < 0.25
        if protected:
            lines = (
                f' SG_ E2E_CRC : 0|8@1+ (1,0) [0|255] "" {receiver}\n'
                f' SG_ E2E_Counter : 8|4@1+ (1,0) [0|14] "" {receiver}\n'
            )
            self._tail += f'BA_ "E2EDataId" BO_ {identifier} {hostile.integer(identifier)};\n'
            at = 16
        for number in range(rng.randint(1, 4)):
            length = rng.choice([n for n in _LENGTHS if at + n <= 64] or [0])
            if not length:
                break
            lines += self._signal(name, identifier, f"S{number}", at, length, receiver)
            (self.outputs if sent else self.inputs).append(f"{name}.S{number}")
            at += length
        self._messages += (
            f"BO_ {hostile.integer(identifier, 0.01)} {name}: {hostile.integer(8, 0.02)} {sender}\n{lines}\n"
        )
        if rng.random() < 0.15:
            faulty = rng.random() < 0.6
            factor = rng.choice(CYCLES_OF_A_FAULT) if faulty else rng.randint(1, 4)
            self._tail += f'BA_ "GenMsgCycleTime" BO_ {identifier} {hostile.integer(factor * self._period_ms)};\n'
        if rng.random() < 0.15:
            self._tail += f'BA_ "GenMsgTimeoutTime" BO_ {identifier} {hostile.integer(500, 0.3)};\n'

    def _signal(self, message: str, identifier: int, name: str, at: int, length: int, receiver: str) -> str:
        rng, hostile = self._rng, self._hostile
        sign = rng.choice("+-")
        ranged = rng.random() < 0.4
        scale = hostile.integer("1" if ranged else rng.choice(_SCALES), 0.03)
        offset = hostile.integer(0 if ranged else rng.choice([0, 0, -40]), 0.03)
        low, high = ("0", str(rng.randint(1, 100))) if ranged and length > 1 else ("0", "0")
        ends = f"{hostile.integer(low, 0.03)}|{hostile.integer(high, 0.03)}"
        start, size = hostile.integer(at, 0.01), hostile.integer(length, 0.01)
        unit = self._quoted(rng.choice(["", "m", "%"]))
        if rng.random() < 0.2:
            values = [hostile.integer(value) for value in range(3)]
            table = " ".join(f'{value} "{self._quoted(f"Value {value}")}"' for value in values)
            self._tail += f"VAL_ {identifier} {name} {table} ;\n"
        if rng.random() < 0.2:
            self._tail += f'BA_ "GenSigInactiveValue" SG_ {identifier} {name} {hostile.integer(0, 0.3)};\n'
        return f' SG_ {name} : {start}|{size}@1{sign} ({scale},{offset}) [{ends}] "{unit}" {receiver}\n'
