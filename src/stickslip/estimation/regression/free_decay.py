"""Friction from a record of how a mass on a spring swings out.

The extremes of the decay are read from the log and given to Markho's formula (see
`stickslip.estimation.regression.decaying_extremes`).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import signal

from stickslip.estimation.fit.intervals import autocorrelation
from stickslip.estimation.fit.solve import provenance_of
from stickslip.estimation.point_estimate import NORMAL_95
from stickslip.estimation.prepare import RepairedLog, repaired
from stickslip.estimation.regression.decaying_extremes import LEAST_EXTREMES, DecayingExtremes
from stickslip.estimation.settings import check_given, options_of
from stickslip.estimation.signals.kinematics import noise_level
from stickslip.estimation.signals.sensor_noise import position_noise
from stickslip.records import (
    AxisKind,
    AxisLog,
    Diagnostics,
    FrictionEstimate,
    InputError,
    ParameterEstimate,
    Status,
    Verdict,
    positive,
    unit_of,
)

__all__ = ["FreeDecayEstimator"]

WINDOW = 0.25
"""Part of a half-swing on either side of an extreme that its value is taken from."""

_LEAST_SIDE = 6  # samples on either side
_PROMINENCE = 0.02  # least height of a swing over the range of the decay
_CLEAR = 20.0  # the same in standard deviations of the position
_ROUNDING = 1e-9  # of an extreme, over the range
_SAME = 1e-9  # efforts that differ by less than this part of the largest one are equal


@dataclass(frozen=True, kw_only=True)
class FreeDecayEstimator:
    """Coulomb and viscous friction of a mass on a spring that swings out by itself.

    The log must end with such a decay: a constant effort, and the other end of the spring at rest.
    An axis without a spring has none; that of a flexible arm swings so when its load is clamped.

    Attributes
    ----------
    inertia
        Moving mass or inertia [kg or kg m^2]; the period then gives the stiffness.
    stiffness
        Of the spring [N/m or N m/rad]; the period then gives the inertia, which is estimated too.
        One of the two must be given.

    Raises
    ------
    InputError
        If not exactly one of the two is given, or it is not positive.

    Examples
    --------
    >>> FreeDecayEstimator(stiffness=50.0).parameter_names("linear")
    ('mass', 'viscous_friction', 'coulomb_friction')
    """

    inertia: float | None = None
    stiffness: float | None = None

    def __post_init__(self) -> None:
        check_given(self, positive, {"inertia": "kg or kg m^2", "stiffness": "N/m or N m/rad"})
        if (self.inertia is None) == (self.stiffness is None):
            raise InputError(
                "a free decay needs either the inertia or the stiffness of the spring",
                remedy="give one of them: the period gives the other",
            )

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "free-decay"

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated."""
        mass = "mass" if kind == "linear" else "inertia"
        friction = ("viscous_friction", "coulomb_friction")
        return (mass, *friction) if self.inertia is None else friction

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate friction from the decay at the end of a log.

        Raises
        ------
        InputError
            If the log does not end with a free decay of four extremes or more.
        """
        log = repaired(log)
        part = _free_part(log)
        time, position, late, deviations = _extremes(part)
        extremes = DecayingExtremes(position=position, deviation=deviations)
        (q, shift), covariance, left = extremes.solve()
        half, variance = _half_period(time, late)
        full = np.zeros((3, 3))
        full[:2, :2], full[2, 2] = covariance, variance
        values, jacobian = self._parameters(q, shift, half)
        spread = jacobian @ full @ jacobian.T
        return self._estimate(log, values, spread, left * deviations, extremes, half)

    def _parameters(
        self, q: float, shift: float, half: float
    ) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, "p 3"]]:
        """Return the parameters for q, x_f and h, and their derivatives to these.

        sigma = -log(q) / h, omega_n^2 = (pi / h)^2 + sigma^2; then k = m omega_n^2 or
        m = k / omega_n^2, c = 2 m sigma and f_c = k x_f.
        """
        sigma = -np.log(q) / half
        square = (np.pi / half) ** 2 + sigma**2
        to_sigma = np.array([-1.0 / (q * half), 0.0, -sigma / half])
        to_square = 2.0 * sigma * to_sigma + np.array([0.0, 0.0, -2.0 * np.pi**2 / half**3])
        to_shift = np.array([0.0, 1.0, 0.0])
        if self.inertia is not None:
            m, k = self.inertia, self.inertia * square
            to_m, to_k = np.zeros(3), m * to_square
        else:
            k = self.stiffness or 0.0
            m, to_m, to_k = k / square, -k / square**2 * to_square, np.zeros(3)
        values = [2.0 * m * sigma, k * shift]
        rows = [2.0 * (m * to_sigma + sigma * to_m), k * to_shift + shift * to_k]
        if self.inertia is None:
            values, rows = [m, *values], [to_m, *rows]
        return np.array(values), np.array(rows)

    def _estimate(
        self,
        log: RepairedLog,
        values: Float[np.ndarray, " p"],
        covariance: Float[np.ndarray, "p p"],
        residual: Float[np.ndarray, " n"],
        extremes: DecayingExtremes,
        half: float,
    ) -> FrictionEstimate:
        stds = np.sqrt(np.diag(covariance))
        parameters: dict[str, ParameterEstimate] = {}
        verdicts: list[Verdict] = []
        for name, value, std in zip(
            self.parameter_names(log.kind), values.tolist(), stds.tolist(), strict=True
        ):
            reach = NORMAL_95 * std
            parameters[name] = ParameterEstimate(
                name=name,
                value=value,
                std=std,
                ci95=(value - reach, value + reach),
                unit=unit_of(name, log.kind),
            )
            verdicts.append(
                Verdict(parameter=name, identifiable=True, reason="the decay determines it")
            )
        negative = any(p.ci95 is not None and p.ci95[1] < 0 for p in parameters.values())
        count = extremes.position.size
        return FrictionEstimate(
            estimator=self.name,
            kind=log.kind,
            parameters=parameters,
            covariance=covariance,
            status=Status.UNPHYSICAL if negative else Status.OK,
            diagnostics=Diagnostics(
                relative_residual=float(np.sqrt(np.mean(residual**2)) / np.std(extremes.position)),
                cross_validation_residual=None,
                condition_number=float(np.linalg.cond(covariance / np.outer(stds, stds))),
                residual_autocorrelation=float(autocorrelation(residual, 1)[1]),
                effective_samples=float(count),
                classical_std=dict(zip(parameters, stds.tolist(), strict=True)),
                samples=len(log),
                verdicts=tuple(verdicts),
                notes=(f"{count} extremes, one every {half:.4g} s", *log.notes),
            ),
            provenance=provenance_of(log, options_of(self)),
        )


def _half_period(
    time: Float[np.ndarray, " n"], late: Float[np.ndarray, " n"]
) -> tuple[float, float]:
    """Return how far extremes are apart [s], and the variance of that.

    Weighted least squares of a line, whose misfit widens the variance, if it is beyond 1.
    """
    columns = np.column_stack([np.arange(time.size), np.ones(time.size)]) / late[:, None]
    inverse = np.linalg.inv(columns.T @ columns)
    line = inverse @ (columns.T @ (time / late))
    misfit = float(np.sum((time / late - columns @ line) ** 2)) / (time.size - 2)
    return float(line[0]), float(inverse[0, 0]) * max(misfit, 1.0)


def _free_part(log: AxisLog) -> AxisLog:
    """Return the last stretch of a log in which the effort is constant.

    Raises
    ------
    InputError
        If the load moves in it.
    """
    part = list(log.segments())[-1]
    same = np.abs(part.effort - part.effort[-2]) <= _SAME * max(np.max(np.abs(part.effort)), 1.0)
    same[-1] = True  # nothing is held after the last sample
    changed = np.flatnonzero(~same)
    free = part.part(int(changed[-1]) + 1 if changed.size else 0, len(part))
    load = free.measured_load_position
    if load is not None:
        moved = float(np.ptp(load)) - _CLEAR * noise_level(load)
        if moved > _PROMINENCE * float(np.ptp(free.measured_position)):
            raise InputError(
                f"the load moves by {moved:.3g} {log.unit('position')} in the free part",
                where=log.name,
                remedy="clamp it, or use the energy estimator",
            )
    return free


def _extremes(
    part: AxisLog,
) -> tuple[Float[np.ndarray, " n"], ...]:
    """Return time and position of the extremes of a free part, and the deviations of both.

    Raises
    ------
    InputError
        If there are fewer than four.
    """
    x = part.measured_position
    range_, noise = float(np.ptp(x)), position_noise(x)
    least = max(_PROMINENCE * range_, _CLEAR * noise)
    if len(part) < 2 * _LEAST_SIDE or range_ <= _CLEAR * noise:
        rough = np.empty(0, dtype=int)
    else:
        rough = np.sort(
            np.concatenate(
                [
                    signal.find_peaks(x, prominence=least)[0],
                    signal.find_peaks(-x, prominence=least)[0],
                ]
            )
        )
    if rough.size < LEAST_EXTREMES:
        raise InputError(
            f"the last {len(part)} samples, in which the effort is constant, hold {rough.size} "
            f"extremes of a swing, {LEAST_EXTREMES} are needed",
            where=part.name,
            remedy="record how a mass on a spring swings out, or use the energy estimator",
        )
    side = max(round(WINDOW * float(np.median(np.diff(rough)))), _LEAST_SIDE)
    found = [
        _extreme(part.time[k - side : k + side + 1], x[k - side : k + side + 1])
        for k in rough.tolist()
        if k >= side and k + side < x.size
    ]
    if len(found) < LEAST_EXTREMES:
        raise InputError(
            f"{len(found)} extremes have {side} samples on both sides, {LEAST_EXTREMES} are needed",
            where=part.name,
            remedy="record a longer decay, or sample it faster",
        )
    times, positions, late, off, variance = np.array(found).T
    # The sensor is the same at every extreme
    deviation = float(np.sqrt(np.mean(variance)))
    deviations = deviation * off
    # It turns as sharply as it swings wide. The sharpness that single windows show would give most
    # weight to those whose noise looks like a sharp turn
    swings = np.abs(np.diff(positions))
    ends = np.maximum(1.5 * swings[[0, -1]] - 0.5 * swings[[1, -2]], 0.5 * swings[[0, -1]])
    wide = np.concatenate([ends[:1], 0.5 * (swings[1:] + swings[:-1]), ends[1:]])
    late = deviation * float(np.median(late * wide)) / wide
    least_late = _ROUNDING * float(np.median(np.diff(times)))
    return (
        times,
        positions,
        np.maximum(late, least_late),
        np.maximum(deviations, _ROUNDING * range_),
    )


def _extreme(
    time: Float[np.ndarray, " w"], x: Float[np.ndarray, " w"]
) -> tuple[float, float, float, float, float]:
    """Return time and position of the extreme in a window, and how well they are known.

    That is their standard deviations for a sensor of unit noise, and the variance that is left.

    Friction turns there, so that the curvature jumps: a polynomial of its own on either side, both
    without slope and with the same value where they meet.
    """
    span = 0.5 * float(time[-1] - time[0])
    tau = (time - 0.5 * (time[0] + time[-1])) / span
    at, value = 0.0, 0.0
    inverse, residual = np.zeros((8, 8)), x
    for _ in range(20):
        past, next_ = np.minimum(tau - at, 0.0), np.maximum(tau - at, 0.0)
        powers = [part**n for part in (past, next_) for n in (2, 3, 4)]
        columns = np.column_stack([np.ones_like(tau), *powers])
        values, *_ = np.linalg.lstsq(columns, x, rcond=None)
        slopes = [-n * part ** (n - 1) for part in (past, next_) for n in (2, 3, 4)]
        shift = np.column_stack(slopes) @ values[1:]
        full = np.column_stack([columns, shift])
        step, *_ = np.linalg.lstsq(full, x - columns @ values, rcond=None)
        inverse = np.linalg.pinv(full.T @ full)
        residual = x - columns @ values - full @ step
        value = float(values[0] + step[0])
        at = float(np.clip(at + step[-1], -0.5, 0.5))
        if abs(step[-1]) < 1e-12:
            break
    middle = 0.5 * float(time[0] + time[-1])
    late, off = np.sqrt(np.diag(inverse))[[-1, 0]].tolist()
    variance = float(residual @ residual) / max(x.size - len(inverse), 1)
    return middle + span * at, value, span * late, off, variance
