"""Inverse dynamic identification by least squares (IDIM-LS), the field's baseline.

Janot, Gautier and Brunot (2019), "Data set and reference models of EMPS", and Gautier (1997):
filter the position without delay, differentiate it by central differences, decimate every column of
the inverse dynamic model and the effort alike, and solve by least squares.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.rows import Regression, summarise_motion
from stickslip.estimation.fit.solve import (
    check_excited,
    long_stretches,
    provenance_of,
    solve,
)
from stickslip.estimation.prepare import repaired
from stickslip.estimation.signals.kinematics import (
    REST_PERIODS,
    LowPass,
    central_difference,
    decimate,
    decimated_start,
    default_cutoff,
    noise_level,
    rests,
    slow_speed,
)
from stickslip.friction import FrictionTerms, StribeckEffect
from stickslip.records import AxisKind, AxisLog, FrictionEstimate, InputError, positive

__all__ = ["IdimLeastSquares"]

SETTLING_PERIODS = 5.0
"""Periods of the cutoff frequency after which the filter has forgotten how the log began."""
_LEAST_ROWS = 50


@dataclass(frozen=True, kw_only=True)
class IdimLeastSquares:
    """Least squares on ``effort = inertia a + viscous v + coulomb sign(v) + offset``.

    With the defaults a log sampled at 1 kHz is processed exactly as published for the EMPS
    benchmark: 4th-order zero-phase Butterworth at 100 Hz, samples 50 to the end, decimation by 10.

    Attributes
    ----------
    inertia
        Moving mass or inertia if it is known [kg or kg m^2]; None estimates it.
    per_direction
        Whether Coulomb and viscous friction are estimated for each direction apart.
    offset
        Whether a constant offset is estimated; None does unless ``per_direction``.
    stribeck
        How the step from static to Coulomb friction fades with speed, to estimate static friction
        too; None does not. Several, of which each has a step of its own, are for
        `StribeckEstimator`, which finds the one that fits.
    cutoff
        Of the low-pass on the position [Hz]; None takes a tenth of the sampling rate and at most
        100 Hz.
    filter_order
        Of one pass of that low-pass.
    decimation
        Keep every so-manieth sample; None keeps one a period of the cutoff frequency.

    Raises
    ------
    InputError
        If a setting is out of range, or offset and per_direction are both asked for.

    Examples
    --------
    >>> IdimLeastSquares(per_direction=True).terms.names[0]
    'viscous_friction_positive'
    """

    inertia: float | None = None
    per_direction: bool = False
    offset: bool | None = None
    stribeck: StribeckEffect | tuple[StribeckEffect, ...] | None = None
    cutoff: float | None = None
    filter_order: int = 4
    decimation: int | None = None

    def __post_init__(self) -> None:
        if self.inertia is not None:
            positive("inertia", self.inertia, "kg or kg m^2")
        if self.cutoff is not None:
            positive("cutoff", self.cutoff, "Hz")
        for name, value in (("filter_order", self.filter_order), ("decimation", self.decimation)):
            if value is not None and value < 1:
                raise InputError(
                    f"{name} is {value}, it must be at least 1", remedy=f"raise {name}"
                )
        _ = self.terms

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "idim-ls"

    @property
    def options(self) -> dict[str, Any]:
        """Name and settings as plain values, for a result's provenance."""
        return {"estimator": self.name, **asdict(self)}

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated."""
        return FrictionTerms.asked(
            per_direction=self.per_direction, offset=self.offset, stribeck=self.stribeck
        )

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the rows.

        Parameters
        ----------
        kind
            ``"linear"`` or ``"rotary"``.
        """
        mass = "mass" if kind == "linear" else "inertia"
        return (*(() if self.inertia is not None else (mass,)), *self.terms.names)

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log.

        Raises
        ------
        InputError
            If the log is too short, or nothing moves or pushes in it.
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
        provenance = provenance_of(log, self.options)
        return self.fitted(solve(rows, estimator=self.name, provenance=provenance), rows)

    def fitted(self, estimate: FrictionEstimate, rows: Regression) -> Fit:
        """Return an estimate and its rows with what is known of the axis.

        Parameters
        ----------
        estimate
            Of the rows.
        rows
            From `regression`, whole or changed.
        """
        return Fit(
            estimate=estimate,
            rows=rows,
            inertia=self.inertia,
            stribeck=self.stribeck if isinstance(self.stribeck, StribeckEffect) else None,
            cutoff=self.cutoff,
            filter_order=self.filter_order,
        )

    def regression(self, log: AxisLog) -> Regression:
        """Return the filtered and decimated rows of the inverse dynamic model.

        Raises
        ------
        InputError
            If the log is too short, or nothing moves or pushes in it.
        """
        check_excited(log)
        log = repaired(log)
        T = log.sampling_time
        cutoff = default_cutoff(T) if self.cutoff is None else self.cutoff
        low_pass = LowPass(order=self.filter_order, cutoff=cutoff)
        period = 1.0 / (cutoff * T)
        factor = max(round(period), 1) if self.decimation is None else self.decimation
        skipped = max(round(SETTLING_PERIODS * period) - 1, 0)
        least = skipped + _LEAST_ROWS * factor

        parts = long_stretches(
            log,
            least,
            needed_by=f", which the filter and the decimation by {factor} need",
            remedy="record a longer log, or raise the cutoff frequency",
        )
        velocities = [
            central_difference(low_pass.apply(part.measured_position, T), T) for part in parts
        ]
        position_noise = max(noise_level(part.measured_position) for part in parts)
        speed_noise = position_noise * low_pass.noise_gain(T, derivatives=1)
        largest = max(float(np.max(np.abs(v))) for v in velocities)
        slow = slow_speed(largest, speed_noise)

        blocks: list[tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n p"]]] = []
        dropped = 0
        for part, v in zip(parts, velocities, strict=True):
            rows = self._rows(part, v, T)[skipped:]
            start = decimated_start(rows.shape[0], factor)
            still = rests(v, slow, round(REST_PERIODS * period))[skipped:][start::factor]
            time = part.time[skipped:][start::factor]
            blocks.append((time[~still], decimate(rows, factor)[~still]))
            dropped += int(np.count_nonzero(still))
        time = np.concatenate([block[0] for block in blocks])
        rows = np.concatenate([block[1] for block in blocks])
        noise = np.zeros(rows.shape[1] - 1)
        noise[0] = position_noise * low_pass.noise_gain(T, derivatives=2, decimation=factor)
        names = ("mass" if log.kind == "linear" else "inertia", *self.terms.names)
        noise[[name.startswith("viscous") for name in names]] = speed_noise
        target, regressors = rows[:, 0], rows[:, 1:]
        if self.inertia is not None:
            target = target - self.inertia * regressors[:, 0]
            names, regressors, noise = names[1:], regressors[:, 1:], noise[1:]
        notes = [
            f"position filtered at {cutoff:.4g} Hz without delay, differentiated twice, every "
            f"column decimated by {factor}; velocities below {slow:.3g} {log.unit('velocity')} for "
            f"{REST_PERIODS / cutoff:.3g} s or longer count as rest"
        ]
        if dropped:
            notes.append(f"{dropped} rows at rest left out: friction is not determined there")
        return Regression(
            kind=log.kind,
            names=names,
            time=time,
            target=target,
            regressors=regressors,
            regressor_noise=noise,
            quantity="effort",
            motion=summarise_motion(
                [part.measured_position for part in parts],
                velocities,
                T,
                (position_noise, speed_noise),
            ),
            samples=len(log),
            notes=(*notes, *log.notes),
            biased=log.clipped,
        )

    def _rows(
        self, part: AxisLog, velocity: Float[np.ndarray, " n"], sampling_time: float
    ) -> Float[np.ndarray, "n c"]:
        """Return effort, acceleration and the friction columns of one stretch, side by side."""
        acceleration = central_difference(velocity, sampling_time)
        friction = self.terms.force_columns(velocity, np.sign(velocity))
        return np.column_stack([part.effort, acceleration, friction])
