"""Landing of a flexible arm by series of pulses that feedback on both masses tracks."""

from dataclasses import dataclass, fields, replace
from math import inf, isfinite, sqrt
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.control.landing.arm import LandingController
from stickslip.control.landing.arm_belief import Swing
from stickslip.control.landing.arm_plan import LandingState
from stickslip.control.landing.drive_fit import DriveFit
from stickslip.control.landing.supervisor import LEAST_FRICTION
from stickslip.planning import PulseSeries
from stickslip.records import SensorSample, quantity_field

# Feedback
_POLE_DELAY = 0.5  # double pole times the delay of drive and samples
_SAMPLES = 1.5  # that an effort takes to show in a sample without a delay of the drive, on average
_UNKNOWN = 2.0  # samples of delay assumed before the first series
_POLE_RESONANCES = 12.0  # double pole over the resonance of the free arm at most
_INTEGRAL = 0.2  # pole of the integral over the double pole
_SETTLING = 3.0  # time constants of feedback after the last pulse

# Plans
_SHARE = 0.85  # of the effort limit; the rest is for feedback
_GUESSED = 0.1  # Coulomb friction over the effort limit, where nothing is known
_SLACK = 1.5  # longest series over the time of a rigid arm and a swing
_SHORTEST = 0.07  # of the move, and 1.5 times that: travel of a series that corrects
_IMPROVES = 0.7  # of the smallest miss so far: what a further correction must bring
_SLOWEST = 0.3  # speed of such a series over its mean: slow motion has another friction
_GIVES_WAY = 0.1  # tolerances within which a mass rests
_AT_ONCE = 3  # samples at rest before a plan, with sensors without noise


@dataclass(frozen=True, kw_only=True)
class TrackedState(LandingState):
    """State of a landing by tracked series.

    Attributes
    ----------
    begun
        Phases before the present target.
    travel
        Length of the move.
    best
        Smallest miss of the target so far.
    integral
        Effort of the integral action.
    efforts
        Sent in the present series.
    drive
        Friction, delay and gain of the drive by the series so far; None before the first.
    last
        The last sample with a position and a velocity of mass 1, its load as measured or, where it
        is not measured, as computed from the motion of mass 1; None before the first.
    """

    begun: int = 0
    travel: float = quantity_field("position", default=0.0)
    best: float = quantity_field("position", default=inf)
    integral: float = quantity_field("effort", default=0.0)
    efforts: tuple[float, ...] = ()
    last: SensorSample | None = None
    drive: DriveFit | None = None

    @property
    def series_since_target(self) -> int:
        """How many series have begun since the last target."""
        return [phase.name for phase in self.phases[self.begun :]].count("series")


@dataclass(frozen=True, kw_only=True)
class TrackedLandingController(LandingController):
    """Land a flexible arm by series of pulses, each tracked by feedback.

    The first series to a target begins as soon as the swing of mass 2 is known, with friction as
    known or, where nothing is, a tenth of the effort limit. It is planned with 0.85 of the effort
    limit; the rest is for feedback. Its effort is

        u = [u_p + m1 p (p e + 2 e') + ks (x1 - x2 - x1p + x2p) + I] / g,  e = x1p - x1,

    with the planned motion and effort (p), an integral I and the gain g of the drive. The spring's
    force is balanced, so that mass 1 follows its plan, and mass 2, which the motion of mass 1 alone
    drives, follows with it: errors of friction and effort matter little. Coulomb and viscous
    friction, the delay of the drive and its gain are estimated from each series; the next one
    tracks a reference later by the delay, with the pole p that the delay allows.

    An arm off its target by little is corrected by two series: to a place beyond, and back. Where
    they bring it no nearer, it is *stopped*. A load that is not measured is computed from the
    motion of mass 1, from rest at the begin.

    The settings are those of `LandingController`; ``pd`` and ``notch`` are not used. Masses and
    spring are learned only with an ``arm_uncertainty``. Damping of the spring and friction on mass
    2 are not modelled.

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

    def init(self) -> TrackedState:
        """Return the state before the first sample."""
        plain = super().init()
        return TrackedState(**{each.name: getattr(plain, each.name) for each in fields(plain)})

    @property
    def channels(self) -> tuple[str, ...]:
        """Position and velocity of mass 1; the load is computed where it is not measured."""
        return ("measured_position", "measured_velocity")

    def pole(self, delay: float = _UNKNOWN) -> float:
        """Return the double pole of the feedback [rad/s].

        Parameters
        ----------
        delay
            Of the drive, in samples [-].
        """
        arm = self.arm
        resonance = sqrt(arm.stiffness * (1.0 / arm.mass_1 + 1.0 / arm.mass_2))
        fastest = _POLE_DELAY / ((max(delay, 0.0) + _SAMPLES) * self.sampling_time)
        return min(fastest, _POLE_RESONANCES * resonance)

    @property
    def _band(self) -> float:
        # Bristles give way a little
        return max(super()._band, _GIVES_WAY * self.tolerance)

    @property
    def _plan_limit(self) -> float:
        return _SHARE * self.effort_limit

    def _slowest(self, state: Any, travel: float) -> float:
        corrects = travel < 0.5 * state.travel
        return _SLOWEST if corrects else super()._slowest(state, travel)

    @property
    def _slack(self) -> float:
        return _SLACK

    def step(self, state: Any, sample: SensorSample) -> tuple[Any, float]:
        """Take a sample; return the state after it and the effort until the next [N or N m]."""
        if self._readable(sample):
            sample = self._with_load(state, sample)
            state = replace(state, last=sample)
        return super().step(state, sample)

    def _with_load(self, state: TrackedState, sample: SensorSample) -> SensorSample:
        """Return the sample with position and velocity of mass 2, computed if not measured.

        x2'' = w^2 (x1 - x2), exact for the cubic x1(t) through both samples and their velocities.
        """
        x2, v2 = sample.measured_load_position, sample.measured_load_velocity
        if isfinite(x2) and isfinite(v2):
            return sample
        last = state.last
        if last is None:
            x1 = sample.measured_position
            return sample._replace(measured_load_position=x1, measured_load_velocity=0.0)
        arm = self._estimated_arm(state)
        w = sqrt(arm.stiffness / arm.mass_2)
        dt = sample.time - last.time
        x, v = last.measured_position, last.measured_velocity
        # x1 = x + v t + a t^2/2 + j t^3/6 through both samples
        d, e = sample.measured_position - x - v * dt, sample.measured_velocity - v
        a, j = (6.0 * d / dt - 2.0 * e) / dt, (6.0 * e - 12.0 * d / dt) / dt**2
        # A particular solution is x1 - x1''/w^2; the rest swings freely
        ww = w * w
        offset = last.measured_load_position - (x - a / ww)
        rate = last.measured_load_velocity - (v - j / ww)
        c, s = np.cos(w * dt), np.sin(w * dt)
        place = sample.measured_position - (a + j * dt) / ww
        speed = sample.measured_velocity - j / ww
        return sample._replace(
            measured_load_position=float(place + offset * c + rate / w * s),
            measured_load_velocity=float(speed + rate * c - offset * w * s),
        )

    def _towards(self, state: Any, sample: SensorSample) -> Any:
        """Return the state at rest, or braked, before the first series to a target."""
        state = replace(
            state,
            renewed=False,
            begun=len(state.phases),
            best=inf,
            travel=abs(state.target - sample.measured_position),
            track=(),
            request=None,
            answer=None,
            braking=True,
        )
        return self._enter(state, sample, "resting", "the target is new")

    def _settled(self, state: LandingState, waited: float) -> bool:
        if self.position_noise == 0.0 and self.velocity_noise == 0.0:
            return state.window.count >= _AT_ONCE
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
            coulomb = max(coulomb, _GUESSED * self.effort_limit)
        return coulomb, viscous

    def _covariance(self, state: Any) -> Float[np.ndarray, "2 2"]:
        return state.drive.covariance if self._by_series(state) else super()._covariance(state)

    def _by_series(self, state: Any) -> bool:
        """Return whether friction is that of the series.

        Noise goes through feedback into the efforts, which biases their regression; the running
        estimator allows for it.
        """
        return state.drive is not None and self.velocity_noise == 0.0

    def _drive(self, state: Any) -> DriveFit:
        """Return the estimate of the drive; before the first series what is known of friction."""
        if state.drive is not None:
            return state.drive
        coulomb, viscous = self._friction(state)
        covariance = self._covariance(state)
        if not np.isfinite(covariance).all():
            covariance = np.diag([coulomb**2, (coulomb * self.pole()) ** 2])
        return DriveFit.first(coulomb, viscous, covariance)

    def _places(self, state: Any, swing: Swing, least: float) -> list[float]:
        # A short series is slow, where friction differs from that of a long one
        error = state.target - swing.position
        if abs(error) > self._near(state):
            return super()._places(state, swing, least)
        return super()._places(state, swing, max(least, _SHORTEST * state.travel))[-4:]

    def _next_series(
        self, state: LandingState, swing: Swing, later: float = 0.0
    ) -> PulseSeries | str:
        later += self._drive(state).delay * self.sampling_time
        series = super()._next_series(state, swing, later)
        return series if isinstance(series, str) else self._held(series)

    def _held(self, series: PulseSeries) -> PulseSeries:
        """Return the series with a time at its target, in which feedback settles."""
        n = max(1, round(_SETTLING / self.pole() / self.sampling_time))
        rest, place = np.zeros(n), np.full(n, series.target)
        return replace(
            series,
            effort=np.append(series.effort, rest),
            position=np.append(series.position, place),
            velocity=np.append(series.velocity, rest),
            load_position=np.append(series.load_position, place),
            load_velocity=np.append(series.load_velocity, rest),
        )

    def _launched(self, state: Any, sample: SensorSample, series: PulseSeries) -> Any:
        state = super()._launched(state, sample, series)
        return replace(state, integral=0.0, efforts=())

    def _planned_effort(self, state: Any) -> tuple[Any, float]:
        """Return the effort of a lost sample: the planned one and the integral."""
        sent = state.sent
        state, effort = super()._planned_effort(state)
        if state.sent == sent:
            return state, effort
        return self._recorded(state, effort + state.integral)

    def _landing(self, state: Any, sample: SensorSample) -> tuple[Any, float]:
        state = self._tracked(state, sample)
        state = self._transition(state, sample)
        if state.braking:
            return self._braked(state, sample)
        planned = state.flights[-1].planned if state.flights else None
        if state.phase.name != "series" or planned is None or state.sent >= planned.effort.size:
            return state, 0.0
        drive = self._drive(state)
        p = self.pole(drive.delay if drive.rows else _UNKNOWN)
        k, m1 = state.sent, self._estimated_arm(state).mass_1
        x, v, x2 = _planned_at(planned, k - drive.delay)
        e, e_dot = x - sample.measured_position, v - sample.measured_velocity
        stretch = sample.measured_position - sample.measured_load_position - (x - x2)
        feedback = m1 * p * (p * e + 2.0 * e_dot)
        feedback += self._estimated_arm(state).stiffness * stretch
        u = (float(planned.effort[k]) + feedback + state.integral) / drive.gain
        limit = self.effort_limit
        moves = v != 0.0
        if abs(u) < limit and moves:
            gain = _INTEGRAL * m1 * p**3
            state = replace(state, integral=state.integral + gain * e * self.sampling_time)
        state = replace(state, sent=k + 1)
        return self._recorded(state, min(max(u, -limit), limit))

    def _judged(self, state: Any, sample: SensorSample) -> Any:
        """Return the state of an arm at rest; friction, delay and gain are those of its series."""
        if state.track and state.efforts:
            n = min(len(state.efforts), len(state.track) - 1)
            drive = self._drive(state).after(
                self._estimated_arm(state),
                np.array(state.efforts[:n]),
                np.array(state.track)[: n + 1, 1:],
                sampling_time=self.sampling_time,
                velocity_noise=self.velocity_noise,
            )
            state = replace(state, drive=drive)
        swing = self._swing(state)
        miss = self._miss(state, swing)
        tried, best = state.series_since_target, state.best
        if tried > 0 and abs(state.target - swing.position) <= self._near(state):
            state = replace(state, best=min(best, miss))
            spent = tried + 2 > self.most_series  # to a place beyond, and back
            if miss > self.tolerance and (spent or miss > _IMPROVES * best):
                state = replace(state, track=())
                reason = "its series bring the arm no nearer to the target"
                return self._enter(state, sample, "stopped", reason)
        return super()._judged(state, sample)

    def _near(self, state: TrackedState) -> float:
        """Return the distance from which no series leads straight to the target [m or rad]."""
        return 0.5 * _SHORTEST * state.travel

    def _recorded(self, state: TrackedState, effort: float) -> tuple[TrackedState, float]:
        return replace(state, efforts=(*state.efforts, effort)), effort

    def _after_series(self, state: Any, swing: Swing) -> Any:
        """Note how the last series ended; learn from the efforts as sent."""
        if not state.track or not state.efforts:
            return super()._after_series(state, swing)
        last = state.flights[-1]
        n = min(len(state.efforts), last.planned.effort.size)
        effort = last.planned.effort.copy()
        effort[:n] = state.efforts[:n]
        sent = replace(last, planned=replace(last.planned, effort=effort))
        ratio = state.static_ratio
        state = super()._after_series(replace(state, flights=(*state.flights[:-1], sent)), swing)
        moved = abs(swing.position - last.planned.position[0]) > self._band
        # Feedback has freed a mass that began late
        return replace(state, static_ratio=ratio) if moved else state

    def _by_noise(self, planned: PulseSeries) -> float:
        del planned
        # A miss is that of feedback: only masses and spring that are uncertain are learned from it
        return inf

    def _running(self, state: LandingState) -> Any:
        return None if state.belief is None else super()._running(state)


def _planned_at(series: PulseSeries, k: float) -> tuple[float, float, float]:
    """Return positions of both masses and the velocity of mass 1 as planned, between samples."""
    k = min(max(k, 0.0), float(series.effort.size))
    i = min(int(k), series.effort.size - 1)
    s, T = k - i, series.sampling_time
    x, v, x2 = series.position, series.velocity, series.load_position
    place = (1.0 - s) * float(x[i]) + s * float(x[i + 1])
    # The straight line, and half of the constant acceleration
    place -= 0.5 * s * (1.0 - s) * T * float(v[i + 1] - v[i])
    speed = (1.0 - s) * float(v[i]) + s * float(v[i + 1])
    return place, speed, (1.0 - s) * float(x2[i]) + s * float(x2[i + 1])
