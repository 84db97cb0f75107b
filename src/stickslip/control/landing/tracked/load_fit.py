"""Stiffness and losses of the load of an arm by the momentum of mass 2."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from stickslip.control.landing.tracked.drive_fit import integrals, momenta, regressed
from stickslip.control.landing.tuning import LANDING, LEARNING
from stickslip.planning import NO_LOSSES, LoadLosses
from stickslip.plants import FlexibleArm


@dataclass(frozen=True, kw_only=True)
class LoadFit:
    """Estimate of the share of the stiffness, of the spring's damping, and of friction on mass 2.

    m2 (v2_{k+1} - v2_k) = kappa ks int (x1 - x2) dt + d D(x1 - x2) - f_2 T sign(v2) - c_2 D(x2),
    with D(.) the change over a sample. It is Bayesian linear regression with normal prior; the
    prior of all losses is 0. ``arm`` has the mass 2 of which the frequency is as estimated; None
    before the first samples.
    """

    information: Float[np.ndarray, "4 4"] = field(default_factory=lambda: np.zeros((4, 4)))
    values: Float[np.ndarray, " 4"] = field(
        default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0])
    )  # kappa, d, f_2, c_2
    rows: int = 0
    arm: FlexibleArm | None = None

    @property
    def sure(self) -> Float[np.ndarray, " 4"]:
        """The values with every loss that is not certain taken for none, the least certain first.

        The others are then what they are given that.
        """
        values, kept = self.values.copy(), list(range(4))
        while len(kept) > 1:
            among = np.ix_(kept, kept)
            certain = values[kept] / np.sqrt(np.diag(np.linalg.inv(self.information[among])))
            least = 1 + int(np.argmin(certain[1:]))
            if certain[least] > LEARNING.significance:
                break
            place = kept.pop(least)
            J, own = self.information, values[place]
            values[place] = 0.0
            values[kept] += np.linalg.solve(J[np.ix_(kept, kept)], J[kept, place] * own)
        return values

    @property
    def losses(self) -> LoadLosses:
        """Losses, for the mass 2 of ``arm``; those that are not certain count as none."""
        if not self.rows:
            return NO_LOSSES
        stiffer, *losses = self.sure.tolist()
        return LoadLosses(*(each / stiffer for each in losses))

    def after(
        self,
        arm: FlexibleArm,
        seen: Float[np.ndarray, "n 4"],
        *,
        coulomb_friction: float,
        sampling_time: float,
        velocity_noise: float,
    ) -> "LoadFit":
        """Return the estimate after samples of positions and velocities of both masses.

        ``arm`` has the masses and the spring as known.
        """
        T, m2 = sampling_time, arm.mass_2
        x, v, x2, v2 = seen.T
        stretch, rate = x - x2, v - v2
        force = arm.stiffness * integrals(stretch, rate, T)
        way = np.sign(v2)
        # Not a row in which mass 2 turns or sticks
        speed = np.abs(v2)
        sticks = LEARNING.sticking_speed * float(speed.max())
        moves = speed > max(LANDING.moving_deviations * velocity_noise, sticks)
        used = moves[1:] & moves[:-1] & (way[1:] == way[:-1]) & np.isfinite(force)
        columns = (force, np.diff(stretch), -T * way[1:], -np.diff(x2))
        rows, values = np.column_stack(columns), m2 * np.diff(v2)
        rows, values = momenta(rows, values, used, noisy=velocity_noise > 0.0)
        if len(values) < LEARNING.min_rows:
            return self
        viscous = LEARNING.damping_spread * np.sqrt(arm.stiffness * m2)
        dry = LEARNING.dry_spread * coulomb_friction
        spread = np.array([LEARNING.stiffness_spread, viscous, dry, viscous])
        prior = self.information if self.rows else np.diag(spread**-2.0)
        largest = float(np.abs(force[used]).max())
        least = (LEARNING.exact_residual * largest) ** 2 + (m2 * velocity_noise) ** 2
        information, found = regressed(prior, self.values, rows, values, least)
        if not np.isfinite(found).all() or abs(found[0] - 1.0) > LEARNING.farthest_stiffness:
            return self
        fit = replace(self, information=information, values=found, rows=self.rows + len(values))
        return replace(fit, arm=replace(arm, mass_2=m2 / float(fit.sure[0])))
