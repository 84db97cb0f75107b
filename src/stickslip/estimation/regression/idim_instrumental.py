"""Inverse dynamic identification with instrumental variables (IDIM-IV).

A. Janot, P.-O. Vandanjon and M. Gautier (2014), "A generic instrumental variable approach for
industrial robot identification", IEEE Transactions on Control Systems Technology 22(1), 132-145.
The rows W of the inverse dynamic model hold the noise of differentiated positions, which biases
least squares. Rows Z of the same model, made from a simulation with the parameters found so far,
move as W does and hold none of that noise:

    theta = (Z' W)^-1 Z' y,

which is repeated until theta no longer changes. In the papers the simulated axis follows the
reference of the true one under the same controller. A log holds neither; here the simulated axis
gets the logged effort, and a slow feedback to the measured motion keeps the two from drifting
apart.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import provenance_of, solve
from stickslip.estimation.prepare import repaired
from stickslip.estimation.regression.identified_law import identified_law
from stickslip.estimation.regression.idim_least_squares import IdimLeastSquares
from stickslip.estimation.settings import options_of
from stickslip.estimation.signals.kinematics import LowPass, central_difference
from stickslip.plants import SingleMass
from stickslip.records import AxisKind, AxisLog, FrictionEstimate, InputError, positive
from stickslip.simulation import PlantStepper

__all__ = ["IdimInstrumentalVariables"]

MOST_ROUNDS = 10
CLOSE = 0.05
"""Largest change of a parameter in a round, over its standard deviation under white residuals, at
which it counts as found."""

ROUNDING = 1e-9

_LEAST_SHARE = 0.2  # of the rows, that simulated and measured motion must have in common


@dataclass(frozen=True, kw_only=True)
class IdimInstrumentalVariables:
    """Least squares of the inverse dynamics, freed from the bias of its noisy rows.

    Attributes
    ----------
    inertia
        Moving mass or inertia if it is known [kg or kg m^2]; None estimates it.
    per_direction, offset, filter_order, decimation
        As of `IdimLeastSquares`.
    cutoff
        Of the low-pass on the position [Hz]; None takes a tenth of the sampling rate and at most
        100 Hz.
    feedback
        Bandwidth of what holds the simulated axis to the measured one [Hz]. Noise of the position
        below it comes into the instruments: it should be slow beside the cutoff.

    Examples
    --------
    >>> IdimInstrumentalVariables(per_direction=True).name
    'idim-iv'
    """

    inertia: float | None = None
    per_direction: bool = False
    offset: bool | None = None
    cutoff: float | None = None
    filter_order: int = 4
    decimation: int | None = None
    feedback: float = 0.2

    def __post_init__(self) -> None:
        positive("feedback", self.feedback, "Hz")
        _ = self._rows

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "idim-iv"

    @property
    def _rows(self) -> IdimLeastSquares:
        """What makes the rows of the inverse dynamic model."""
        return IdimLeastSquares(
            inertia=self.inertia,
            per_direction=self.per_direction,
            offset=self.offset,
            cutoff=self.cutoff,
            filter_order=self.filter_order,
            decimation=self.decimation,
        )

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the rows.

        Parameters
        ----------
        kind
            ``"linear"`` or ``"rotary"``.
        """
        return self._rows.parameter_names(kind)

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log.

        Raises
        ------
        InputError
            If the log is too short, or nothing moves or pushes in it, or the model that is found on
            the way does not move as the axis does.
        """
        return self.details(log).estimate

    def details(self, log: AxisLog) -> Fit:
        """Return the estimate with its rows, for a report.

        Raises
        ------
        InputError
            As `fit` does.
        """
        rows = self.regression(log)
        provenance = provenance_of(log, options_of(self))
        return Fit(
            estimate=solve(rows, estimator=self.name, provenance=provenance),
            rows=rows,
            inertia=self.inertia,
            cutoff=self.cutoff,
            filter_order=self.filter_order,
        )

    def regression(self, log: AxisLog) -> Regression:
        """Return rows whose least-squares solution is that of the instrumental variables.

        With Q an orthonormal basis of the instruments, least squares of y on Q Q' W gives theta;
        taking y less (W - Q Q' W) theta for the target leaves that as it is, and makes the residual
        that of the model, y - W theta.

        Raises
        ------
        InputError
            As `fit` does.
        """
        log = repaired(log)
        measured = self._rows.regression(_as_it_acts(log))
        start, *_ = np.linalg.lstsq(measured.regressors, measured.target, rcond=None)
        theta, rows, projected = start, measured, measured.regressors
        count, settled = 0, False
        while count < MOST_ROUNDS and not settled:
            count += 1
            values = dict(zip(measured.names, theta.tolist(), strict=True))
            simulated = self._rows.regression(self._simulated(log, values))
            rows, instruments = _common(measured, simulated, log.name)
            basis, _ = np.linalg.qr(instruments)
            projected = basis @ (basis.T @ rows.regressors)
            before = theta
            theta, *_ = np.linalg.lstsq(projected, rows.target, rcond=None)
            spread = float(np.std(rows.target - rows.regressors @ theta))
            deviations = spread * np.linalg.norm(np.linalg.pinv(projected), axis=1)
            least = CLOSE * deviations + ROUNDING * np.abs(theta)
            settled = bool(np.all(np.abs(theta - before) <= least))
        unsettled = f"the values still changed after {MOST_ROUNDS} simulations"
        note = (
            f"instruments from {count} simulations of the identified axis, held to the measured "
            f"motion at {self.feedback:.3g} Hz"
        )
        return replace(
            rows,
            target=rows.target - (rows.regressors - projected) @ theta,
            regressors=projected,
            regressor_noise=np.zeros(len(rows.names)),
            notes=(*rows.notes, note, *(() if settled else (unsettled,))),
        )

    def _simulated(self, log: AxisLog, values: Mapping[str, float]) -> AxisLog:
        """Return the log with the positions that the identified axis has under the same effort."""
        T = log.sampling_time
        inertia = values.get("mass", values.get("inertia", self.inertia))
        if inertia is None or inertia <= 0:
            raise InputError(
                f"the inertia found on the way is {inertia}, and nothing can be simulated with it",
                where=log.name,
                remedy="give the inertia, or record a motion that accelerates more",
            )
        plant = SingleMass(mass=inertia, friction=identified_law(values), kind=log.kind)
        stepper = PlantStepper(plant, sampling_time=T)
        omega = 2.0 * np.pi * self.feedback
        stiff, damping = inertia * omega**2, 2.0 * inertia * omega
        parts: list[Float[np.ndarray, " n"]] = []
        # Single samples between gaps belong to no segment, and are never part of a row
        for part in log.segments():
            x, v = _smooth(part, 5.0 * self.feedback)
            state = stepper.init((float(x[0]), float(v[0])))
            reached, speed = float(x[0]), float(v[0])
            way = [reached]
            for u, at, wanted in zip(
                part.effort[:-1].tolist(), x[:-1].tolist(), v[:-1].tolist(), strict=True
            ):
                held = stiff * (at - reached) + damping * (wanted - speed)
                state, (reached, speed) = stepper.step(state, u + held)
                way.append(reached)
            parts.append(np.array(way))
        kept = [part.time for part in log.segments()]
        keep = np.isin(log.time, np.concatenate(kept))
        return replace(
            log,
            time=log.time[keep],
            effort=log.effort[keep],
            measured_position=np.concatenate(parts),
            measured_velocity=None,
            measured_load_position=None,
            measured_load_velocity=None,
        )


def _as_it_acts(log: AxisLog) -> AxisLog:
    """Return the log with the effort that acts around each sample: the mean of two held ones."""
    before = np.concatenate([log.effort[:1], log.effort[:-1]])
    before[log.segment_starts] = log.effort[log.segment_starts]
    return replace(log, effort=0.5 * (before + log.effort))


def _smooth(
    part: AxisLog, cutoff: float
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return slow position and velocity of a stretch, which the simulated axis is held to."""
    T = part.sampling_time
    low_pass = LowPass(order=2, cutoff=min(cutoff, 0.1 / T))
    x = low_pass.apply(part.measured_position, T)
    return x, central_difference(x, T)


def _common(
    measured: Regression, simulated: Regression, name: str
) -> tuple[Regression, Float[np.ndarray, "m p"]]:
    """Return the measured rows and the instruments of the instants that neither leaves out.

    Raises
    ------
    InputError
        If they are few.
    """
    own = np.isin(measured.time, simulated.time)
    theirs = np.isin(simulated.time, measured.time)
    if np.count_nonzero(own) < max(_LEAST_SHARE * own.size, 3 * len(measured.names)):
        raise InputError(
            f"the identified axis moves in {np.count_nonzero(own)} of the {own.size} rows only in "
            "which the measured one does",
            where=name,
            remedy="use 'idim-ls' or the energy estimator, or raise feedback",
        )
    return (
        replace(
            measured,
            time=measured.time[own],
            target=measured.target[own],
            regressors=measured.regressors[own],
        ),
        simulated.regressors[theirs],
    )
