"""A move in its own direction, from where mass 1 begins, and the fewest pulses for it.

Bounds without a linear programme come first: what mass 2 swings, and what frees mass 1.
"""

import cmath
import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from stickslip.planning.arm_motion import NO_LOSSES, ArmMotion, LoadLosses, steps_per_sample
from stickslip.planning.programme import REFUTED, Programme, Solution, solve
from stickslip.planning.tuning import TUNING
from stickslip.plants import FlexibleArm

FEWEST_PULSES = 4  # one for each of the four states to be met
_ANY_GAP = 1.0  # of the cost: any solution will do
_ROUNDING = 1e-6  # of a pulse


def swing_time(arm: FlexibleArm, start: tuple[float, float, float, float], travel: float) -> float:
    """Return the least time to bring mass 2 to rest, whatever the effort; inf if it cannot [s].

    With w = sqrt(ks/m2), the swing z = x2 - x1 + i v2/w obeys z' = -i w z - v1, so that z ends at 0
    after a time t if the integral of v1(s)/d exp(i w s) over it is z(0)/d. While mass 1 only moves
    forward, by the travel d, that is a mean of points on the arc exp(i w s), 0 <= s <= t. The arc
    and its chord from 1 to exp(i w t) enclose all such means; as t grows, the chord sweeps over
    each point in the unit disc once.
    """
    frequency = math.sqrt(arm.stiffness / arm.mass_2)
    mean = complex(start[2] - start[0], start[3] / frequency) / travel
    if abs(mean) >= 1.0:
        return math.inf
    chord = mean - 1.0
    end = 1.0 - 2.0 * chord.real / abs(chord) ** 2 * chord
    return (cmath.phase(end) % (2.0 * math.pi)) / frequency


def overshoots(programme: Programme) -> bool:
    """Return whether the least effort that frees mass 1 takes it too far already.

    It goes too far if, freed by that and then braked by all there is, it passes the target; as long
    as the position answers an impulse on mass 1 forward, no other efforts keep it farther behind.
    It also does if what mass 2 swings then is more than the travel that is left could take up
    (see `swing_time`): the integral over the first travel a is a to within a w t.
    """
    arm, motion = programme.motion.arm, programme.motion
    effort = np.full(min(programme.pulses, TUNING.freeing_pulses), -programme.effort_limit)
    effort[0] = programme.lowest[0]
    states = motion.states(np.repeat(effort, programme.steps_per_pulse))
    backward = np.flatnonzero(np.diff(motion.forced[: states.shape[0], 0]) < 0.0)
    known = states[: backward[0] + 1 if backward.size else None, 0]
    frequency = math.sqrt(arm.stiffness / arm.mass_2)
    # Every instant is a bound of its own: the farther it goes, the later.
    angle = frequency * motion.step * np.arange(known.size)
    swing = complex(motion.start[2] - motion.start[0], motion.start[3] / frequency)
    needed = np.maximum(known, known + np.abs(swing - known) - angle * programme.target)
    return bool(needed.max() > programme.target * (1.0 + TUNING.rounding))


class Search(NamedTuple):
    """The end of a search for the fewest pulses."""

    pulses: int  # the fewest that were found to do, or the most that were tried
    solution: Solution | None  # with so many; None if there is none
    least: int  # with fewer there is proven to be none


@dataclass(frozen=True, kw_only=True)
class Move:
    """A move forward along the direction, from the position 0 of mass 1."""

    arm: FlexibleArm  # the positive side of its friction is that of the move
    sampling_time: float
    pulse_samples: int
    effort_limit: float
    slowest: float  # least speed of mass 1 on the way, as a share of the mean
    start: tuple[float, float, float, float]  # state at the begin
    travel: float  # to the target, positive
    longest: float = math.inf  # duration of a series
    losses: LoadLosses = NO_LOSSES

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
        return self.breakaway < self.effort_limit * (1.0 - 3.0 * TUNING.clearance)

    def programme(self, pulses: int) -> Programme:
        """Return the linear programme of so many pulses."""
        law = self.arm.friction
        resistance = law.coulomb_friction_positive + law.offset
        parts = steps_per_sample(self.arm, self.sampling_time)
        per_pulse = self.pulse_samples * parts
        clearance = TUNING.clearance * self.effort_limit
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
                losses=self.losses,
            ),
            pulses=pulses,
            steps_per_pulse=per_pulse,
            target=self.travel,
            effort_limit=self.effort_limit,
            lowest=lowest,
            highest=highest,
            least_velocity=self.slowest * self.travel / (pulses * self.pulse_width),
        )

    @cached_property
    def fewest(self) -> int:
        """So many pulses it takes at least, by the swing of mass 2 alone; 0 if none are enough."""
        time = swing_time(self.arm, self.start, self.travel) / self.pulse_width
        if not math.isfinite(time):
            return 0
        # Losses take up a swing too, so that the bound does not hold with them
        return (
            FEWEST_PULSES if any(self.losses) else max(FEWEST_PULSES, math.ceil(time - _ROUNDING))
        )

    @cached_property
    def frees_too_far(self) -> bool:
        """Whether the least effort that frees mass 1 takes it beyond the target."""
        return self.start[1] <= 0 and overshoots(self.programme(TUNING.freeing_pulses))

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
        work: float = TUNING.proof_work,
    ) -> Solution:
        """Solve the programme of so many pulses, as `solve`, if bounds do not refute it already."""
        if self.hopeless or pulses < self.fewest:
            return REFUTED
        return solve(self.programme(pulses), gap=gap, begin=begin, work=work)

    def shortest(self, excess: float = 0.0) -> Search:
        """Return about the fewest pulses that do, or a share ``excess`` more.

        A series can be made longer by a rest on the target, so that what is possible remains so
        with more pulses. A rough search by how far one gets is followed by a bisection with little
        work for each number of pulses. What is left is to prove one pulse less to be too few, by
        the bound of its programme; only that takes much work, and only without an excess.
        """
        guess = max(self._guess(), self.fewest)
        most = max(math.ceil(TUNING.longest * guess), 2 * FEWEST_PULSES)
        if math.isfinite(self.longest):
            most = min(most, max(FEWEST_PULSES, math.floor(self.longest / self.pulse_width)))
            guess = min(guess, most)
        if self.hopeless or self.fewest > most:
            return Search(most, None, most + 1)
        least, low = self.fewest, self.fewest - 1

        def trial(pulses: int, work: float = TUNING.search_work) -> Solution | None:
            nonlocal least
            solution = self.solved(pulses, work=work)
            if solution.refuted:
                least = max(least, pulses + 1)
            return None if solution.effort is None else solution

        rough = self._roughly(guess, most, max(TUNING.rough_accuracy, 0.25 * excess))
        high = max(self.fewest, min(most, math.ceil(rough * (1.0 + 0.5 * excess))))
        allowed = high - math.ceil(high / (1.0 + excess)) + 1
        stride = max(1, high // TUNING.first_stride_part, allowed)
        solution = trial(high)
        # Outwards from there in growing strides, until there is one that does and one that does
        # not; then half way between.
        while solution is None:
            if high >= most:
                return Search(most, None, least)
            low, high = high, min(most, high + stride)
            stride *= TUNING.stride_growth
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
        for k in range(TUNING.max_proofs if excess == 0.0 else 0):
            if least >= high:
                break
            fewer = max(least, high - 2**k)
            found = trial(fewer, TUNING.proof_work)
            if found is not None:
                high, solution = fewer, found
            elif fewer == high - 1:
                break
        return Search(high, solution, least)

    def _guess(self) -> int:
        """Return about how many pulses a rigid arm needs, with time for a swing to be taken up."""
        limit, law = self.effort_limit, self.arm.friction
        resistance = law.coulomb_friction_positive + law.offset
        mass = self.arm.mass_1 + self.arm.mass_2
        push, brake = (max(limit + sign * resistance, 0.01 * limit) for sign in (-1.0, 1.0))
        rigid = math.sqrt(2.0 * self.travel * mass * (1.0 / push + 1.0 / brake))
        dragged = self.travel * law.viscous_friction_positive / push
        swing = (
            2.0 * math.pi / math.sqrt(self.arm.stiffness * mass / self.arm.mass_1 / self.arm.mass_2)
        )
        return max(FEWEST_PULSES, math.ceil((rigid + dragged + 0.5 * swing) / self.pulse_width))

    def _roughly(self, trial: int, most: int, accuracy: float) -> int:
        """Return about the fewest pulses that do, in a few blocks and unproven.

        How far one gets is about a power of the time: 2 for a rigid arm, and more for a short move
        of a flexible one, so that the last two trials give it.
        """
        power, before, reached = 2.0, 0, 0.0
        low, high = self.fewest - 1, most + 1  # what seemed too few, and enough
        for _ in range(TUNING.rough_trials):
            reach = self.programme(trial).rough_reach()
            if reach > 0.0 and reached > 0.0 and trial != before:
                power = max(1.0, math.log(reach / reached) / math.log(trial / before))
            low, high = (low, min(high, trial)) if reach >= 1.0 else (max(low, trial), high)
            before, reached = trial, reach
            next_trial = math.ceil(trial * reach ** (-1.0 / power)) if reach > 0.0 else 2 * trial
            if not low < next_trial < high:
                next_trial = high if high - low <= 1 else (low + high) // 2
            trial = min(max(next_trial, self.fewest), most)
            if abs(trial - before) <= trial * accuracy:
                break
        return trial
