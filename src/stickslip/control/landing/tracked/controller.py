"""Landing of a flexible arm by series of pulses that feedback on both masses tracks."""

from dataclasses import dataclass, replace
from math import ceil, exp, inf, sqrt
from typing import Any

import numpy as np

from stickslip.control.landing.arm_belief import Swing
from stickslip.control.landing.arm_plan import LandingState
from stickslip.control.landing.tracked.correction import (
    NONE,
    CorrectedSeries,
    Deviation,
    Goal,
    Tracking,
    before,
)
from stickslip.control.landing.tracked.drive_fit import LAGS
from stickslip.control.landing.tracked.estimates import TrackedEstimates
from stickslip.control.landing.tracked.nudge import moment, nudge, scaled
from stickslip.control.landing.tracked.sensing import (
    swing_deviation,
)
from stickslip.control.landing.tracked.state import Lesson, TrackedState
from stickslip.control.landing.tuning import TRACKING
from stickslip.numerics.growing import Growing
from stickslip.planning import PulseLaw, PulseSeries
from stickslip.records import SensorSample

_KEPT = LAGS + 2  # deviations, for the delay
_ROUNDING = 1e-6  # samples


@dataclass(frozen=True, kw_only=True)
class TrackedLandingController(TrackedEstimates):
    """Land a flexible arm by series of pulses, each tracked by feedback.

    The first series to a target begins as soon as the swing of mass 2 is known, with friction as
    known or, where nothing is, a tenth of the effort limit. It is planned with 0.85 of the effort
    limit; the rest is for feedback. Its effort is

        u = [u_p + m1 (a + p (p e + 2 e')) + ks (x1 - x2 - x1p + x2p) + d (x1 - x2 - x1p + x2p)'
             + c v1r + I] / g,  e = x1p + x1r - x1,

    with the planned motion and effort (p), an integral I and the gain g of the drive. The spring's
    force is balanced, so that mass 1 follows its plan, and mass 2, which the motion of mass 1 alone
    drives, follows with it. Where mass 2 is not where it was planned to be, mass 1 leaves its plan
    by x1r, with the acceleration a, so that both end on the target all the same
    (`landing.tracked.correction`).

    Coulomb and viscous friction, delay and gain of the drive are estimated from each series, and so
    are the frequency of mass 2, the damping d of the spring and the friction of mass 2, where the
    load is measured. The next series is planned and tracked with them. Where mass 1 rests on the
    way and the estimates are others than those planned with, what follows is planned anew.

    A new target in the middle of a series takes over at its end, which leaves mass 2 at rest, or
    from the rest on the way on.

    An arm off its target by little is corrected by two series, to a place beyond and back, or,
    where mass 1 alone is off, by a pulse. Where two corrections bring it no nearer, it is
    *stopped*. A load that is not measured is computed from the motion of mass 1, from rest at the
    begin. Velocities that are not measured are differences of positions; the lag of velocities
    is estimated (`landing.tracked.sensing`). ``velocity_noise`` is that of either.

    The settings are those of `LandingController`; ``pd`` and ``notch`` are not used. Masses and
    spring are learned only with an ``arm_uncertainty``, and then no losses of the load.

    Examples
    --------
    >>> from stickslip.estimation import EnergyEstimator
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import FlexibleArm
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
    >>> arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    >>> controller = TrackedLandingController(
    ...     sampling_time=0.02, target=1.0, tolerance=1e-5, arm=arm, effort_limit=2.0,
    ...     estimator=EnergyEstimator(
    ...         inertia=1.0, load_inertia=1.0, stiffness=1.0, offset=False))
    >>> run = simulate_closed_loop(arm, controller, sampling_time=0.02, samples=1500)
    >>> controller.outcome(run.controller_state).value
    'reached'
    """

    most_series: int = 12

    @property
    def channels(self) -> tuple[str, ...]:
        """Position of mass 1; what else is not measured is computed."""
        return ("measured_position",)

    def _warm_up(self, state: Any, series: Any) -> None:
        super()._warm_up(state, series)
        series.goal(0, NONE, NONE)
        series.after(0, NONE, series.acceleration(0, NONE, NONE))
        self._fitted(state, series.effort, series.states)

    @property
    def _band(self) -> float:
        # Bristles give way a little
        return max(super()._band, TRACKING.rest_band * self.tolerance)

    def _longer(self, state: Any) -> tuple[float, ...]:
        on_the_way = bool(state.phases) and state.phase.name == "series"
        return (1.0,) if on_the_way else TRACKING.longer_series

    def _plan_limit(self, state: Any) -> float:
        return TRACKING.plan_share * self._most(state)

    @property
    def _pulse_samples(self) -> int:
        # The work of a search grows with the number of pulses
        return max(1, int(self.half_swing / (TRACKING.most_pulses * self.sampling_time)))

    @property
    def _slack(self) -> float:
        return TRACKING.slack

    def _slowest(self, state: Any, travel: float) -> float:
        corrects = self._corrects(state, travel)
        return TRACKING.correcting_speed if corrects else super()._slowest(state, travel)

    def _corrects(self, state: Any, travel: float) -> bool:
        """Return whether a series of a travel is a correction of the move."""
        return bool(abs(travel) < 0.5 * state.travel)

    def _towards(self, state: Any, sample: SensorSample) -> Any:
        state = replace(
            state,
            renewed=False,
            begun=len(state.phases),
            best=inf,
            spent=None,
            farther=False,
            lesson=None,
            request=None,
            answer=None,
        )
        if state.phases and state.phase.name == "series":
            # Its end leaves mass 2 at rest, which braking does not
            planned = state.flights[-1].planned
            whole = abs(planned.target - float(planned.position[0]))
            return replace(state, travel=max(whole, abs(state.target - planned.target)))
        travel = abs(state.target - sample.measured_position)
        state = replace(state, travel=travel, track=Growing(), deviations=(), braking=True)
        return self._enter(state, sample, "resting", "the target is new")

    def _settled(self, state: Any, waited: float) -> bool:
        n, last = state.window.count, state.last
        slowly = TRACKING.rest_speed * self.tolerance / self.half_swing + self._moving_speed
        if last is None or abs(last.measured_velocity) > slowly:  # it may be about to turn
            return super()._settled(state, waited)
        if self.position_noise == 0.0 and self.velocity_noise == 0.0:
            return n >= TRACKING.exact_rest
        if n >= TRACKING.noisy_rest and not state.computed:
            left = abs(state.target - 0.5 * (state.window.low + state.window.high))
            unsure = swing_deviation(n, self.sampling_time, self.half_swing, self._noise)
            if unsure <= max(TRACKING.known_swing * self.tolerance, TRACKING.known_travel * left):
                return True
        return super()._settled(state, waited)

    def _miss(self, state: LandingState, swing: Swing) -> float:
        # Friction may hold mass 2 beside mass 1, where it does not swing
        x1, x2 = state.window.seen()[-1, :2].tolist()
        beside = abs(x2 - x1) - TRACKING.offset_deviations * self.position_noise
        return max(super()._miss(state, swing), beside)

    def _places(self, state: Any, swing: Swing, least: float) -> list[float]:
        if state.phases and state.phase.name == "series":  # on the way
            return [state.flights[-1].planned.target if state.series_since_target else state.target]
        # A short series is slow, where friction differs from that of a long one
        error = state.target - swing.position
        if abs(error) > self._near(state):
            return super()._places(state, swing, least)
        share = TRACKING.farther_travel if state.farther else TRACKING.correcting_travel
        farther = super()._places(state, swing, max(least, share * state.travel))[-4:]
        lesson = state.lesson
        if lesson is None or abs(state.target - lesson.place) < share * state.travel:
            return farther
        return [lesson.place, *farther]

    def _aim(self, state: TrackedState, start: float, target: float) -> Goal:
        """Return the final deviation that a series aims at, against the miss of one like it."""
        lesson = state.lesson
        if lesson is None or target != state.target:
            return NONE
        drive, (coulomb, _) = self._drive(state), self._friction(state)
        known = (
            abs(coulomb - lesson.coulomb_friction) <= TRACKING.other_friction * coulomb
            and abs(drive.delay - lesson.drive.delay) <= TRACKING.other_delay
            and abs(drive.gain - lesson.drive.gain) <= TRACKING.other_gain
        )
        off = abs(start - lesson.place)
        same = off <= TRACKING.same_place * abs(target - lesson.place)
        return lesson.aim if known and same else NONE

    def _with_lesson(self, state: Any, sample: SensorSample, swing: Swing) -> Any:
        """Return the state with the aim of the next correction, by the miss of the last one."""
        last = state.flights[-1]
        travel = state.target - float(last.planned.position[0])
        if state.series_since_target == 1 or not self._corrects(state, travel):
            return state
        later = last.start + last.planned.moving * self.sampling_time - sample.time
        x, _, x2, v2 = swing.state(later)
        miss = (x - state.target, 0.0, x2 - state.target, v2 / swing.frequency)
        if max(map(abs, miss)) > TRACKING.largest_miss * abs(travel):
            return replace(state, lesson=None)
        share = TRACKING.repeated_miss
        pairs = zip(last.planned.aim, miss, strict=True)
        aim_x, _, aim_x2, aim_v2 = (aim - share * off for aim, off in pairs)
        lesson = Lesson(
            place=float(last.planned.position[0]),
            aim=(aim_x, 0.0, aim_x2, aim_v2),
            coulomb_friction=last.coulomb_friction,
            drive=last.planned.drive,
        )
        return replace(state, lesson=lesson)

    def _next_series(self, state: Any, swing: Swing, later: float = 0.0) -> PulseSeries | str:
        if state.phases and state.phase.name == "series" and self._as_planned(state):
            return "the series goes as planned"
        drive = self._drive(state)
        series = super()._next_series(state, swing, later + drive.delay * self.sampling_time)
        if isinstance(series, str):
            return series
        pole, filtering = self._poles(drive.delay if drive.rows else TRACKING.assumed_delay)
        tracking = Tracking(
            pole=pole,
            filtered=1.0 - exp(-filtering * self.sampling_time),
            settling=max(1, ceil(TRACKING.settling / pole / self.sampling_time)),
            limit=TRACKING.correction_share * self._most(state),
            noise=self._noise,
            learned=state.load.rows > 0,
            aim=self._aim(state, swing.position, series.target),
        )
        arm = self._estimated_arm(state)
        return CorrectedSeries.of(series, arm, state.load.losses, drive, tracking)

    def _launched(self, state: Any, sample: SensorSample, series: PulseSeries) -> Any:
        state = super()._launched(state, sample, series)
        return replace(
            state,
            braking=False,
            integral=0.0,
            behind=0.0,
            efforts=Growing(),
            deviations=(NONE,) * _KEPT,
            goal=NONE,
            computed=False,
            nudges=0,
            nudged=None,
            nudge_scale=1.0,
        )

    def _planned_effort(self, state: Any) -> tuple[Any, float]:
        series: Any = self._under_way(state)
        if series is None:
            return state, 0.0
        k, r = state.sent, state.deviations[-1]
        a = series.acceleration(k, r, state.goal)
        state = self._deviated(replace(state, sent=k + 1), k, r, a)
        effort = float(series.effort[k])
        effort += self._estimated_arm(state).mass_1 * a + state.integral
        return self._recorded(state, effort / series.drive.gain)

    def _sent(self, state: Any, sample: SensorSample) -> tuple[Any, float]:
        left, effort = state.nudge
        if left > 0:
            if state.phase.name != "resting":
                return replace(state, nudge=(0, 0.0)), 0.0
            return replace(state, nudge=(left - 1, effort)), effort
        series: Any = self._under_way(state)
        return (state, 0.0) if series is None else self._followed(state, sample, series)

    def _followed(self, state: Any, sample: SensorSample, series: Any) -> tuple[Any, float]:
        """Return the state and the effort of the feedback that tracks a series."""
        drive, p, k = series.drive, series.pole, state.sent
        arm, T = self._estimated_arm(state), self.sampling_time
        x, v, x2, v2 = series.at(k - drive.delay)
        dx, dv, dx2, dv2 = before(state.deviations, drive.delay, T)
        by = (
            sample.measured_load_position - x2 - dx2,
            sample.measured_load_velocity - v2 - dv2,
        )
        r = rx, rv, rx2, rv2 = series.seen(k, state.deviations[-1], by)
        held = k < series.moving and series.rests[k] and v == 0.0
        if held and abs(sample.measured_velocity) <= self._moving_speed:
            share = 1.0 - exp(-p * T / TRACKING.taken_over)
            r = rx + share * (sample.measured_position - x - dx), rv, rx2, rv2
        state = replace(state, goal=series.goal(k, r, state.goal))
        a = series.acceleration(k, r, state.goal)
        e, e_dot = x + dx - sample.measured_position, v + dv - sample.measured_velocity
        stretch = sample.measured_position - sample.measured_load_position - (x - x2)
        state = replace(state, behind=state.behind + series.filtered * (e_dot - state.behind))
        feedback = arm.mass_1 * (a + p * (p * e + 2.0 * state.behind)) + drive.values[-1] * rv
        feedback += arm.stiffness * stretch
        rate = sample.measured_velocity - sample.measured_load_velocity - (v - v2)
        feedback += series.losses.damping * rate
        u = (float(series.effort[k]) + feedback + state.integral) / drive.gain
        limit = self._most(state)
        if abs(u) < limit and v != 0.0:
            grown = TRACKING.integral_pole * arm.mass_1 * p**3 * e * T
            stuck = self._stuck(state) > TRACKING.stuck_samples + drive.delay
            if stuck and series.direction * e > self._band:
                grown = series.direction * TRACKING.freeing_rate * limit
            state = replace(state, integral=state.integral + grown)
        state = replace(state, sent=k + 1)
        return self._recorded(self._deviated(state, k, r, a), min(max(u, -limit), limit))

    def _due(self, state: Any, k: int) -> float:
        return super()._due(state, k) + float(state.deviations[-1][0])

    def _transition(self, state: Any, sample: SensorSample) -> Any:
        if state.phase.name == "series" and state.flights[-1].planned.rest is not None:
            state = self._on_the_way(state, sample)
        if state.phase.name == "series":
            series = state.flights[-1].planned
            if self._stays(state, sample):
                reason = "mass 1 does not move as planned, or its sensor does not show it"
                return self._enter(state, sample, "stopped", reason)
            over = state.sent >= series.moving + series.drive.delay + TRACKING.exact_rest
            if over and self._settled(state, 0.0):
                return self._enter(
                    state, sample, "resting", "mass 1 rests at the end of the series"
                )
        after = super()._transition(state, sample)
        ends = state.phase.name == "series" and after.phase.name == "resting"
        return replace(after, braking=True) if ends and self._coasts(state, sample) else after

    def _coasts(self, state: Any, sample: SensorSample) -> bool:
        """Return whether friction lets mass 1 go far at the end of a series."""
        coulomb, _ = self._friction(state)
        energy = 0.5 * self._estimated_arm(state).mass_1 * sample.measured_velocity**2
        return bool(energy > coulomb * TRACKING.coasting_travel * state.travel)

    def _stuck(self, state: Any) -> int:
        """Return for how many samples mass 1 has rested where its plan lets it move."""
        rest, k = state.flights[-1].planned.rest_samples, state.sent
        if rest is not None and k >= rest[0]:
            k = max(k - rest[1], 0)
        return min(k, state.window.count)

    def _stays(self, state: Any, sample: SensorSample) -> bool:
        """Return whether mass 1 rests behind where it was to move to.

        It cannot move, or its sensor is frozen.
        """
        series = state.flights[-1].planned
        now, stuck = min(state.sent, len(series.position) - 1), self._stuck(state)
        if stuck < TRACKING.blocked_samples:
            return False
        x, x2 = state.window.seen()[-TRACKING.blocked_samples :, :2].T
        since = now - stuck
        planned = abs(float(series.position[now] - series.position[since]))
        whole = max(state.travel, abs(series.target - float(series.position[0])))
        least = TRACKING.blocked_bands * self._band
        if np.ptp(x) > 0.0 or not self._pushed(state, stuck):
            least = max(TRACKING.blocked_travel * whole, least)
        behind = series.direction * (self._due(state, now) - sample.measured_position)
        if min(planned, behind) <= least:
            return False
        # The spring may hold it for a while
        pulled = series.direction * self.arm.stiffness * float(x[-1] - x2[-1])
        return bool(np.ptp(x2) == 0.0 or pulled <= TRACKING.held_share * self._most(state))

    def _pushed(self, state: Any, stuck: int) -> bool:
        """Return whether most of the effort limit has acted in a rest of mass 1."""
        acting = stuck - ceil(self._drive(state).delay or TRACKING.assumed_delay)
        efforts = np.abs(tuple(state.efforts)[-stuck:][:acting])
        strong = TRACKING.blocked_effort * self._most(state)
        return acting >= TRACKING.blocked_samples and bool(efforts.min() >= strong)

    def _on_the_way(self, state: Any, sample: SensorSample) -> Any:
        """Return the state, with what follows a rest on the way planned anew where it is off."""
        series, k, T = state.flights[-1].planned, state.sent, self.sampling_time
        _, end = series.rest_samples
        if state.request is None:
            ahead = end - k
            if ahead < 0 or ahead != ceil(self.planning_time / T - _ROUNDING):
                return state
            if not self._settled(state, 0.0):
                return state
            begin = sample.time + ahead * T
            state, _ = self._requested(state, self._swing(state), sample.time, begin)
        if k < end:
            return state
        request, answer = state.request, state.answer
        if self.plans_inside and k == end:
            answer = self.plan(request)
        rested = state.window.count >= request.samples
        state = replace(state, request=None, answer=None)
        if k > end or answer is None or not rested:
            return state
        if not isinstance(answer.series, PulseSeries):
            return state
        state = self._launched(self._learned_of(state, answer), sample, answer.series)
        return self._enter(state, sample, "series", "what follows the rest is planned anew")

    def _as_planned(self, state: Any) -> bool:
        """Return whether a series goes as planned: drive and load are about what it assumed."""
        series, drive = state.flights[-1].planned, self._drive(state)
        if state.goal != series.aim or abs(drive.delay - series.drive.delay) > TRACKING.other_delay:
            return False
        arm, (coulomb, _) = self._estimated_arm(state), self._friction(state)
        viscous = sqrt(arm.stiffness * arm.mass_2)
        scales = (viscous, coulomb, viscous)
        pairs = zip(state.load.losses, series.losses, scales, strict=True)
        lost = any(abs(new - old) > TRACKING.other_losses * scale for new, old, scale in pairs)
        return not lost and abs(drive.gain - series.drive.gain) <= TRACKING.other_gain

    def _deviated(self, state: Any, k: int, r: Deviation, a: float) -> Any:
        """Return the state with the deviation of the corrected series after sample k."""
        after = state.flights[-1].planned.after(k, r, a)
        return replace(state, deviations=(*state.deviations[1 - _KEPT : -1], r, after))

    def _judged(self, state: Any, sample: SensorSample) -> Any:
        swing = self._swing(state)
        miss = self._miss(state, swing)
        missed = bool(state.track) and state.flights[-1].planned.target == state.target
        if missed and state.nudges == 0:
            state = self._with_lesson(state, sample, swing)
        if state.nudged is not None:
            start, planned = state.nudged
            scale = scaled(state.nudge_scale, planned, swing.position - start)
            state = replace(state, nudged=None, nudge_scale=scale)
        nudged = self._nudged(state, swing, miss)
        if nudged is not None:
            return nudged
        tried, best = state.series_since_target, state.best
        if tried > 0 and state.flights[-1].planned.target == state.target:
            state = replace(state, best=min(best, miss))
            worse = miss > TRACKING.improvement * best
            if worse and state.farther:
                reason = "its series bring the arm no nearer to the target"
                state = replace(state, spent=reason)
            elif tried + 2 > self.most_series:  # a correction is two
                state = replace(state, spent=f"{tried} series have not landed it")
            elif worse:
                state = replace(state, farther=True)
        return super()._judged(state, sample)

    def _nudged(self, state: Any, swing: Swing, miss: float) -> Any:
        """Return the state with a pulse that takes mass 1 alone to the target; None without one.

        Until mass 2 is near the target, the state is returned as it is.
        """
        error, tolerance = state.target - swing.position, self.tolerance
        if not 0.5 * tolerance < abs(error) <= TRACKING.nudged_error * state.travel:
            return None
        spent = state.nudges >= TRACKING.most_nudges or state.series_since_target == 0
        if spent or miss <= tolerance:
            return None
        when = moment(swing, error, tolerance)
        if when != "now":
            waited = self.sampling_time * state.window.count
            waits = waited <= TRACKING.nudge_wait * 2.0 * self.half_swing
            return state if when == "later" and waits else None
        (coulomb, _), planned = self._friction(state), self._plan_limit(state)
        arm, scale = self._estimated_arm(state), state.nudge_scale
        # The spring pulls towards mass 2, less and less as mass 1 moves
        pull = arm.stiffness * swing.offset * (1.0 if error > 0.0 else -1.0)
        held = max(coulomb - 0.5 * pull, TRACKING.nudge_friction * coulomb)
        if planned <= max(coulomb, held):
            return None
        samples, effort, way, certain = nudge(
            PulseLaw(mass=arm.mass_1, coulomb_friction=held, viscous_friction=0.0),
            error / scale,
            sampling_time=self.sampling_time,
            limits=(planned, self.effort_limit),
            frees=max(coulomb * state.static_ratio - pull, held),
            farthest=TRACKING.nudge_beyond * tolerance / scale,
        )
        # One that may not free mass 1 is not often tried
        nudges = state.nudges + (1 if certain else TRACKING.most_nudges // 2)
        nudged = swing.position, scale * way
        state = replace(state, nudges=nudges, nudge=(samples, effort), nudged=nudged)
        return replace(state, window=state.window.empty())

    def _spent(self, state: Any) -> str | None:
        return super()._spent(state) or state.spent

    def _near(self, state: TrackedState) -> float:
        """Return the distance from which no series leads straight to the target [m or rad]."""
        return TRACKING.nearby_error * state.travel
