# SPDX-License-Identifier: MIT
"""Which frames of a log each tick has taken, as CanopyInputs and CanopyArrivals tell: so many, with this check, so old.

Where the log's first frame is that the controller has taken, nobody says: the robot may have been sending for long. But
the checks of the first ticks fit at one place only, unless the frames before it are the same ones anyway.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from canopy.replay.log import LogError, Recording, Run, Taken
from canopy.replay.ticks import Tick, next_check

_AHEAD = 64
"""On a unixbus a frame may reach the log that much later than the controller's answer to it."""
_SURE_FRAMES = 4
"""So many frames with right checks are no accident: 1 in 2^32 is."""
_SURE_BEHIND = 2
"""So many more behind two that have changed places."""
_STARTS_MENDED = 16
_LOST_MAX = 255
_STEPS_LATER = 8
_TICKS_CUT = 2


@dataclass(frozen=True)
class _Step:
    """A tick that has taken frames."""

    tick: int
    frames: int
    before: int
    """The check before it."""
    told: Tick


class Inputs:
    """The frames of a log that a run's first `ticks` ticks have taken."""

    def __init__(self, recording: Recording, run: Run, ticks: int) -> None:
        """Finds them.

        Raises:
            LogError: The log has other frames than the controller has taken.
        """
        self.ticks = ticks
        """Ticks whose frames are all there: the log may end before those of the last one or two."""
        self.ages: list[dict[int, int]] = []
        """Of each tick the ages of the messages of which it has taken frames [ms], by their key."""
        self.reordered = 0
        """How often two frames of different senders had to change places: a unixbus has not one order for all."""
        self.unheard = 0
        """Frames of the log that never reached the controller, which was off the bus or overloaded, and said so."""
        self._path = recording.path
        self._run = run
        self._received = list(recording.received)
        self._steps = list(_steps(run, ticks))
        self._counts = [0] * ticks
        for step in self._steps:
            self._counts[step.tick] = step.frames
        self._start = self._find_start()
        del self._counts[self.ticks :]
        self.ages = [
            dict(zip(_messages(frames), tick.ages, strict=True)) for frames, tick in zip(self, run.ticks, strict=False)
        ]

    def __iter__(self) -> Iterator[tuple[Taken, ...]]:
        """The frames of each tick."""
        place = self._start
        for count in self._counts:
            yield tuple(self._received[place : place + count])
            place += count

    def __len__(self) -> int:
        return sum(self._counts)

    def _find_start(self) -> int:
        """The place of the first frame taken."""
        if not self._steps:
            return 0
        near = max(0, self._run.before - self._steps[0].frames)
        followed = []
        for start in self._candidates(near):
            steps = self._follow(start)
            if steps == len(self._steps):
                return start
            if steps:
                followed.append((steps, start))
        followed.sort(key=lambda found: -found[0])  # stable: of equals the most likely one
        error = None
        for steps, start in followed[:_STARTS_MENDED]:
            failure = self._mend_from(steps, start)
            if failure is None:
                return start
            if error is None and sum(step.frames for step in self._steps[:steps]) >= _SURE_FRAMES:
                error = failure
        raise error or LogError(
            f"{self._path}: the frames that the controller has taken in its first ticks are not in the log; start the "
            "record before the controller"
        )

    def _mend_from(self, steps: int, start: int) -> LogError | None:
        """Goes on behind so many steps that fit, and mends what can be mended. Else all is as before."""
        before = list(self._received), list(self._steps), list(self._counts)
        place = start + sum(step.frames for step in self._steps[:steps])
        self.reordered = self.unheard = 0
        for index in range(steps, len(self._steps)):
            if self._is_cut(index, place):
                break
            if not self._fits(index, place) and not self._mend(index, place):
                error = self._error(index, place)
                self._received, self._steps, self._counts = before
                return error
            place += self._steps[index].frames
        return None

    def _candidates(self, near: int) -> Iterator[int]:
        """Every place where the first frame may be, the most likely ones first."""
        yield near
        for distance in range(1, max(near, _AHEAD) + 1):
            if distance <= near:
                yield near - distance
            if distance <= _AHEAD and near + distance <= len(self._received):
                yield near + distance

    def _fits(self, index: int, place: int) -> bool:
        step = self._steps[index]
        frames = self._received[place : place + step.frames]
        if len(frames) != step.frames or len(_messages(frames)) != len(step.told.ages):
            return False
        check = step.before
        for frame in frames:
            check = next_check(check, frame.fold) if frame.fold is not None else check
        return step.told.check_of_ages(check) == step.told.check

    def _follow(self, place: int) -> int:
        """How many steps fit from the first one on, when the first of their frames is at `place`."""
        for done, step in enumerate(self._steps):
            if self._is_cut(done, place):
                break
            if not self._fits(done, place):
                return done
            place += step.frames
        return len(self._steps)

    def _is_cut(self, index: int, place: int) -> bool:
        """Does the log end before these frames, and the run soon after? Then the rest is left out."""
        step = self._steps[index]
        if len(self._counts) - step.tick > _TICKS_CUT or len(self._received) - place >= step.frames:
            return False
        self.ticks = step.tick
        return True

    def _mend(self, index: int, place: int) -> bool:
        """Finds what fits after all, and some further steps with it.

        That may be two neighbours of different senders that change places, or frames that never reached the controller.
        """
        for first in range(place, min(place + self._steps[index].frames, len(self._received) - 1)):
            a, b = self._received[first], self._received[first + 1]
            if a.sender != b.sender:
                self._received[first : first + 2] = b, a
                if self._is_sure(index, place, self._steps[index].frames + _SURE_BEHIND):
                    self.reordered += 1
                    return True
                self._received[first : first + 2] = a, b
        return self._has_told_losses(index) and self._skip(index, place)

    def _has_told_losses(self, index: int) -> bool:
        """Was the bus not as it should be in the tick, or in one since the last that took frames?"""
        first = self._steps[index - 1].tick + 1 if index else 0
        return any(tick.may_lack for tick in self._run.ticks[first : self._steps[index].tick + 1])

    def _skip(self, index: int, place: int) -> bool:
        """Leaves out frames that never reached the controller, where then this step and some further ones fit."""
        received = self._received
        for lost in range(1, _LOST_MAX + 1):
            for first in range(place, place + self._steps[index].frames):
                self._received = received[:first] + received[first + lost :]
                if self._is_sure(index, place, 2 * _SURE_FRAMES):
                    self.unheard += lost
                    return True
        self._received = received
        return False

    def _is_sure(self, index: int, place: int, wanted: int) -> bool:
        """Do this step and further ones fit, with so many frames, or to the end?"""
        frames = 0
        for last in range(index, len(self._steps)):
            if frames >= wanted:
                break
            if place < 0 or not self._fits(last, place):
                return False
            place += self._steps[last].frames
            frames += self._steps[last].frames
        return True

    def _error(self, index: int, place: int) -> LogError:
        step = self._steps[index]
        tick = self._run.ticks[step.tick].number
        after = place + step.frames
        first = self._received[place].place if place < len(self._received) else "the end"
        where = f"{self._path}: tick {tick}, from frame {first} on: "
        cut = f"; --ticks {step.tick} replays the ticks before it" if step.tick else ""
        if after > len(self._received):
            return LogError(f"{where}the log ends before all frames that the controller has taken{cut}")
        lost = self._find_again(index, place)
        if lost is None:
            return LogError(f"{where}the log has other frames than the controller has taken{cut}")
        if lost > 0:
            return LogError(
                f"{where}the controller has not taken {lost} of the frames that the log has: its CAN driver lost them"
                + cut
            )
        if lost < 0:
            return LogError(f"{where}the log lacks {-lost} of the frames that the controller has taken{cut}")
        last = self._received[after - 1].place
        return LogError(
            f"{where}frames {first} to {last} are not those that the controller has taken: their bytes or their order "
            f"are others{cut}"
        )

    def _find_again(self, index: int, place: int) -> int | None:
        """By how many frames the log is ahead of the controller, once the steps fit again; None: they do not."""
        sizes = (0, *(sign * size for size in range(1, _LOST_MAX + 1) for sign in (1, -1)))
        for later in range(index + 1, min(index + 1 + _STEPS_LATER, len(self._steps) + 1)):
            place += self._steps[later - 1].frames
            for lost in sizes:
                if self._is_sure(later, place + lost, 2 * _SURE_FRAMES):
                    return lost
        return None


def _messages(frames: Iterable[Taken]) -> list[int]:
    """Of which messages frames are, in the order of the controller's table: standard ids first."""
    return sorted({frame.message for frame in frames})


def _steps(run: Run, ticks: int) -> Iterator[_Step]:
    check = 0
    for place, tick in enumerate(run.ticks[:ticks]):
        if tick.frames:
            yield _Step(place, tick.frames, check, tick)
        check = tick.check
