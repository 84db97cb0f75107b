"""The balance of work along motions that carry no noise.

Van de Wijdeven (2002) multiplies the balance of forces by the measured velocity and sums: noise of
the velocity then meets noise of the forces, and the mean of their product must be compensated. The
balance of work holds along any other velocity as well (virtual work). Along those that the Kalman
filter of the masses and the spring picks, the sensor noise enters once only and cancels best: there
is no product of noises and no variance that must be known, and feedback of the noise into the
effort does no harm, as the effort is known. The measured motion decides only where friction acts in
which direction.

The driven mass m need not be known. With m_0 in its place, it moves as if besides its friction f
the force (m_0/m - 1) (q - f) acted, q being effort less spring force, so that

    friction that m_0 sees = (1 - m_0/m) q + (m_0/m) f ,

linear in 1 - m_0/m and in the parameters of f times m_0/m: q is one more column. The estimate of m
takes the place of m_0, until it stays.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.free_friction import HeldAxis
from stickslip.estimation.energy.known_inertia.stretches import (
    PreparedStretches,
    load_reconstruction_note,
    prepared,
)
from stickslip.estimation.energy.levels import AxisModel
from stickslip.estimation.fit.diagnostics import determined
from stickslip.estimation.fit.least_cost import least_decades
from stickslip.estimation.fit.rows import Regression, least_squares, summarise_motion, triangle
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.records import AxisLog

_DISTURBANCE = (-14.0, 2.0)  # decades of a disturbing force's variance over that of friction
_GRID = 9  # places on that range where the search begins [-]
_DECADE_TOLERANCE = 0.2  # of the search [decades]; the rows hardly depend on the variance
_MOST_DISTURBED = 0.25
"""Disturbance force, over the effort, beyond which levels of energy are used instead [-]: then it
is model mismatch at the rate of the samples, such as an elastic drive or a ripple, and energies of
longer blocks average it."""
_MOST_PASSES = 6  # of a search of the mass [-]
_SAME_MASS = 1e-4
"""Relative change of the mass below which it stays: what is left of a change is its square."""

_Beside = Literal["effort", "all but friction"] | None
"""One more force against the motion: the effort, or all but friction where friction counts."""


def work_regression(
    parts: Sequence[AxisLog],
    model: AxisModel,
    low_pass: LowPass,
    *,
    samples: int,
    notes: tuple[str, ...],
) -> Regression:
    """Return the whitened rows of the balance; their least squares is the estimate.

    Friction enters where the direction of the smoothed motion is certain; elsewhere, at reversals
    and rests, it is any force of a few times its size. The size of a disturbing force besides is
    estimated by maximum likelihood. A load whose position is not measured is one more state of the
    filter, estimated from its pull on the driven mass; where it began is not assumed.

    ``parts`` are stretches without gaps, ``samples`` and ``notes`` (what was done to it before) are
    those of the whole log; the low-pass separates the noise of the sensors from motion.
    """
    balance = _Balance.of(parts, model, low_pass)
    decades = balance.likeliest()
    white = balance.rows(decades, "effort")
    return balance.regression(
        model.terms.names,
        target=white[:, 0],
        regressors=white[:, 1:-1],
        effort=white[:, -1],
        samples=samples,
        notes=(*balance.notes(decades), *notes),
    )


def sought_regression(
    levels: Regression,
    parts: Sequence[AxisLog],
    model: AxisModel,
    low_pass: LowPass,
    *,
    notes: tuple[str, ...],
) -> Regression:
    """Return the whitened rows of an axis whose inertia is sought, its column the first.

    The balance of energies ``levels`` gives the first guess. It is returned as it is if it does not
    determine the inertia, the search from there fails, or samples are explained too badly. The
    other arguments are those of `work_regression`; the model's inertia is not read.
    """
    inertia, decades = _first_inertia(levels), None
    for _ in range(_MOST_PASSES):
        if not inertia > 0.0:
            return levels
        balance = _Balance.of(parts, replace(model, inertia=inertia), low_pass)
        if decades is None:  # what a wrong mass leaves is no disturbance: its column takes it
            decades = balance.likeliest("all but friction")
            if balance.disturbance(decades) > _MOST_DISTURBED * balance.effort:
                return levels
        white = balance.rows(decades, "all but friction")
        target, friction, push = white[:, 0], white[:, 1:-1], white[:, -1]
        values = least_squares(white[:, 1:], target)
        share = 1.0 - float(values[-1])  # m_0 / m
        inertia = balance.inertia / share if share > 0.0 else 0.0
        if abs(share - 1.0) < _SAME_MASS:
            break
    else:
        return levels
    # d / dm of the friction that m_0 sees, at m = m_0: (q - f) / m_0
    pushing = (push - friction @ (values[:-1] / share)) / balance.inertia
    return balance.regression(
        levels.names,
        target=target + balance.inertia * pushing,
        regressors=np.column_stack([pushing, friction]),
        effort=balance.rows(decades, "effort")[:, -1],
        samples=levels.samples,
        notes=(*balance.notes(decades), *notes),
    )


def _first_inertia(levels: Regression) -> float:
    """Return the inertia from levels of energy [kg or kg m^2]; 0 if they do not determine it."""
    regressors, target = levels.regressors, levels.target
    if target.size < regressors.shape[1]:
        return 0.0
    if not determined(regressors, levels.regressor_noise).mask(len(levels.names))[0]:
        return 0.0
    return float(least_squares(regressors, target)[0])


@dataclass(frozen=True, kw_only=True)
class _Balance:
    """The balance of a log, with the masses as they are or are taken to be."""

    inertia: float
    axis: HeldAxis
    log: PreparedStretches

    @classmethod
    def of(cls, parts: Sequence[AxisLog], model: AxisModel, low_pass: LowPass) -> "_Balance":
        return cls(
            inertia=model.driven,
            axis=HeldAxis.of(model, parts[0].sampling_time),
            log=prepared(parts, model, low_pass),
        )

    def _whitened(self, decades: float, beside: _Beside) -> tuple[Float[np.ndarray, "r c"], float]:
        """Return the rows, and the sum of the logarithms of their variances."""
        rows: list[Float[np.ndarray, "r c"]] = []
        total = 0.0
        for s in self.log.stretches:
            forces, slopes = [s.friction], [s.slope]
            if beside is not None:
                pushes = beside == "all but friction"
                forces.append((s.push if pushes else s.part.effort)[:, None])
                slopes.append(s.push_slope[:, None] * pushes)
            white, logs = self.axis.whiten(
                s.sensors,
                s.part.effort,
                np.hstack(forces),
                np.hstack(slopes),
                self.log.size**2 * (s.doubt + 10.0**decades),
            )
            rows.append(white)
            total += logs
        return np.concatenate(rows), total

    def rows(self, decades: float, beside: _Beside) -> Float[np.ndarray, "r c"]:
        """Return measurements, friction regressors and the force beside them, whitened.

        ``decades`` are those of a disturbing force's variance over the mean square of friction.
        """
        return self._whitened(decades, beside)[0]

    def likeliest(self, beside: _Beside = None) -> float:
        """Return the decades of a disturbing force's variance that make the log likeliest."""

        def cost(decades: float) -> float:
            white, logs = self._whitened(decades, beside)
            # With the measurements last, the last of R is the norm of their residual
            left = triangle(np.roll(white, -1, axis=1))
            return float(left[-1, -1] ** 2) + logs

        return least_decades(cost, _DISTURBANCE, grid=_GRID, tolerance=_DECADE_TOLERANCE)

    def regression(
        self,
        names: tuple[str, ...],
        *,
        target: Float[np.ndarray, " r"],
        regressors: Float[np.ndarray, "r p"],
        effort: Float[np.ndarray, " r"],
        samples: int,
        notes: tuple[str, ...],
    ) -> Regression:
        """Return rows on a typical scale, on which each is a force."""
        friction = [k for k, name in enumerate(names) if name.startswith("coulomb")]
        scale = float(np.sqrt(np.mean(np.sum(regressors[:, friction] ** 2, axis=1)))) or 1.0
        stretches = self.log.stretches
        parts = [s.part for s in stretches]
        times = [np.repeat(s.part.time[1:], s.sensors.states.size) for s in stretches]
        return Regression(
            kind=parts[0].kind,
            names=names,
            time=np.concatenate(times),
            target=target / scale,
            regressors=regressors / scale,
            effect=float(np.linalg.norm(effort)) / scale,
            regressor_noise=np.zeros(len(names)),
            quantity="effort",
            motion=summarise_motion(
                [part.measured_position for part in parts],
                [s.motion.velocity for s in stretches],
                parts[0].sampling_time,
                (self.log.position_noise, self.log.spread),
            ),
            samples=samples,
            notes=notes,
        )

    @property
    def effort(self) -> float:
        """Root mean square of the effort [N or N m]."""
        effort = np.concatenate([s.part.effort for s in self.log.stretches])
        return float(np.sqrt(np.mean(effort**2)))

    def disturbance(self, decades: float) -> float:
        """Return the standard deviation of a disturbing force [N or N m]."""
        return self.log.size * float(10.0 ** (0.5 * decades))

    def notes(self, decades: float) -> tuple[str, ...]:
        """Return what a user should know of the disturbing force and of a load."""
        part = self.log.stretches[0].part
        return (
            f"a disturbing force, white from sample to sample, is taken to have "
            f"{self.disturbance(decades):.2g} {part.unit('effort')} rms "
            "(maximum likelihood)",
            *load_reconstruction_note(part, [s.motion for s in self.log.stretches]),
        )
