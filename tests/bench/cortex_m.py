# SPDX-License-Identifier: MIT
"""Counts instructions and stack on an emulated Cortex-M4 (unicorn)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import unicorn
from elftools.elf.elffile import ELFFile
from unicorn import arm_const

CODE_START, CODE_SIZE = 0x0000_0000, 0x0010_0000
DATA_START, DATA_SIZE = 0x2000_0000, 0x0040_0000
STACK_TOP = DATA_START + DATA_SIZE
# An address that holds no code of the program: the call returns there.
RETURN_TO = CODE_START + CODE_SIZE - 4


@dataclass(frozen=True)
class Tick:
    """One call of canopy_tree_tick()."""

    instructions: int
    leaf_calls: int
    stack: int  # [bytes], the leaves' own included; those of the workloads have none


class Core:
    """A core with a program of build.link_bare() in its memory."""

    def __init__(self, program: Path) -> None:
        self._machine = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
        self._machine.ctl_set_cpu_model(arm_const.UC_CPU_ARM_CORTEX_M4)
        self._machine.mem_map(CODE_START, CODE_SIZE)
        self._machine.mem_map(DATA_START, DATA_SIZE)
        with program.open("rb") as file:
            elf = ELFFile(file)
            for segment in elf.iter_segments("PT_LOAD"):
                self._machine.mem_write(segment["p_vaddr"], segment.data())
            table = elf.get_section_by_name(".symtab")
            self._symbols = {symbol.name: int(symbol["st_value"]) for symbol in table.iter_symbols()}

    def build(self, workload: int, n: int) -> int:
        """Calls bench_build(). Returns the number of nodes."""
        return self.call("bench_build", workload, n)

    def tick(self, now: int, count: bool = True) -> Tick:
        """Calls canopy_tree_tick() at `now` [us].

        The stack goes down to the lowest stack pointer that a basic block starts with: a call starts a block, so every
        frame is seen that was there when something was called. Counting instructions is slow, some 500,000 a second.
        """
        calls = self._word("bench_leaf_calls")
        instructions = 0
        lowest = STACK_TOP

        def block(machine: unicorn.Uc, _address: int, _size: int, _data: object) -> None:
            nonlocal lowest
            lowest = min(lowest, machine.reg_read(arm_const.UC_ARM_REG_SP))

        def step(_machine: unicorn.Uc, _address: int, _size: int, _data: object) -> None:
            nonlocal instructions
            instructions += 1

        hooks = [self._hook(unicorn.UC_HOOK_BLOCK, block)]
        if count:
            hooks.append(self._hook(unicorn.UC_HOOK_CODE, step))
        # AAPCS: a 64-bit argument takes an even pair of registers, here r2 and r3.
        self.call("canopy_tree_tick", self._symbols["bench_instance"], 0, now & 0xFFFF_FFFF, now >> 32)
        for hook in hooks:
            self._machine.hook_del(hook)
        return Tick(instructions, self._word("bench_leaf_calls") - calls, STACK_TOP - lowest)

    def count(self, function: str, *arguments: int) -> tuple[int, int]:
        """Calls a function with arguments of 32 bit, four at most. Returns its result, and the instructions it took."""
        instructions = 0

        def step(_machine: unicorn.Uc, _address: int, _size: int, _data: object) -> None:
            nonlocal instructions
            instructions += 1

        hook = self._hook(unicorn.UC_HOOK_CODE, step)
        result = self.call(function, *arguments)
        self._machine.hook_del(hook)
        return result, instructions

    def count_parts(self, function: str, parts: Mapping[str, str], *arguments: int) -> dict[str, int]:
        """Calls a function. Returns the instructions of the whole of it, as "whole", and of its parts.

        `parts` names functions: function -> part. A part's instructions are those of its functions with all that they
        call; one that is called within another counts for both.
        """
        entries = {self._symbols[name] & ~1: part for name, part in parts.items()}
        counts = {"whole": 0, **dict.fromkeys(parts.values(), 0)}
        entered: list[tuple[str, int]] = []  # part, and where it returns to

        def step(machine: unicorn.Uc, address: int, _size: int, _data: object) -> None:
            while entered and entered[-1][1] == address:
                entered.pop()
            if address in entries:
                entered.append((entries[address], machine.reg_read(arm_const.UC_ARM_REG_LR) & ~1))
            counts["whole"] += 1
            for part, _ in entered:
                counts[part] += 1

        hook = self._hook(unicorn.UC_HOOK_CODE, step)
        self.call(function, *arguments)
        self._machine.hook_del(hook)
        return counts

    def address(self, symbol: str) -> int:
        """Where a variable lies."""
        return self._symbols[symbol]

    def build_stack(self, node_type: int, asked: bool) -> int:
        """Calls bench_stack_build(). Returns the number of nodes."""
        return self.call("bench_stack_build", node_type, int(asked))

    def worst_stack(self, ticks: int, period_us: int) -> int:
        """The most stack of so many ticks, and of a reset, which halts, after every fifth [bytes].

        Looks at the stack pointer before each instruction.
        """
        lowest = STACK_TOP

        def step(machine: unicorn.Uc, _address: int, _size: int, _data: object) -> None:
            nonlocal lowest
            lowest = min(lowest, machine.reg_read(arm_const.UC_ARM_REG_SP))

        hook = self._hook(unicorn.UC_HOOK_CODE, step)
        for number in range(ticks):
            self.call("canopy_tree_tick", self._symbols["bench_instance"], 0, number * period_us, 0)
            if number % 5 == 4:
                self.call("canopy_tree_reset", self._symbols["bench_instance"])
        self._machine.hook_del(hook)
        return STACK_TOP - lowest

    def _hook(self, kind: int, function: Callable[[unicorn.Uc, int, int, object], None]) -> int:
        """Adds a hook. What has run without it is translated again: it would go on without."""
        self._machine.ctl_flush_tb()
        return int(self._machine.hook_add(kind, function))

    def _word(self, symbol: str) -> int:
        return int.from_bytes(self._machine.mem_read(self._symbols[symbol], 4), "little")

    def call(self, function: str, *arguments: int) -> int:
        """Calls a function with arguments of 32 bit, four at most. Returns its result."""
        for register, value in enumerate(arguments):
            self._machine.reg_write(arm_const.UC_ARM_REG_R0 + register, value)
        self._machine.reg_write(arm_const.UC_ARM_REG_SP, STACK_TOP)
        self._machine.reg_write(arm_const.UC_ARM_REG_LR, RETURN_TO | 1)
        self._machine.emu_start(self._symbols[function] | 1, RETURN_TO)
        return int(self._machine.reg_read(arm_const.UC_ARM_REG_R0))
