"""A move asked of the planner, seen in its own direction and from where mass 1 begins."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stickslip.planning.series.arm_motion import ArmMotion, steps_per_sample
from stickslip.planning.series.bounds import overshoots, swing_time
from stickslip.planning.series.programme import Programme
from stickslip.planning.series.search import Solution, solve
from stickslip.plants import FlexibleArm

__all__ = ["FEWEST_PULSES", "LITTLE_WORK", "MUCH_WORK", "Move", "Search"]

MUCH_WORK, LITTLE_WORK = 4e5, 4e4
"""Entries in the matrices of one search for efforts: to prove what can be proven, and to find some;
about a microsecond each."""

FEWEST_PULSES = 4
"""One for each of the four states to be met."""

_CLEARANCE = 1e-6  # of the effort limit: between an effort and what it must exceed
_LONGEST = 10.0  # times the rough guess of the shortest time: longer ones are not tried
_TRIALS, _ROUGHLY = 8, 0.01  # of the number of pulses, before it is made sure
_FIRST_STRIDE = 64  # part of the rough number of pulses
_STRIDES = 3
_PROOFS = 3  # at most
_ANY_GAP = 1.0  # of the cost: any solution will do
_FREEING = 64  # pulses within which mass 1, once freed, comes to rest again
_ROUNDING = 1e-6  # of a pulse


@dataclass(frozen=True, kw_only=True)
class Search:
    """How a search for the fewest pulses ended.

    Attributes
    ----------
    pulses
        The fewest that were found to do, or the most that were tried.
    solution
        With so many; None if there is none.
    least
        With fewer there is proven to be none.
    """

    pulses: int
    solution: Solution | None
    least: int


@dataclass(frozen=True, kw_only=True)
class Move:
    """What is asked for: forward along the direction, from the position 0 of mass 1.

    Attributes
    ----------
    arm
        Masses, spring and friction; the friction's positive side is that of the move.
    sampling_time
        [s].
    pulse_samples
        Samples in each pulse.
    effort_limit
        [N or N m].
    slowest
        Least speed of mass 1 on the way, as a share of the mean [-].
    start
        State at the begin.
    way
        To the target, positive [m or rad].
    """

    arm: FlexibleArm
    sampling_time: float
    pulse_samples: int
    effort_limit: float
    slowest: float
    start: tuple[float, float, float, float]
    way: float

    @property
    def pulse_width(self) -> float:
        """How long each pulse is held [s]."""
        return self.pulse_samples * self.sampling_time

    @property
    def breakaway(self) -> float:
        """The effort that the first must exceed; minus infinity if mass 1 moves already."""
        if self.start[1] > 0:
            return -math.inf
        law = self.arm.friction
        held = law.static_friction_positive + law.offset
        return held - self.arm.stiffness * (self.start[2] - self.start[0])

    @property
    def frees(self) -> bool:
        """Whether an effort within the limit frees mass 1."""
        return self.breakaway < self.effort_limit * (1.0 - 3.0 * _CLEARANCE)

    def programme(self, pulses: int) -> Programme:
        """Return the linear programme of so many pulses."""
        law = self.arm.friction
        resistance = law.coulomb_friction_positive + law.offset
        parts = steps_per_sample(self.arm, self.sampling_time)
        per_pulse = self.pulse_samples * parts
        clearance = _CLEARANCE * self.effort_limit
        limit = self.effort_limit - clearance
        lowest, highest = np.full(pulses, -limit), np.full(pulses, limit)
        lowest[0] = min(max(-limit, self.breakaway + clearance), limit)
        # At the end mass 1 comes to rest from forward motion with the spring relaxed.
        highest[-1] = min(limit, resistance - clearance)
        return Programme(
            motion=ArmMotion(
                arm=self.arm,
                resistance=resistance,
                viscous_friction=law.viscous_friction_positive,
                step=self.sampling_time / parts,
                steps=pulses * per_pulse,
                start=np.array(self.start),
            ),
            pulses=pulses,
            steps_per_pulse=per_pulse,
            target=self.way,
            effort_limit=self.effort_limit,
            lowest=lowest,
            highest=highest,
            least_velocity=self.slowest * self.way / (pulses * self.pulse_width),
        )

    @cached_property
    def fewest(self) -> int:
        """So many pulses it takes at least, by the swing of mass 2 alone; 0 if none are enough."""
        time = swing_time(self.arm, self.start, self.way) / self.pulse_width
        return max(FEWEST_PULSES, math.ceil(time - _ROUNDING)) if math.isfinite(time) else 0

    @cached_property
    def frees_too_far(self) -> bool:
        """Whether the least effort that frees mass 1 takes it beyond the target."""
        return self.start[1] <= 0 and overshoots(self.programme(_FREEING))

    @property
    def hopeless(self) -> bool:
        """Whether no series of any length can do it, by bounds without a linear programme."""
        return self.fewest == 0 or not self.frees or self.frees_too_far

    def solved(
        self,
        pulses: int,
        *,
        gap: float = _ANY_GAP,
        begin: Solution | None = None,
        work: float = MUCH_WORK,
    ) -> Solution | None:
        """Solve the programme of so many pulses; None if no solution is found."""
        solution = self.tried(pulses, gap=gap, begin=begin, work=work)
        return None if solution is None or solution.effort is None else solution

    def tried(
        self,
        pulses: int,
        *,
        gap: float = _ANY_GAP,
        begin: Solution | None = None,
        work: float = MUCH_WORK,
    ) -> Solution | None:
        """Solve the programme of so many pulses; None if it needs no trial to know there is none.

        A solution without efforts says whether it is refuted, or only has not been found.
        """
        if self.hopeless or pulses < self.fewest:
            return None
        return solve(self.programme(pulses), gap=gap, begin=begin, work=work)

    def shortest(self, excess: float = 0.0) -> Search:
        """Return about the fewest pulses that do.

        A series can be made longer by a rest on the target, so that what is possible remains so
        with more pulses. A rough search by how far one gets is followed by a bisection with little
        work for each number of pulses. What is left is to prove one pulse less to be too few, by
        the bound of its programme; only that takes much work, and only without an excess.

        Parameters
        ----------
        excess
            By which share more pulses may be taken than the fewest.
        """
        guess = max(self._guess(), self.fewest)
        most = max(math.ceil(_LONGEST * guess), 2 * FEWEST_PULSES)
        if self.hopeless:
            return Search(pulses=most, solution=None, least=most + 1)
        least, low = self.fewest, self.fewest - 1

        def trial(pulses: int, work: float = LITTLE_WORK) -> Solution | None:
            nonlocal least
            solution = self.tried(pulses, work=work)
            if solution is None or solution.refuted:
                least = max(least, pulses + 1)
            return None if solution is None or solution.effort is None else solution

        rough = self._roughly(guess, most, max(_ROUGHLY, 0.25 * excess))
        high = max(self.fewest, min(most, math.ceil(rough * (1.0 + 0.5 * excess))))
        stride = max(1, high // _FIRST_STRIDE, high - math.ceil(high / (1.0 + excess)) + 1)
        solution = trial(high)
        # Outwards from there in growing strides, until there is one that does and one that does
        # not; then half way between.
        while solution is None:
            if high >= most:
                return Search(pulses=most, solution=None, least=least)
            low, high = high, min(most, high + stride)
            stride *= _STRIDES
            solution = trial(high)
        if low >= self.fewest:
            stride = high
        while high - low > 1 and high > (1.0 + excess) * (low + 1):
            middle = max((low + high) // 2, high - stride)
            found = trial(middle)
            if found is None:
                low = middle
            else:
                high, solution = middle, found
                stride *= 2
        for k in range(_PROOFS if excess == 0.0 else 0):
            if least >= high:
                break
            fewer = max(least, high - 2**k)
            found = trial(fewer, MUCH_WORK)
            if found is not None:
                high, solution = fewer, found
            elif fewer == high - 1:
                break
        return Search(pulses=high, solution=solution, least=least)

    def _guess(self) -> int:
        """Return about how many pulses a rigid arm needs, with time for a swing to be stilled."""
        limit, law = self.effort_limit, self.arm.friction
        resistance = law.coulomb_friction_positive + law.offset
        mass = self.arm.mass_1 + self.arm.mass_2
        push, brake = (max(limit + sign * resistance, 0.01 * limit) for sign in (-1.0, 1.0))
        rigid = math.sqrt(2.0 * self.way * mass * (1.0 / push + 1.0 / brake))
        dragged = self.way * law.viscous_friction_positive / push
        swing = (
            2.0 * math.pi / math.sqrt(self.arm.stiffness * mass / self.arm.mass_1 / self.arm.mass_2)
        )
        return max(FEWEST_PULSES, math.ceil((rigid + dragged + 0.5 * swing) / self.pulse_width))

    def _roughly(self, trial: int, most: int, accuracy: float) -> int:
        """Return about the fewest pulses that do, in a few blocks and unproven.

        How far one gets is about a power of the time: 2 for a rigid arm, and more for a short move
        of a flexible one, so that the last two trials tell which.
        """
        power, before, reached = 2.0, 0, 0.0
        low, high = self.fewest - 1, most + 1  # what seemed too few, and enough
        for _ in range(_TRIALS):
            reach = self.programme(trial).rough_reach()
            if reach > 0.0 and reached > 0.0 and trial != before:
                power = max(1.0, math.log(reach / reached) / math.log(trial / before))
            low, high = (low, min(high, trial)) if reach >= 1.0 else (max(low, trial), high)
            before, reached = trial, reach
            aimed = math.ceil(trial * reach ** (-1.0 / power)) if reach > 0.0 else 2 * trial
            if not low < aimed < high:
                aimed = high if high - low <= 1 else (low + high) // 2
            trial = min(max(aimed, self.fewest), most)
            if abs(trial - before) <= trial * accuracy:
                break
        return trial
