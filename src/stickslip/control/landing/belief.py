"""What is believed of an arm, corrected by the motion along each series."""

from dataclasses import dataclass, replace
from math import exp, log

import numpy as np
from jaxtyping import Float

from stickslip.friction import CoulombViscousFriction
from stickslip.planning import forward_motion
from stickslip.plants import FlexibleArm

__all__ = ["ArmBelief", "FlightLog"]

_BODY, _FRICTION, _BEGIN = slice(0, 3), slice(3, 5), slice(5, 7)
_CARRIED = 6.0  # by which what the feedback finds of friction is more wrong than masses and spring
_LEAST_VISCOUS = 1e-3  # of m1 times the frequency of mass 2: stands for none, it has a logarithm
_LEAST_SAMPLES = 8  # of slipping: fewer tell too little
_CERTAIN = 4.0  # standard deviations of a measured velocity
_ROUNDING = 1e-8  # of the way: sensors without noise
_CONVERGED = 1e-12


@dataclass(frozen=True, kw_only=True)
class FlightLog:
    """What was seen along a series.

    Attributes
    ----------
    start
        State at its begin, as fitted while mass 1 rested.
    effort
        Of each sample, shape (n,).
    seen
        Position and velocity of mass 1, then of mass 2, at its begin and after each sample, shape
        (n+1, 4).
    sampling_time
        [s].
    position_noise, velocity_noise
        Standard deviations of a sample [m or rad, m/s or rad/s]; 0 for none.
    """

    start: tuple[float, float, float, float]
    effort: Float[np.ndarray, " n"]
    seen: Float[np.ndarray, "n+1 4"]
    sampling_time: float
    position_noise: float
    velocity_noise: float

    @property
    def direction(self) -> float:
        """1.0 or -1.0, as mass 1 has moved."""
        return 1.0 if self.seen[-1, 0] > self.start[0] else -1.0

    def slipping(self) -> int:
        """Return for how many samples mass 1 has slipped, from the begin on, without a stop."""
        fast = self.direction * self.seen[1:, 1] > _CERTAIN * self.velocity_noise
        if not fast.any():
            return 0
        slow = ~fast[int(np.argmax(fast)) :]
        return fast.size - slow.size + (int(np.argmax(slow)) if slow.any() else slow.size)


@dataclass(frozen=True, kw_only=True)
class ArmBelief:
    """Masses, spring and friction of an arm as they are believed to be, and how surely.

    Attributes
    ----------
    arm
        As believed.
    covariance
        Of the logarithms of mass 1, mass 2, stiffness, Coulomb and viscous friction.
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
        """Return what is believed before the first series.

        Parameters
        ----------
        arm
            With masses and spring as they are taken to be.
        uncertainty
            Standard deviation of each of them, over its value [-].
        coulomb_friction, viscous_friction
            As estimated with them [N or N m, N s/m or N m s/rad].
        covariance
            Of these two, if masses and spring are right.
        """
        P = np.diag([uncertainty**2] * 3 + [(_CARRIED * uncertainty) ** 2] * 2)
        of_one = 1.0 / np.array([coulomb_friction, max(viscous_friction, _least_viscous(arm))])
        if np.isfinite(covariance).all():
            P[3:, 3:] += covariance * np.outer(of_one, of_one)
        return cls(
            arm=replace(arm, friction=_law(arm, coulomb_friction, viscous_friction)),
            covariance=P,
        )

    def after(self, flight: FlightLog) -> "ArmBelief":
        """Return the belief after a series, corrected by where it has taken both masses.

        While mass 1 slips, the motion is that of a linear system; the parameters, and the state of
        mass 2 at the begin, are those that explain the measured motion best, beside what was
        believed before (an iterated extended Kalman filter, the whole series as one observation).

        Parameters
        ----------
        flight
            As it was seen.
        """
        n = flight.slipping()
        if n < _LEAST_SAMPLES:
            return self
        arm, law = self.arm, self.arm.friction
        frequency = (arm.stiffness / arm.mass_2) ** 0.5
        first = np.array(
            [
                log(arm.mass_1),
                log(arm.mass_2),
                log(arm.stiffness),
                log(law.coulomb_friction_positive),
                log(max(law.viscous_friction_positive, _least_viscous(arm))),
                flight.start[2],
                flight.start[3],
            ]
        )
        way = abs(float(flight.seen[n, 0]) - flight.start[0])
        of_position = max(flight.position_noise, _ROUNDING * way)
        of_velocity = max(flight.velocity_noise, _ROUNDING * way * frequency)
        weight = 1.0 / np.array([of_position, of_velocity] * 2)
        swing = float(np.hypot(flight.start[2] - flight.start[0], flight.start[3] / frequency))
        loose = swing * float(np.sqrt(np.diag(self.covariance)[_BODY].max())) + of_position
        prior = np.zeros((7, 7))
        prior[:5, :5] = self.covariance
        prior[5, 5], prior[6, 6] = loose**2, (loose * frequency) ** 2
        whiten = np.linalg.inv(np.linalg.cholesky(prior))
        scale = np.array([1.0] * 5 + [way, way * frequency])
        measured = flight.seen[1 : n + 1]

        def residual(theta: Float[np.ndarray, " 7"]) -> Float[np.ndarray, " r"]:
            explained = ((self._motion(theta, flight, n) - measured) * weight).ravel()
            return np.concatenate([explained, whiten @ (theta - first)])

        from scipy.optimize import least_squares

        found = least_squares(
            residual, first, jac="3-point", x_scale=scale, ftol=_CONVERGED, xtol=_CONVERGED
        )
        jacobian = np.asarray(found.jac)
        spread = np.linalg.inv(jacobian.T @ jacobian)[:5, :5]
        spread = spread * max(1.0, 2.0 * float(found.cost) / measured.size)
        theta = found.x
        body = [exp(value) for value in theta[:5]]
        return ArmBelief(
            arm=replace(
                arm,
                mass_1=body[0],
                mass_2=body[1],
                stiffness=body[2],
                friction=_law(arm, body[3], body[4]),
            ),
            covariance=0.5 * (spread + spread.T),
        )

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


def _least_viscous(arm: FlexibleArm) -> float:
    return _LEAST_VISCOUS * arm.mass_1 * (arm.stiffness / arm.mass_2) ** 0.5


def _law(arm: FlexibleArm, coulomb: float, viscous: float) -> CoulombViscousFriction:
    return CoulombViscousFriction.symmetric(
        coulomb_friction=coulomb, viscous_friction=viscous, offset=arm.friction.offset
    )
