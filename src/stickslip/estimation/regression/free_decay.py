"""Friction from a record of how a mass on a spring swings out, by Markho's closed form.

P. H. Markho (1980), "On free vibrations with combined viscous and Coulomb damping", Journal of
Dynamic Systems, Measurement, and Control 102(4), 283-286. A mass on a spring, left alone, obeys
``m x'' + c x' + k x + f_c sign(x') = 0``. Every half-swing lasts h = pi / omega_d, friction of
either kind notwithstanding, and is a damped cosine about a centre that friction shifts against the
motion by x_f = f_c / k. So the amplitudes A_i of successive extremes follow

    A_(i+1) = q A_i - (1 + q) x_f,    q = exp(-delta),    delta = sigma h,    sigma = c / 2m,
    A_i = (A_0 + X) q^i - X,          X = x_f coth(delta / 2),

the second line being the envelope. Both kinds of friction are read from one record of the decay:
viscous friction bends the envelope, Coulomb friction lets it fall straight.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float
from scipy import optimize, signal

from stickslip.estimation.fit.intervals import autocorrelation
from stickslip.estimation.fit.solve import provenance_of
from stickslip.estimation.point_estimate import NORMAL_95
from stickslip.estimation.prepare import RepairedLog, repaired
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
    mass_name,
    positive,
)

_LEAST_EXTREMES = 4  # as many as there are unknowns: centre, first amplitude, ratio and shift
_WINDOW = 0.25  # part of a half-swing on either side of an extreme that its value is taken from
_LEAST_SIDE = 6  # samples on either side
_PROMINENCE = 0.02  # least height of a swing over the range of the decay
_CLEAR = 20.0  # the same in standard deviations of the position
_ROUNDING = 1e-9  # of an extreme, over the range
_SAME = 1e-9  # efforts that differ by less than this part of the largest one are equal


@dataclass(frozen=True, kw_only=True)
class DecayingExtremes:
    """Successive extremes of a free decay, and what Markho's formula makes of them.

    Raises
    ------
    InputError
        If there are fewer than four, or they do not alternate.

    Examples
    --------
    >>> swings = [1.0, -0.7, 0.43, -0.187]  # A' = 0.9 A - 0.2: q = 0.9, x_f = 0.2 / 1.9
    >>> ratio, shift = DecayingExtremes(position=np.array(swings), deviation=np.ones(4)).solve()[0]
    >>> round(ratio, 6), round(shift * 1.9, 6)
    (0.9, 0.2)
    """

    #: Of the extremes, maxima and minima in turn [m or rad], shape (n,).
    position: Float[np.ndarray, " n"]
    deviation: Float[np.ndarray, " n"]  #: Standard deviation of each [m or rad], shape (n,).

    def __post_init__(self) -> None:
        if self.position.size < _LEAST_EXTREMES:
            raise InputError("too_few_extremes", count=self.position.size, least=_LEAST_EXTREMES)
        steps = np.diff(self.position)
        if np.any(steps[1:] * steps[:-1] >= 0):
            raise InputError("extremes_not_in_turn")

    def amplitudes(self, values: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " n"]:
        """Return the extremes by the formula.

        The values are ratio q [-], shift x_f, centre and first amplitude with its sign [m or rad].
        """
        q, shift, centre, first = values
        side = np.sign(self.position[0] - self.position[1])
        swings = np.empty(self.position.size)
        amplitude = side * first
        for i in range(swings.size):
            swings[i] = centre + side * (-1.0) ** i * amplitude
            amplitude = q * amplitude - (1.0 + q) * shift
        return swings

    def solve(
        self,
    ) -> tuple[tuple[float, float], Float[np.ndarray, "2 2"], Float[np.ndarray, " n"]]:
        """Return ratio q [-] and shift x_f [m or rad], their covariance, and the residuals.

        Weighted least squares on the extremes themselves: a regression of each amplitude on the one
        before would be biased by their noise. Residuals of the extremes are over their standard
        deviations [-]; where they are larger than these say, they widen the covariance.
        """
        y = self.position
        steps = np.abs(np.diff(y))
        # Steps shrink by q apart from a constant, as their differences do without it
        bends = np.diff(steps)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = float(np.median(bends[1:] / bends[:-1])) if bends.size > 1 else np.nan
        ratio = ratio if 0.0 < ratio < 1.0 else 0.9
        shift = max(float(-np.mean(bends)) / 4.0, 0.0)
        centre = 0.25 * float(y[0] + 2.0 * y[1] + y[2])

        def residual(values: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " n"]:
            return (self.amplitudes(values) - y) / self.deviation

        found = optimize.least_squares(
            residual,
            np.array([ratio, shift, centre, y[0] - centre]),
            x_scale=np.array([1.0, steps[0], steps[0], steps[0]]),
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
        )
        slopes = np.asarray(found.jac)
        inverse = np.linalg.inv(slopes.T @ slopes)
        left = y.size - _LEAST_EXTREMES
        misfit = 2.0 * float(found.cost) / left if left else 1.0
        widened = inverse * max(misfit, 1.0)
        return (float(found.x[0]), float(found.x[1])), widened[:2, :2], np.asarray(found.fun)


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
    name: ClassVar[str] = "free-decay"

    def __post_init__(self) -> None:
        check_given(self, positive, {"inertia": "kg or kg m^2", "stiffness": "N/m or N m/rad"})
        if (self.inertia is None) == (self.stiffness is None):
            raise InputError("inertia_or_stiffness")

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated."""
        mass = mass_name(kind)
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
        time, position, time_deviations, deviations = _extremes(_free_part(log))
        extremes = DecayingExtremes(position=position, deviation=deviations)
        (q, shift), covariance, left = extremes.solve()
        half, variance = _half_period(time, time_deviations)
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
        names, stds = self.parameter_names(log.kind), np.sqrt(np.diag(covariance))
        lower, upper = values - NORMAL_95 * stds, values + NORMAL_95 * stds
        parameters = {
            name: ParameterEstimate(
                name=name,
                value=float(values[k]),
                std=float(stds[k]),
                ci95=(float(lower[k]), float(upper[k])),
                unit=log.unit(name),
            )
            for k, name in enumerate(names)
        }
        reason = "the decay determines it"
        count = extremes.position.size
        return FrictionEstimate(
            estimator=self.name,
            kind=log.kind,
            parameters=parameters,
            covariance=covariance,
            status=Status.UNPHYSICAL if np.any(upper < 0) else Status.OK,
            diagnostics=Diagnostics(
                relative_residual=float(np.sqrt(np.mean(residual**2)) / np.std(extremes.position)),
                cross_validation_residual=None,
                condition_number=float(np.linalg.cond(covariance / np.outer(stds, stds))),
                residual_autocorrelation=float(autocorrelation(residual, 1)[1]),
                effective_samples=float(count),
                classical_std=dict(zip(names, stds.tolist(), strict=True)),
                samples=len(log),
                verdicts=tuple(
                    Verdict(parameter=name, identifiable=True, reason=reason) for name in names
                ),
                notes=(f"{count} extremes, one every {half:.4g} s", *log.notes),
            ),
            provenance=provenance_of(log, options_of(self)),
        )


def _half_period(
    time: Float[np.ndarray, " n"], deviation: Float[np.ndarray, " n"]
) -> tuple[float, float]:
    """Return how far extremes are apart [s], and the variance of that.

    Weighted least squares of a line, whose misfit widens the variance, if it is beyond 1.
    """
    columns = np.column_stack([np.arange(time.size), np.ones(time.size)]) / deviation[:, None]
    inverse = np.linalg.inv(columns.T @ columns)
    line = inverse @ (columns.T @ (time / deviation))
    misfit = float(np.sum((time / deviation - columns @ line) ** 2)) / (time.size - 2)
    return float(line[0]), float(inverse[0, 0]) * max(misfit, 1.0)


def _free_part(log: AxisLog) -> AxisLog:
    """Return the last stretch of a log in which the effort is constant and the load rests."""
    part = list(log.segments())[-1]
    same = np.abs(part.effort - part.effort[-2]) <= _SAME * max(np.max(np.abs(part.effort)), 1.0)
    same[-1] = True  # nothing is held after the last sample
    changed = np.flatnonzero(~same)
    free = part.part(int(changed[-1]) + 1 if changed.size else 0, len(part))
    load = free.measured_load_position
    if load is not None:
        moved = float(np.ptp(load)) - _CLEAR * noise_level(load)
        if moved > _PROMINENCE * float(np.ptp(free.measured_position)):
            raise InputError("load_moves", where=log.name, moved=moved, unit=log.unit("position"))
    return free


def _extremes(part: AxisLog) -> tuple[Float[np.ndarray, " n"], ...]:
    """Return time and position of the extremes of a free part, and the deviations of both."""
    x = part.measured_position
    range_, noise = float(np.ptp(x)), position_noise(x)
    least = max(_PROMINENCE * range_, _CLEAR * noise)
    rough = np.empty(0, dtype=int)
    if len(part) >= 2 * _LEAST_SIDE and range_ > _CLEAR * noise:
        peaks = [signal.find_peaks(side, prominence=least)[0] for side in (x, -x)]
        rough = np.sort(np.concatenate(peaks))
    if rough.size < _LEAST_EXTREMES:
        raise InputError(
            "no_swing", where=part.name, samples=len(part), count=rough.size, least=_LEAST_EXTREMES
        )
    side = max(round(_WINDOW * float(np.median(np.diff(rough)))), _LEAST_SIDE)
    found = [
        _extreme(part.time[k - side : k + side + 1], x[k - side : k + side + 1])
        for k in rough.tolist()
        if k >= side and k + side < x.size
    ]
    if len(found) < _LEAST_EXTREMES:
        raise InputError(
            "extremes_at_edges", where=part.name, count=len(found), side=side, least=_LEAST_EXTREMES
        )
    times, positions, time_errors, errors, variance = np.array(found).T
    # The sensor is the same at every extreme
    deviation = float(np.sqrt(np.mean(variance)))
    # It turns as sharply as it swings wide. The sharpness that single windows show would give most
    # weight to those whose noise looks like a sharp turn
    swings = np.abs(np.diff(positions))
    ends = np.maximum(1.5 * swings[[0, -1]] - 0.5 * swings[[1, -2]], 0.5 * swings[[0, -1]])
    width = np.concatenate([ends[:1], 0.5 * (swings[1:] + swings[:-1]), ends[1:]])
    time_deviations = deviation * float(np.median(time_errors * width)) / width
    least_time = _ROUNDING * float(np.median(np.diff(times)))
    deviations = np.maximum(deviation * errors, _ROUNDING * range_)
    return times, positions, np.maximum(time_deviations, least_time), deviations


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
        sides = np.minimum(tau - at, 0.0), np.maximum(tau - at, 0.0)
        powers = [part**n for part in sides for n in (2, 3, 4)]
        columns = np.column_stack([np.ones_like(tau), *powers])
        values, *_ = np.linalg.lstsq(columns, x, rcond=None)
        slopes = [-n * part ** (n - 1) for part in sides for n in (2, 3, 4)]
        full = np.column_stack([columns, np.column_stack(slopes) @ values[1:]])
        step, *_ = np.linalg.lstsq(full, x - columns @ values, rcond=None)
        inverse = np.linalg.pinv(full.T @ full)
        residual = x - columns @ values - full @ step
        value = float(values[0] + step[0])
        at = float(np.clip(at + step[-1], -0.5, 0.5))
        if abs(step[-1]) < 1e-12:
            break
    middle = 0.5 * float(time[0] + time[-1])
    time_error, error = np.sqrt(np.diag(inverse))[[-1, 0]].tolist()
    variance = float(residual @ residual) / max(x.size - len(inverse), 1)
    return middle + span * at, value, span * time_error, error, variance
