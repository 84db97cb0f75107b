"""Landing of a flexible arm by series of pulses that feedback on both masses tracks."""

from dataclasses import dataclass, replace
from math import ceil, exp, inf, isfinite, sqrt
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.control.landing.arm import LandingController
from stickslip.control.landing.arm_belief import Swing
from stickslip.control.landing.arm_plan import LandingState, PlanAnswer
from stickslip.control.landing.supervisor import LEAST_FRICTION
from stickslip.control.landing.tracked.correction import (
    NONE,
    CorrectedSeries,
    Deviation,
    Tracking,
    before,
)
from stickslip.control.landing.tracked.drive_fit import LAGS, DriveFit, SeenSeries
from stickslip.control.landing.tracked.nudge import moment, nudge
from stickslip.control.landing.tracked.poles import feedback_poles
from stickslip.control.landing.tracked.sensing import (
    acceleration,
    swing_deviation,
    with_lag,
    with_load,
    with_velocities,
)
from stickslip.control.landing.tracked.state import TrackedAnswer, TrackedState
from stickslip.control.landing.tuning import TRACKING
from stickslip.numerics.growing import Growing
from stickslip.planning import LoadLosses, PulseLaw, PulseSeries
from stickslip.plants import FlexibleArm
from stickslip.records import SensorSample

_KEPT = LAGS + 2  # deviations, for the delay
_ROUNDING = 1e-6  # samples


@dataclass(frozen=True, kw_only=True)
class TrackedLandingController(LandingController):
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
    _states: ClassVar[type[LandingState]] = TrackedState
    _answers: ClassVar[type[PlanAnswer]] = TrackedAnswer

    @property
    def channels(self) -> tuple[str, ...]:
        """Position of mass 1; what else is not measured is computed."""
        return ("measured_position",)

    def _warm_up(self, state: Any, series: Any) -> None:
        super()._warm_up(state, series)
        series.goal(0, NONE, NONE)
        series.after(0, NONE, series.acceleration(0, NONE, NONE))
        self._fitted(state, series.effort, series.states)

    def pole(self, delay: float = TRACKING.assumed_delay) -> float:
        """Return the double pole of the feedback [rad/s].

        Parameters
        ----------
        delay
            Of the drive, in samples [-].
        """
        return self._poles(delay)[0]

    def _poles(self, delay: float) -> tuple[float, float]:
        return feedback_poles(
            self.arm,
            sampling_time=self.sampling_time,
            noise=self._noise,
            effort_limit=self.effort_limit,
            delay=delay,
        )

    @property
    def _noise(self) -> tuple[float, float]:
        """Standard deviation of a position and of a velocity [m or rad, m/s or rad/s]."""
        return self.position_noise, self.velocity_noise

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
        corrects = travel < 0.5 * state.travel
        return TRACKING.correcting_speed if corrects else super()._slowest(state, travel)

    def step(self, state: Any, sample: SensorSample) -> tuple[Any, float]:
        """Take a sample; return the state after it and the effort until the next [N or N m]."""
        if self._readable(sample):
            last, T = state.last, self.sampling_time
            sample = with_velocities(last, sample, T)
            arm, seen = self._estimated_arm(state), sample
            measured = isfinite(sample.measured_load_position + sample.measured_load_velocity)
            if not measured:
                seen = with_load(last, sample, arm, T, velocities=self._lag(state) == 0.0)
            if last is not None and self._follows(last, sample):
                lag = state.lag.after(last, sample, arm if measured else None)
                state = replace(state, lag=lag)
            state = replace(state, last=seen, computed=state.computed or not measured)
            sample = self._prompt(state, seen)
        return super().step(state, sample)

    def _follows(self, last: SensorSample, sample: SensorSample) -> bool:
        """Return whether two samples are successive."""
        jitter = sample.time - last.time - self.sampling_time
        return abs(jitter) <= TRACKING.jitter * self.sampling_time

    def _lag(self, state: Any) -> float:
        """Return the lag of measured velocities [s]."""
        return state.lag.estimate(self.sampling_time, self._noise)

    def _prompt(self, state: Any, sample: SensorSample) -> SensorSample:
        """Return a sample with the velocities as they are, by the spring and the plan."""
        lag = self._lag(state)
        if lag == 0.0:
            return sample
        v1, v2 = sample.measured_velocity, sample.measured_load_velocity
        if not state.computed:
            v2 += lag * acceleration(self._estimated_arm(state), sample)
        if state.phases and state.phase.name == "series" and not state.braking:
            series = state.flights[-1].planned
            k = state.sent - series.drive.delay
            v1 += series.at(k)[1] - series.at(k - lag / self.sampling_time)[1]
        return sample._replace(measured_velocity=v1, measured_load_velocity=v2)

    def _tracked(self, state: Any, sample: SensorSample) -> Any:
        # As measured: the lag is estimated better when the series is over
        last: SensorSample | None = state.last
        if last is None or not isfinite(sample.measured_position):
            return super()._tracked(state, sample)
        return super()._tracked(state, last)

    def _towards(self, state: Any, sample: SensorSample) -> Any:
        state = replace(
            state,
            renewed=False,
            begun=len(state.phases),
            best=inf,
            spent=None,
            farther=False,
            travel=abs(state.target - sample.measured_position),
            track=Growing(),
            deviations=(),
            request=None,
            answer=None,
            braking=True,
        )
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

    def _friction(self, state: LandingState) -> tuple[float, float]:
        coulomb, viscous = super()._friction(state)
        if state.belief is not None:
            return coulomb, viscous
        drive = state.drive if isinstance(state, TrackedState) else None
        if drive is not None and self._by_series(state):
            coulomb, viscous = drive.friction
            return max(coulomb, LEAST_FRICTION * self.effort_limit), max(viscous, 0.0)
        if not np.isfinite(self._covariance(state)).all():
            coulomb = max(coulomb, TRACKING.guessed_friction * self.effort_limit)
        return coulomb, viscous

    def _covariance(self, state: Any) -> Float[np.ndarray, "2 2"]:
        return state.drive.covariance if self._by_series(state) else super()._covariance(state)

    def _by_series(self, state: Any) -> bool:
        """Return whether friction is that of the series.

        Noise goes through feedback into the efforts, which biases their regression; the running
        estimator allows for it.
        """
        return state.drive is not None

    def _drive(self, state: Any) -> DriveFit:
        if state.drive is not None:
            return state.drive
        # As before the first series: the running estimator has seen what the fit sees
        first = self.init()
        coulomb, viscous = self._friction(first)
        covariance = self._covariance(first)
        if not np.isfinite(covariance).all():
            covariance = np.diag([coulomb**2, (coulomb * self.pole()) ** 2])
        return DriveFit.first(coulomb, viscous, covariance)

    def _estimated_arm(self, state: Any) -> FlexibleArm:
        arm = super()._estimated_arm(state)
        by_load: FlexibleArm | None = state.load.arm
        return arm if state.belief is not None or by_load is None else by_load

    def _miss(self, state: LandingState, swing: Swing) -> float:
        # Friction may hold mass 2 beside mass 1, where it does not swing
        x1, x2 = state.window.seen()[-1, :2].tolist()
        beside = abs(x2 - x1) - TRACKING.offset_deviations * self.position_noise
        return max(super()._miss(state, swing), beside)

    def _places(self, state: Any, swing: Swing, least: float) -> list[float]:
        if state.phases and state.phase.name == "series":  # on the way
            return [state.target]
        # A short series is slow, where friction differs from that of a long one
        error = state.target - swing.position
        if abs(error) > self._near(state):
            return super()._places(state, swing, least)
        share = TRACKING.farther_travel if state.farther else TRACKING.correcting_travel
        return super()._places(state, swing, max(least, share * state.travel))[-4:]

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
        )
        arm = self._estimated_arm(state)
        return CorrectedSeries.of(series, arm, state.load.losses, drive, tracking)

    def _losses(self, state: Any) -> LoadLosses:
        return state.load.losses

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
        since = now - stuck
        planned = abs(float(series.position[now] - series.position[since]))
        whole = max(state.travel, abs(series.target - float(series.position[0])))
        least = max(TRACKING.blocked_travel * whole, TRACKING.blocked_bands * self._band)
        behind = series.direction * (self._due(state, now) - sample.measured_position)
        if stuck < TRACKING.blocked_samples or min(planned, behind) <= least:
            return False
        # The spring may hold it for a while
        x, x2 = state.window.seen()[-TRACKING.blocked_samples :, :2].T
        pulled = series.direction * self.arm.stiffness * float(x[-1] - x2[-1])
        return bool(np.ptp(x2) == 0.0 or pulled <= TRACKING.held_share * self._most(state))

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
        if state.goal != NONE or abs(drive.delay - series.drive.delay) > TRACKING.other_delay:
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
        if planned <= coulomb:
            return None
        mass = self._estimated_arm(state).mass_1
        samples, effort, certain = nudge(
            PulseLaw(mass=mass, coulomb_friction=coulomb, viscous_friction=0.0),
            error,
            sampling_time=self.sampling_time,
            limits=(planned, self.effort_limit),
            frees=coulomb * state.static_ratio,
        )
        # One that may not free mass 1 is not often tried
        nudges = state.nudges + (1 if certain else TRACKING.most_nudges // 2)
        state = replace(state, nudges=nudges, nudge=(samples, effort))
        return replace(state, window=state.window.empty())

    def _spent(self, state: Any) -> str | None:
        return super()._spent(state) or state.spent

    def _near(self, state: TrackedState) -> float:
        """Return the distance from which no series leads straight to the target [m or rad]."""
        return TRACKING.nearby_error * state.travel

    def _recorded(self, state: TrackedState, effort: float) -> tuple[TrackedState, float]:
        return replace(state, efforts=state.efforts.after(effort)), effort

    def _after_series(self, state: Any, swing: Swing) -> Any:
        if not state.track or not state.efforts:
            return super()._after_series(state, swing)
        last = state.flights[-1]
        sent = np.array(tuple(state.efforts))
        seen = with_lag(state.seen(), self._lag(state), self.sampling_time)
        n = min(sent.size, last.planned.effort.size, len(seen) - 1)
        effort = last.planned.effort.copy()
        effort[:n] = sent[:n]
        flown = replace(last, planned=replace(last.planned, effort=effort))
        learned = self._fitted(state, sent[:n], seen[: n + 1])
        ratio = state.static_ratio
        state = replace(state, flights=(*state.flights[:-1], flown))
        state = replace(super()._after_series(state, swing), **learned)
        moved = abs(swing.position - last.planned.position[0]) > self._band
        # Feedback has freed a mass that began late
        return replace(state, static_ratio=ratio) if moved else state

    def _fitted(
        self, state: Any, sent: Float[np.ndarray, " n"], seen: Float[np.ndarray, "m 4"]
    ) -> dict[str, Any]:
        """Return the estimates of drive and load after a series."""
        series = SeenSeries(
            arm=self._estimated_arm(state),
            effort=sent,
            seen=seen,
            sampling_time=self.sampling_time,
            velocity_noise=self.velocity_noise,
        )
        before = self._drive(state)
        most = before.clipped(series, self.effort_limit)
        drive = before.after(series, most)
        drive = replace(drive, most=most, lag=self._lag(state) / self.sampling_time)
        if state.computed or state.belief is not None:
            return {"drive": drive}
        coulomb = max(drive.friction[0], LEAST_FRICTION * self.effort_limit)
        load = state.load.after(
            self.arm,
            seen,
            coulomb_friction=coulomb,
            sampling_time=self.sampling_time,
            velocity_noise=self.velocity_noise,
        )
        return {"drive": drive, "load": load}

    def _most(self, state: Any) -> float:
        """Return the largest effort that acts: the limit, or less where the drive clips it."""
        drive: DriveFit | None = state.drive
        return self.effort_limit if drive is None else min(self.effort_limit, drive.most)

    def _by_noise(self, planned: PulseSeries) -> float:
        del planned
        # A miss is that of feedback: only masses and spring that are uncertain are learned from it
        return inf

    def _running(self, state: LandingState) -> Any:
        return None if state.belief is None else super()._running(state)
