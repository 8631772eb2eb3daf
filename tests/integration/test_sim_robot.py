# SPDX-License-Identifier: MIT
"""canopy_sim's parts in one process, where time is a number: E2E, freshness, the desk's commands, the loops' timers."""

from __future__ import annotations

import threading
import time
from fractions import Fraction
from pathlib import Path

import can
import pytest
from e2e.p11 import e2e_p11_protect

from canopy_sim.deeds import Deed, Kind
from canopy_sim.e2e import Checker, Protector
from canopy_sim.messages import RobotMessages, load_messages
from canopy_sim.plant import Plant
from canopy_sim.process import Simulation, _Timer
from canopy_sim.robot import Robot
from integration.sim_peers import DBC, TICK, TICK_ID

POWER_COMMAND = 0x200
DO_TASK = 1


@pytest.fixture
def messages() -> RobotMessages:
    return load_messages(DBC)


@pytest.fixture
def plant() -> Plant:
    return Plant()


@pytest.fixture
def robot(messages: RobotMessages, plant: Plant) -> Robot:
    return Robot(messages, plant)


def protected(counter: int, mode: int = DO_TASK, data_id: int = POWER_COMMAND) -> bytearray:
    data = bytearray([0, counter, mode])
    e2e_p11_protect(data, data_id, increment_counter=False)
    return data


def power_command(counter: int, mode: int = DO_TASK) -> can.Message:
    return can.Message(arbitration_id=POWER_COMMAND, is_extended_id=False, data=protected(counter, mode))


@pytest.mark.parametrize("delta", range(15))
def test_counter_may_move_by_one_to_three(delta: int) -> None:
    for first in range(15):
        checker = Checker(POWER_COMMAND)
        assert checker.check(bytes(protected(first))) is None
        second = (first + delta) % 15
        expected = "repeated" if delta == 0 else None if delta <= 3 else "sequence"
        assert checker.check(bytes(protected(second))) == expected
        assert checker.check(bytes(protected((second + 1) % 15))) is None


def test_wrong_crc_and_counter_15_leave_the_checker_as_it_was() -> None:
    checker = Checker(POWER_COMMAND)
    assert checker.check(bytes(protected(3))) is None
    assert checker.check(bytes(protected(4, data_id=POWER_COMMAND + 1))) == "crc"
    assert checker.check(bytes(protected(15))) == "crc"
    assert checker.check(bytes(protected(3))) == "repeated"


def test_protector_counts_0_to_14_and_keeps_the_other_half_byte() -> None:
    protector = Protector(POWER_COMMAND)
    counters = []
    for _ in range(17):
        data = bytearray([0, 0xA7, 2])
        protector.protect(data)
        assert Checker(POWER_COMMAND).check(bytes(data)) is None
        assert data[1] >> 4 == 0xA
        counters.append(data[1] & 0x0F)
    assert counters == [*range(15), 0, 1]


def test_values_are_rounded_down_and_stop_at_the_ends_of_their_range(messages: RobotMessages) -> None:
    def shown(level: Fraction, distance: Fraction) -> tuple[int, int]:
        data = messages.battery.frame({"Level": level, "ChargerDistance": distance}).data
        return int.from_bytes(data[2:4], "little"), int.from_bytes(data[4:7], "little", signed=True)

    assert shown(Fraction(503, 10), Fraction(999, 10000)) == (503, 99)
    assert shown(Fraction(0), Fraction(-1, 10000)) == (0, -1)
    assert shown(Fraction(-1), Fraction(-11)) == (0, -10_000)
    assert shown(Fraction(111), Fraction(201)) == (1100, 200_000)


@pytest.mark.parametrize(("timeout", "cycle", "expected"), [(300, 50, 0.3), (0, 50, 0.25), (0, 0, None)])
def test_timeout_is_five_cycles_unless_given(timeout: int, cycle: int, expected: float | None, tmp_path: Path) -> None:
    text = DBC.read_text()
    for attribute, old, new in (("GenMsgTimeoutTime", 500, timeout), ("GenMsgCycleTime", 50, cycle)):
        line = f'BA_ "{attribute}" BO_ 512 '
        assert f"{line}{old};" in text
        text = text.replace(f"{line}{old};", f"{line}{new};")
    dbc = tmp_path / "timeout.dbc"
    dbc.write_text(text)
    messages = load_messages(dbc)
    assert messages.power_command.timeout == expected
    robot = Robot(messages, Plant())
    robot.receive(power_command(0), 0.0)
    robot.expire(1e9)
    assert robot.timeouts == (expected is not None)


def test_a_command_holds_until_its_timeout(robot: Robot) -> None:
    def acts() -> tuple[bool, str]:
        return robot.state.stopped, robot.state.power_mode.name

    assert acts() == (True, "Stop")
    robot.receive(power_command(0), 10.0)
    robot.expire(10.499)
    assert acts() == (False, "DoTask")
    robot.expire(10.5)
    robot.expire(11.0)
    assert acts() == (True, "Stop")
    assert robot.timeouts == 1


def test_in_lock_step_a_command_holds_for_its_step_however_late_the_step_is(robot: Robot, plant: Plant) -> None:
    robot.receive(power_command(0), 0.0)
    robot.expire(9.0)
    robot.lock_step(10.0)
    assert plant.battery == 499
    robot.lock_step(20.0)
    assert plant.battery == 499
    assert robot.phases == [("DoTask", "Stop", 1), ("Stop", "Stop", 1)]


def test_real_time_makes_a_power_step_every_tenth_step(robot: Robot, plant: Plant) -> None:
    robot.receive(power_command(0), 0.0)
    for step in range(1, 31):
        robot.real_time_step(0.0)
        assert plant.battery == 500 - step // 10


def test_set_state_is_all_or_nothing(robot: Robot, plant: Plant) -> None:
    refused = [
        Deed(Kind.SET_STATE, battery=200, head_x=0.1),
        Deed(Kind.SET_STATE, battery=20, head_height=-0.1),
        Deed(Kind.SET_STATE, battery=20, charger_distance=float("inf")),
        Deed(Kind.SET_STATE, battery=20, charger_distance=1e300),
    ]
    for command in refused:
        with pytest.raises(ValueError, match="out of range"):
            robot.execute(command)
        assert (plant.distance_mm, plant.battery) == (80_000, 500)
        assert (plant.head_x_mm, plant.head_height_mm) == (500, 0)
    robot.execute(Deed(Kind.SET_STATE, battery=19.9, charger_distance=0.3, head_x=0.29, head_height=0.48))
    assert (plant.distance_mm, plant.battery) == (300, 199)
    assert (plant.head_x_mm, plant.head_height_mm) == (290, 480)
    assert robot.minimum_battery == 199


@pytest.mark.parametrize(("base", "extended"), [(0x600, False), (0x700, False), (0x18FF0000, True)])
def test_a_tick_of_the_controllers_trace_is_known_by_its_id_its_form_and_its_version(base: int, extended: bool) -> None:
    robot = Robot(load_messages(DBC, base), Plant())

    def takes(identifier: int, data: bytes, **more: bool) -> bool:
        form = {"is_extended_id": extended, **more}
        return robot.receive(can.Message(arbitration_id=identifier, data=data, **form), 0.0)

    assert takes(base, TICK)
    assert not takes(base, TICK, is_extended_id=not extended)
    assert not takes(base, TICK[:7])
    assert not takes(base, bytes([0, 0x30, *TICK[2:]]))
    assert not takes(base, bytes(8))  # as it was before there was a version
    assert not takes(base + 7, TICK)
    assert not takes(base + 8, TICK)
    assert {name: count for name, count in robot.refused.items() if count} == {"flags": 1, "length": 1, "version": 2}
    assert (robot.accepted, robot.ignored, robot.unknown) == (1, 1, 1)


def test_error_frames_are_counted_apart(robot: Robot) -> None:
    robot.receive(
        can.Message(arbitration_id=POWER_COMMAND, is_error_frame=True, is_extended_id=False, data=bytes(8)), 0
    )
    assert (robot.error_frames, robot.accepted, robot.unknown) == (1, 0, 0)


def test_a_late_timer_skips_and_stays_on_its_grid() -> None:
    calls: list[float] = []
    timer = _Timer(period=0.5, action=calls.append, due=1.0)
    timer.run(1.1)
    assert (timer.due, timer.slips) == (1.5, 0)
    timer.run(3.2)  # due were 1.5, 2.0, 2.5, 3.0
    assert (timer.due, timer.slips) == (3.0, 2)
    timer.run(3.2)
    assert (timer.due, timer.slips, len(calls)) == (3.5, 2, 3)


def test_a_robot_that_sends_no_sensors_still_gives_the_steps(robot: Robot, messages: RobotMessages) -> None:
    """STOP_SENDING is a fault of the sensors; SimulationStep is the clock of the simulation."""
    robot.execute(Deed(Kind.STOP_SENDING))
    tick = can.Message(arbitration_id=TICK_ID, is_extended_id=False, data=TICK)
    with can.Bus("sim", interface="virtual") as bus, can.Bus("sim", interface="virtual") as peer:
        simulation = Simulation(bus, messages, robot, steps=2)
        thread = threading.Thread(target=simulation.run_lock_step)
        thread.start()
        for number in range(2):
            frame = peer.recv(5)
            assert frame is not None
            assert frame.arbitration_id == messages.simulation_step.arbitration_id
            assert frame.data == number.to_bytes(4, "little")
            peer.send(tick)
        thread.join(5)
        assert not thread.is_alive()
    assert simulation.sent == 2


def test_lock_step_repeats_on_a_bus_full_of_other_frames(robot: Robot, messages: RobotMessages) -> None:
    foreign = can.Message(arbitration_id=0x123, is_extended_id=False, data=bytes(8))
    with can.Bus("busy", interface="virtual") as bus, can.Bus("busy", interface="virtual") as peer:
        simulation = Simulation(bus, messages, robot)
        thread = threading.Thread(target=simulation.run_lock_step)
        thread.start()
        end = time.monotonic() + 0.6
        while time.monotonic() < end:
            peer.send(foreign)
            time.sleep(0.005)
        simulation.stop()
        thread.join(5)
        assert not thread.is_alive()
    assert simulation.repeats in (1, 2)


class FullBus(can.BusABC):
    """A bus whose transmit buffer is full, or which is down."""

    channel_info = "full"

    def __init__(self, error: Exception) -> None:
        super().__init__(channel="full")
        self.error = error

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise self.error

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        return can.Message(arbitration_id=TICK_ID, is_extended_id=False, data=TICK), False


def test_a_full_transmit_buffer_drops_and_goes_on(robot: Robot, messages: RobotMessages) -> None:
    for error in (can.CanOperationError("Transmit buffer full"), can.CanOperationError("Failed to transmit", 105)):
        with FullBus(error) as bus:
            simulation = Simulation(bus, messages, robot, steps=robot.steps + 1)
            simulation.run_lock_step()
            assert (simulation.sent, simulation.dropped) == (0, 3)


def test_a_step_of_lock_step_is_quick(messages: RobotMessages, plant: Plant) -> None:
    """The robot's part of a tick, beside the controller's and the bus's: CPU of this process, best of five."""
    took = []
    for _ in range(5):
        robot = Robot(messages, plant)
        begin = time.process_time()
        for number in range(1000):
            robot.frame("Battery")
            robot.frame("Posture")
            messages.simulation_step.frame({"Step": number})
            robot.receive(power_command(number % 15), 0.0)
            robot.lock_step(0.0)
        took.append(time.process_time() - begin)
        assert robot.steps == 1000
    assert min(took) < 0.1  # 18 us a tick where nothing else runs
