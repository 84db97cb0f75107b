"""The motion of an arm along a series and after it, and what its parameters are by that motion."""

from dataclasses import dataclass, replace
from math import cos, exp, hypot, isfinite, log, sin, sqrt
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from stickslip.control.landing.tuning import LANDING, LEARNING
from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseSeries, forward_motion
from stickslip.plants import FlexibleArm
from stickslip.records import (
    AxisKind,
    InputError,
    LearnedPulses,
    non_negative,
    positive,
    quantity_field,
    unit_of,
)

LEARNED = ("mass", "load_mass", "stiffness", "coulomb_friction", "viscous_friction")
"""Names of the parameters, in the order of the covariance."""

_BODY, _FRICTION = slice(0, 3), slice(3, 5)
_ROUNDING = 1e-8  # of the way: sensors without noise
_CONVERGED = 1e-12  # relative change of cost and parameters that ends a fit
_FITS = 4  # at most, each with the noise that the residuals of the last one show
_EVALUATIONS = 60  # of the motion and its slopes in a fit
_TINY = 1e-12  # of the frequency: a weight for sensors without noise


@dataclass(frozen=True, kw_only=True)
class Swing:
    """Where mass 1 rests, and how mass 2 swings about that place."""

    position: float = quantity_field("position")  # of mass 1
    offset: float = quantity_field("position")  # position of mass 2 now, less that of mass 1
    velocity: float = quantity_field("velocity")  # of mass 2 now
    frequency: float  # of its swing, sqrt(k/m2) [rad/s]

    @classmethod
    def seen(
        cls,
        samples: Float[np.ndarray, "n 3"],
        *,
        arm: FlexibleArm,
        sampling_time: float,
        position_noise: float,
        velocity_noise: float,
    ) -> "Swing":
        """Fit a swing of the arm's frequency to samples, by weighted least squares.

        While mass 1 rests at x1, x2 = x1 + a cos(w t) + b sin(w t), with t = 0 at the last sample
        (van de Wijdeven 2002 A Eq. 2.3 with x1' = 0). Samples are position, load position and load
        velocity; the noises are standard deviations of a sample, 0 for none.
        """
        w = sqrt(arm.stiffness / arm.mass_2)
        phase = w * sampling_time * np.arange(1 - len(samples), 1)
        x1 = float(samples[:, 0].mean())
        cosine, sine = np.cos(phase), np.sin(phase)
        rows = np.concatenate(
            (np.column_stack((cosine, sine)), w * np.column_stack((-sine, cosine)))
        )
        values = np.concatenate((samples[:, 1] - x1, samples[:, 2]))
        # Only the ratio of the weights counts; without noise all are alike, as lengths
        known = position_noise > 0.0 or velocity_noise > 0.0
        of_position = max(position_noise, _TINY * velocity_noise / w) if known else 1.0
        of_velocity = max(velocity_noise, _TINY * position_noise * w) if known else w
        weight = np.repeat((1.0 / of_position, 1.0 / of_velocity), len(samples))
        weighted = rows * weight[:, None]
        # Two columns that are never alike: normal equations do
        a, b = np.linalg.solve(weighted.T @ weighted, weighted.T @ (values * weight))
        return cls(position=x1, offset=float(a), velocity=float(w * b), frequency=w)

    @property
    def amplitude(self) -> float:
        """Of the swing [m or rad]."""
        return hypot(self.offset, self.velocity / self.frequency)

    def state(self, later: float = 0.0) -> tuple[float, float, float, float]:
        """Return the arm's state some time from now [s], if mass 1 goes on to rest."""
        w, turn = self.frequency, self.frequency * later
        offset = self.offset * cos(turn) + self.velocity / w * sin(turn)
        velocity = self.velocity * cos(turn) - self.offset * w * sin(turn)
        return self.position, 0.0, self.position + offset, velocity


@dataclass(frozen=True, kw_only=True)
class FlightLog:
    """The samples along a series of n pulses' samples; positions and velocities of both masses."""

    start: tuple[float, float, float, float]  # at its begin, as fitted while mass 1 rested
    effort: Float[np.ndarray, " n"]
    expected_velocity: Float[np.ndarray, " n+1"]  # of mass 1 as planned
    seen: Float[np.ndarray, "n+1 4"]  # at its begin and after each sample
    sampling_time: float
    position_noise: float  # standard deviations of a sample, 0 for none
    velocity_noise: float

    @classmethod
    def of(
        cls,
        planned: PulseSeries,
        seen: Float[np.ndarray, "m 4"],
        *,
        position_noise: float,
        velocity_noise: float,
    ) -> "FlightLog":
        """Return the log of a series that was sent as planned, or of the part that was sent.

        It was seen in the sample at its begin, and in the one after each of its own; NaN where one
        was lost.
        """
        x1, _, x2, v2 = planned.states[0].tolist()
        return cls(
            start=(x1, 0.0, x2, v2),
            effort=planned.effort[: len(seen) - 1],
            expected_velocity=planned.velocity[: len(seen)],
            seen=seen,
            sampling_time=planned.sampling_time,
            position_noise=position_noise,
            velocity_noise=velocity_noise,
        )

    @property
    def direction(self) -> float:
        """1.0 or -1.0, as mass 1 has moved."""
        seen = self.seen[np.isfinite(self.seen[:, 0]), 0]
        return 1.0 if seen[-1] > self.start[0] else -1.0

    @property
    def _fast(self) -> Bool[np.ndarray, " n"]:
        """Whether mass 1 surely moves on, after each sample; as after the one before if lost."""
        fast = self.direction * self.seen[1:, 1] > LANDING.moving_deviations * self.velocity_noise
        known = np.isfinite(self.seen[1:, 1])
        last = np.maximum.accumulate(np.where(known, np.arange(known.size), -1))
        return np.where(last >= 0, fast[last], False)

    @property
    def late(self) -> bool:
        """Whether mass 1 stuck when it should have moved, as its static friction is higher."""
        fast = self._fast
        stuck = int(np.argmax(fast)) if fast.any() else fast.size
        expected = self.direction * self.expected_velocity[1 : stuck + 1]
        return bool((expected > 2.0 * LANDING.moving_deviations * self.velocity_noise).any())

    def largest_force(self, arm: FlexibleArm) -> float:
        """Return an upper bound of the force on mass 1: largest effort and spring [N or N m]."""
        stretch = float(np.nanmax(np.abs(self.seen[:, 0] - self.seen[:, 2])))
        return float(np.abs(self.effort).max()) + arm.stiffness * stretch

    def slipping(self) -> int:
        """Return for how many samples mass 1 has slipped, from the begin on, without a stop."""
        fast = self._fast
        if not fast.any():
            return 0
        slow = ~fast[int(np.argmax(fast)) :]
        return fast.size - slow.size + (int(np.argmax(slow)) if slow.any() else slow.size)


@dataclass(frozen=True, kw_only=True)
class RunningFriction:
    """Friction by the estimator that runs along, for comparison with that of a series."""

    coulomb_friction: float = quantity_field("coulomb_friction")
    viscous_friction: float = quantity_field("viscous_friction")
    covariance: Float[np.ndarray, "2 2"]
    speed: float = quantity_field("velocity")  # at which they are compared: that of a move

    def agrees(self, coulomb_friction: float, viscous_friction: float) -> bool:
        """Return whether a friction takes about the same effort at the speed of a move."""
        row = np.array([1.0, self.speed])
        other = coulomb_friction + viscous_friction * self.speed
        own = self.coulomb_friction + self.viscous_friction * self.speed
        variance = float(row @ self.covariance @ row)
        deviations, share = LEARNING.agreeing_deviations, LEARNING.agreeing_share
        if not isfinite(variance):
            return True
        return bool(abs(other - own) <= deviations * sqrt(max(variance, 0.0)) + share * abs(own))


@dataclass(frozen=True, kw_only=True)
class ArmBelief:
    """Estimated masses, spring and friction of an arm, with their covariance.

    The covariance is that of the logarithms of `LEARNED`.
    """

    arm: FlexibleArm
    covariance: Float[np.ndarray, "5 5"]

    @classmethod
    def first(
        cls,
        arm: FlexibleArm,
        *,
        uncertainty: float,
        coulomb_friction: float,
        viscous_friction: float,
        covariance: Float[np.ndarray, "2 2"],
    ) -> "ArmBelief":
        """Return the estimate before the first series.

        ``uncertainty`` is the relative standard deviation of masses and spring; ``covariance`` that
        of Coulomb and viscous friction, as estimated with these masses and spring.
        """
        P = np.diag([uncertainty**2] * 3 + [(LEARNING.friction_ratio * uncertainty) ** 2] * 2)
        if np.isfinite(covariance).all():
            # A logarithm describes a value that is known to within a factor only: one that is not
            # known so well is taken to be as large as its deviation
            spread = np.sqrt(np.diag(covariance))
            coulomb_friction = max(coulomb_friction, float(spread[0]))
            typical = LEARNING.typical_viscous / LEARNING.least_viscous * _least_viscous(arm)
            viscous_friction = max(viscous_friction, min(float(spread[1]), typical))
            of_one = 1.0 / np.array([coulomb_friction, max(viscous_friction, _least_viscous(arm))])
            relative = np.maximum(spread * of_one, 1e-300)
            of_one *= np.minimum(1.0, LEARNING.unknown_friction / relative)
            P[_FRICTION, _FRICTION] += covariance * np.outer(of_one, of_one)
        else:
            P[_FRICTION, _FRICTION] += LEARNING.unknown_friction**2 * np.eye(2)
        return cls(
            arm=replace(arm, friction=_law(arm, coulomb_friction, viscous_friction)),
            covariance=P,
        )

    @classmethod
    def resumed(cls, arm: FlexibleArm, learned: LearnedPulses) -> "ArmBelief":
        """Return what an earlier run has learned; of ``arm`` the offset and the kind count."""
        m1, m2, ks, fc, c = (learned.values[name] for name in LEARNED)
        law = CoulombViscousFriction.symmetric(
            coulomb_friction=fc,
            viscous_friction=c,
            static_friction=learned.values.get("static_friction", fc),
            offset=arm.friction.offset,
        )
        body = replace(arm, mass_1=m1, mass_2=m2, stiffness=ks, friction=law)
        return cls(arm=body, covariance=learned.covariance).later()

    def later(self) -> "ArmBelief":
        """Return the estimate some time later: friction may have changed."""
        P = self.covariance.copy()
        P[_FRICTION, _FRICTION] += LEARNING.friction_drift**2 * np.eye(2)
        return replace(self, covariance=P)

    @property
    def values(self) -> dict[str, float]:
        """By the names of `LEARNED` [SI]."""
        arm, law = self.arm, self.arm.friction
        friction = (law.coulomb_friction_positive, law.viscous_friction_positive)
        return dict(zip(LEARNED, (arm.mass_1, arm.mass_2, arm.stiffness, *friction), strict=True))

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviations of the values, by name [SI]."""
        relative = np.sqrt(np.diag(self.covariance)).tolist()
        every = zip(self.values.items(), relative, strict=True)
        return {name: value * spread for (name, value), spread in every}

    def after(self, flight: FlightLog, running: RunningFriction | None = None) -> "ArmBelief":
        """Return the estimate after a series, corrected by where it has taken both masses.

        While mass 1 slips, the motion is that of a linear system; the parameters, and the state of
        mass 2 at the begin, are those that explain the measured motion best, beside what was
        known before (an iterated extended Kalman filter, the whole series as one observation).
        Nothing is learned from a motion that none explain, as of an arm that was pushed, nor from
        one that began late. An estimate far from the prior, or with a friction that disagrees with
        the running estimate, is rejected.
        """
        n = flight.slipping()
        if n < LEARNING.slip_samples or flight.late:
            return self
        found, size, unlike = self._explained(flight, n)
        theta, jacobian = found.x, np.asarray(found.jac)
        if unlike or float(np.sum(found.fun[size:] ** 2)) > LEARNING.surprise:
            return self
        if np.exp(theta[3]) > flight.largest_force(self.arm):
            return self
        if running is not None and not running.agrees(*np.exp(theta[3:5]).tolist()):
            return self
        spread = np.linalg.inv(jacobian.T @ jacobian)[:5, :5]
        spread = spread * max(1.0, 2.0 * float(found.cost) / size)
        m1, m2, ks, fc, c = (exp(value) for value in theta[:5])
        law = _law(self.arm, fc, c)
        return ArmBelief(
            arm=replace(self.arm, mass_1=m1, mass_2=m2, stiffness=ks, friction=law),
            covariance=0.5 * (spread + spread.T),
        )

    def _explained(self, flight: FlightLog, n: int) -> tuple[Any, int, bool]:
        """Return the fit to the first samples of a series, and whether it does not explain them.

        Its residuals are those of the motion, whose number is the second value, and those of the
        prior. The noise is at least what the residuals show, so that errors of the model do not
        pass for information.
        """
        from scipy.optimize import least_squares

        arm, start = self.arm, flight.start
        frequency = (arm.stiffness / arm.mass_2) ** 0.5
        *others, viscous = self.values.values()
        values = (*others, max(viscous, _least_viscous(arm)))
        first = np.array([*map(log, values), start[2], start[3]])
        way = float(np.nanmax(np.abs(flight.seen[: n + 1, 0] - start[0])))
        of_position = max(flight.position_noise, _ROUNDING * way)
        of_velocity = max(flight.velocity_noise, _ROUNDING * way * frequency)
        weight = 1.0 / np.array([of_position, of_velocity] * 2)
        swing = float(np.hypot(start[2] - start[0], start[3] / frequency))
        loose = swing * float(np.sqrt(np.diag(self.covariance)[_BODY].max())) + of_position
        walk = np.array([LEARNING.body_walk] * 3 + [LEARNING.friction_walk] * 2)
        prior = np.zeros((7, 7))
        prior[:5, :5] = self.covariance + np.diag(walk**2)
        prior[5, 5], prior[6, 6] = loose**2, (loose * frequency) ** 2
        whiten = np.linalg.inv(np.linalg.cholesky(prior))
        measured = flight.seen[1 : n + 1]
        known = np.isfinite(measured)  # samples were lost
        measured = np.where(known, measured, 0.0)

        def residual(theta: Float[np.ndarray, " 7"], noise: float) -> Float[np.ndarray, " r"]:
            explained = np.where(known, self._motion(theta, flight, n) - measured, 0.0)
            return np.concatenate([(explained * weight).ravel() / noise, whiten @ (theta - first)])

        found: Any = None
        noise = rms = 1.0
        for _ in range(_FITS):
            noise *= rms
            found = least_squares(
                residual,
                first if found is None else found.x,
                jac="3-point",
                x_scale=np.array([1.0] * 5 + [way, way * frequency]),
                ftol=_CONVERGED,
                xtol=_CONVERGED,
                max_nfev=_EVALUATIONS,
                args=(noise,),
            )
            rms = float(np.sqrt(np.mean(found.fun[: measured.size] ** 2)))
            if rms <= LEARNING.explained_residual:
                break
        deviations, share = LEARNING.unexplained_deviations, LEARNING.unexplained_travel
        return found, measured.size, noise * rms > max(deviations, share * way / of_position)

    def _motion(
        self, theta: Float[np.ndarray, " 7"], flight: FlightLog, samples: int
    ) -> Float[np.ndarray, "n 4"]:
        """Return the states after each of the first samples, with these parameters."""
        m1, m2, ks, fc, c = np.exp(theta[:5]).tolist()
        way = flight.direction
        x1 = flight.start[0]
        start = way * np.array([0.0, 0.0, theta[5] - x1, theta[6]])
        states = forward_motion(
            replace(self.arm, mass_1=m1, mass_2=m2, stiffness=ks),
            resistance=fc + way * self.arm.friction.offset,
            viscous_friction=c,
            sampling_time=flight.sampling_time,
            start=start,
            effort=way * flight.effort[:samples],
        )
        return way * states[1:] + np.array([x1, 0.0, x1, 0.0])


def check_learned(learned: LearnedPulses, kind: AxisKind) -> None:
    """Check that an earlier run has learned masses, spring and friction of such an arm."""
    learned.check(method="landing", kind=kind, names=LEARNED)
    for name in LEARNED:
        check = non_negative if name == "viscous_friction" else positive
        check(name, learned.values[name], unit_of(name, kind))
    P, size = learned.covariance, len(LEARNED)
    if P.shape != (size, size):
        raise InputError("covariance_shape", where="covariance", shape=P.shape, size=size)
    if not (P.T == P).all() or np.linalg.eigvalsh(P)[0] < -_ROUNDING:
        raise InputError("covariance_not_definite", where="covariance")


def _least_viscous(arm: FlexibleArm) -> float:
    return LEARNING.least_viscous * arm.mass_1 * (arm.stiffness / arm.mass_2) ** 0.5


def _law(arm: FlexibleArm, coulomb: float, viscous: float) -> CoulombViscousFriction:
    return CoulombViscousFriction.symmetric(
        coulomb_friction=coulomb, viscous_friction=viscous, offset=arm.friction.offset
    )
