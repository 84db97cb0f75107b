"""Estimates of a landing by tracked series: drive, friction, load, and the lag of velocities."""

from dataclasses import dataclass, replace
from math import inf, isfinite
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.control.landing.arm import LandingController
from stickslip.control.landing.arm_belief import ArmBelief, Swing
from stickslip.control.landing.arm_plan import LandingState, PlanAnswer
from stickslip.control.landing.supervisor import LEAST_FRICTION
from stickslip.control.landing.tracked.drive_fit import DriveFit, SeenSeries
from stickslip.control.landing.tracked.poles import feedback_poles
from stickslip.control.landing.tracked.sensing import (
    acceleration,
    with_lag,
    with_load,
    with_velocities,
)
from stickslip.control.landing.tracked.state import TrackedAnswer, TrackedState
from stickslip.control.landing.tuning import TRACKING
from stickslip.planning import LoadLosses, PulseSeries
from stickslip.plants import FlexibleArm
from stickslip.records import SensorSample


@dataclass(frozen=True, kw_only=True)
class TrackedEstimates(LandingController):
    """Estimates from samples and series, and values computed in place of missing channels."""

    _states: ClassVar[type[LandingState]] = TrackedState
    _answers: ClassVar[type[PlanAnswer]] = TrackedAnswer

    def pole(self, delay: float = TRACKING.assumed_delay) -> float:
        """Return the double pole of the feedback [rad/s]; the delay of the drive is in samples."""
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

    def _losses(self, state: Any) -> LoadLosses:
        return state.load.losses

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
        ratio = state.static_ratio
        state = super()._after_series(replace(state, flights=(*state.flights[:-1], flown)), swing)
        state = replace(state, **self._fitted(state, sent[:n], seen[: n + 1]))
        moved = abs(swing.position - last.planned.position[0]) > self._band
        # Feedback has freed a mass that began late
        return replace(state, static_ratio=ratio) if moved else state

    def _fitted(
        self, state: Any, sent: Float[np.ndarray, " n"], seen: Float[np.ndarray, "m 4"]
    ) -> dict[str, Any]:
        """Return the estimates of drive and load after a series."""
        before, load = self._drive(state), state.load
        if state.belief is not None:
            # What was fitted with other masses has another gain
            fresh = DriveFit.first(*self._friction(state), self._learned_covariance(state.belief))
            before = replace(fresh, most=before.most)
        if not state.computed and state.belief is None:
            load = load.after(
                self.arm,
                seen,
                coulomb_friction=max(before.friction[0], LEAST_FRICTION * self.effort_limit),
                sampling_time=self.sampling_time,
                velocity_noise=self.velocity_noise,
            )
        series = SeenSeries(
            arm=self._estimated_arm(state),
            effort=sent,
            seen=seen,
            sampling_time=self.sampling_time,
            velocity_noise=self.velocity_noise,
            damping=load.losses.damping,
        )
        most = before.clipped(series, self.effort_limit)
        drive = before.after(series, most)
        drive = replace(drive, most=most, lag=self._lag(state) / self.sampling_time)
        return {"drive": drive, "load": load}

    def _learned_covariance(self, belief: ArmBelief) -> Float[np.ndarray, "2 2"]:
        """Return the covariance of friction where it was learned with the masses."""
        spread = belief.deviations
        least = LEAST_FRICTION * self.effort_limit
        coulomb = max(spread["coulomb_friction"], least)
        viscous = max(spread["viscous_friction"], least / self.pole())
        return np.diag([coulomb**2, viscous**2])

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
