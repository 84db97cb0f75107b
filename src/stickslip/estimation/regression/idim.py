"""Inverse dynamic identification: least squares, and its instrumental variables.

IDIM-LS is the field's baseline (Janot, Gautier and Brunot 2019, "Data set and reference models of
EMPS", and Gautier 1997): filter the position without delay, differentiate it by central
differences, decimate every column of the inverse dynamic model and the effort alike, and solve by
least squares.

IDIM-IV (A. Janot, P.-O. Vandanjon and M. Gautier 2014, "A generic instrumental variable approach
for industrial robot identification", IEEE Transactions on Control Systems Technology 22(1),
132-145) removes its bias: the rows W of the inverse dynamic model hold the noise of differentiated
positions. Rows Z of the same model, made from a simulation with the parameters found so far, move
as W does and hold none of that noise:

    theta = (Z' W)^-1 Z' y,

which is repeated until theta no longer changes. In the papers the simulated axis follows the
reference of the true one under the same controller. A log holds neither; here the simulated axis
gets the logged effort, and a slow feedback to the measured motion keeps the two from drifting
apart.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.fitted import LeastSquaresEstimator
from stickslip.estimation.fit.rows import Regression, least_squares, summarise_motion
from stickslip.estimation.fit.solve import check_excited, long_stretches
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import check_given
from stickslip.estimation.signals.kinematics import (
    REST_PERIODS,
    LowPass,
    central_difference,
    decimate,
    decimated_start,
    noise_level,
    rests,
    slow_speed,
)
from stickslip.friction import CoulombViscousFriction, FrictionTerms, StribeckEffect
from stickslip.plants import SingleMass
from stickslip.records import AxisKind, AxisLog, InputError, mass_name, positive, whole
from stickslip.simulation import PlantStepper

_SETTLING_PERIODS = 5.0
"""Periods of the cutoff frequency after which the filter has forgotten how the log began."""
_LEAST_ROWS = 50  # that a stretch without gaps must give [-]

_MOST_ROUNDS = 10  # of simulations for the instruments [-]
_CLOSE = 0.05
"""Largest change of a parameter in a round, over its standard deviation under white residuals, at
which the instrumental variables have converged."""
_ROUNDING = 1e-9  # relative change of a parameter that counts as none [-]
_LEAST_SHARE = 0.2  # of the rows, that simulated and measured motion must have in common


@dataclass(frozen=True, kw_only=True)
class IdimLeastSquares(LeastSquaresEstimator):
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
        too; None does not. Several, of which each has its own step, are for `StribeckEstimator`,
        which finds the one that fits.
    cutoff
        Of the low-pass on the position [Hz]; None takes a tenth of the sampling rate and at most
        100 Hz.
    filter_order
        Of one pass of that low-pass.
    decimation
        Keep one row in so many; None keeps one a period of the cutoff frequency.

    Raises
    ------
    InputError
        If a setting is out of range, or offset and per_direction are both requested.

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
    name: ClassVar[str] = "idim-ls"

    def __post_init__(self) -> None:
        check_given(self, positive, {"inertia": "kg or kg m^2", "cutoff": "Hz"})
        for name, value in (("filter_order", self.filter_order), ("decimation", self.decimation)):
            if value is not None:
                whole(name, value, least=1)
        _ = self.terms

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated."""
        return FrictionTerms.asked(
            per_direction=self.per_direction, offset=self.offset, stribeck=self.stribeck
        )

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the rows."""
        mass = mass_name(kind)
        return (*(() if self.inertia is not None else (mass,)), *self.terms.names)

    def regression(self, log: AxisLog) -> Regression:
        """Return the filtered and decimated rows of the inverse dynamic model; raises as `fit`."""
        check_excited(log)
        log = repaired(log)
        T = log.sampling_time
        low_pass = LowPass.of(T, self.cutoff, self.filter_order)
        period = 1.0 / (low_pass.cutoff * T)
        factor = max(round(period), 1) if self.decimation is None else self.decimation
        skipped = max(round(_SETTLING_PERIODS * period) - 1, 0)
        parts = long_stretches(log, skipped + _LEAST_ROWS * factor, decimation=factor)
        positions = [part.measured_position for part in parts]
        velocities = [central_difference(low_pass.apply(x, T), T) for x in positions]
        position_noise = max(noise_level(x) for x in positions)
        speed_noise = position_noise * low_pass.noise_gain(T, derivatives=1)
        largest = max(float(np.max(np.abs(v))) for v in velocities)
        slow = slow_speed(largest, speed_noise)

        change = _with_acting_effort(log).effort - log.effort
        times: list[Float[np.ndarray, " n"]] = []
        blocks: list[Float[np.ndarray, "n p"]] = []
        dropped = 0
        for part, v in zip(parts, velocities, strict=True):
            friction = self.terms.force_columns(v, np.sign(v))
            columns = [part.effort, central_difference(v, T), friction]
            columns.append(np.interp(part.time, log.time, change))
            rows = np.column_stack(columns)[skipped:]
            start = decimated_start(rows.shape[0], factor)
            moving = ~rests(v, slow, round(REST_PERIODS * period))[skipped:][start::factor]
            times.append(part.time[skipped:][start::factor][moving])
            blocks.append(decimate(rows, factor)[moving])
            dropped += int(np.count_nonzero(~moving))
        rows = np.concatenate(blocks)
        target, regressors, by_holding = rows[:, 0], rows[:, 1:-1], rows[:, -1]
        names = (mass_name(log.kind), *self.terms.names)
        noise = np.zeros(len(names))
        noise[0] = position_noise * low_pass.noise_gain(T, derivatives=2, decimation=factor)
        noise[[name.startswith("viscous") for name in names]] = speed_noise
        if self.inertia is not None:
            target = target - self.inertia * regressors[:, 0]
            names, regressors, noise = names[1:], regressors[:, 1:], noise[1:]
        notes = [
            f"position filtered at {low_pass.cutoff:.4g} Hz without delay, differentiated twice, "
            f"every column decimated by {factor}; "
            f"velocities below {slow:.3g} {log.unit('velocity')} for "
            f"{REST_PERIODS / low_pass.cutoff:.3g} s or longer count as rest"
        ]
        if dropped:
            notes.append(f"{dropped} rows at rest left out: friction is not determined there")
        return Regression(
            kind=log.kind,
            names=names,
            time=np.concatenate(times),
            target=target,
            regressors=regressors,
            regressor_noise=noise,
            quantity="effort",
            motion=summarise_motion(positions, velocities, T, (position_noise, speed_noise)),
            samples=len(log),
            notes=(*notes, *log.notes),
            biased=log.clipped,
            # An effort that is held acts half a sample later than it is logged
            shifts=least_squares(regressors, by_holding)[None],
        )


@dataclass(frozen=True, kw_only=True)
class IdimInstrumentalVariables(LeastSquaresEstimator):
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
    name: ClassVar[str] = "idim-iv"

    def __post_init__(self) -> None:
        positive("feedback", self.feedback, "Hz")
        _ = self._rows

    @property
    def _rows(self) -> IdimLeastSquares:
        """The least squares that make the rows of the inverse dynamic model."""
        settings = {name: value for name, value in vars(self).items() if name != "feedback"}
        return IdimLeastSquares(**settings)

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the rows."""
        return self._rows.parameter_names(kind)

    def regression(self, log: AxisLog) -> Regression:
        """Return rows whose least-squares solution is that of the instrumental variables.

        With Q an orthonormal basis of the instruments, least squares of y on Q Q' W gives theta;
        taking y less (W - Q Q' W) theta for the target leaves that as it is, and makes the residual
        that of the model, y - W theta. Raises as `fit`.
        """
        log = repaired(log)
        measured = self._rows.regression(_with_acting_effort(log))
        theta, *_ = np.linalg.lstsq(measured.regressors, measured.target, rcond=None)
        rows, projected = measured, measured.regressors
        count, converged = 0, False
        while count < _MOST_ROUNDS and not converged:
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
            least = _CLOSE * deviations + _ROUNDING * np.abs(theta)
            converged = bool(np.all(np.abs(theta - before) <= least))
        notes = [
            f"instruments from {count} simulations of the identified axis, held to the measured "
            f"motion at {self.feedback:.3g} Hz"
        ]
        if not converged:
            notes.append(f"the values still changed after {_MOST_ROUNDS} simulations")
        return replace(
            rows,
            target=rows.target - (rows.regressors - projected) @ theta,
            regressors=projected,
            regressor_noise=np.zeros(len(rows.names)),
            notes=(*rows.notes, *notes),
            shifts=None,
        )

    def _simulated(self, log: AxisLog, values: Mapping[str, float]) -> AxisLog:
        """Return the log with the positions that the identified axis has under the same effort."""
        T = log.sampling_time
        inertia = values.get("mass", values.get("inertia", self.inertia))
        if inertia is None or inertia <= 0:
            raise InputError("inertia_on_the_way", where=log.name, inertia=inertia)
        plant = SingleMass(mass=inertia, friction=identified_law(values), kind=log.kind)
        stepper = PlantStepper(plant, sampling_time=T)
        omega = 2.0 * np.pi * self.feedback
        stiffness, damping = inertia * omega**2, 2.0 * inertia * omega
        # The slow motion that the simulated axis is held to
        low_pass = LowPass(order=2, cutoff=min(5.0 * self.feedback, 0.1 / T))
        positions: list[float] = []
        # Single samples between gaps belong to no segment, and are never part of a row
        for part in log.segments():
            slow = low_pass.apply(part.measured_position, T)
            x, v = slow.tolist(), central_difference(slow, T).tolist()
            state, at, speed = stepper.init((x[0], v[0])), x[0], v[0]
            positions.append(at)
            for k, u in enumerate(part.effort[:-1].tolist()):
                held = stiffness * (x[k] - at) + damping * (v[k] - speed)
                state, (at, speed) = stepper.step(state, u + held)
                positions.append(at)
        kept = np.isin(log.time, np.concatenate([part.time for part in log.segments()]))
        return replace(
            log,
            time=log.time[kept],
            effort=log.effort[kept],
            measured_position=np.array(positions),
            measured_velocity=None,
            measured_load_position=None,
            measured_load_velocity=None,
        )


def identified_law(values: Mapping[str, float]) -> CoulombViscousFriction:
    """Return the law that can be simulated and is nearest to some estimated values [SI].

    A negative friction counts as none, and static friction is at least Coulomb friction, also where
    it was not estimated.
    """
    terms = {
        f"{term}_{side}": max(values.get(f"{term}_{side}", values.get(term, 0.0)), 0.0)
        for term in ("coulomb_friction", "static_friction", "viscous_friction")
        for side in ("positive", "negative")
    }
    for side in ("positive", "negative"):
        static, coulomb = f"static_friction_{side}", f"coulomb_friction_{side}"
        terms[static] = max(terms[static], terms[coulomb])
    return CoulombViscousFriction(**terms, offset=values.get("offset", 0.0))


def _with_acting_effort(log: AxisLog) -> AxisLog:
    """Return the log with the effort that acts around each sample: the mean of two held ones."""
    before = np.concatenate([log.effort[:1], log.effort[:-1]])
    before[log.segment_starts] = log.effort[log.segment_starts]
    return replace(log, effort=0.5 * (before + log.effort))


def _common(
    measured: Regression, simulated: Regression, name: str
) -> tuple[Regression, Float[np.ndarray, "m p"]]:
    """Return the measured rows and the instruments of the instants that neither leaves out."""
    own = np.isin(measured.time, simulated.time)
    theirs = np.isin(simulated.time, measured.time)
    if np.count_nonzero(own) < max(_LEAST_SHARE * own.size, 3 * len(measured.names)):
        raise InputError(
            "simulation_deviates", where=name, count=np.count_nonzero(own), rows=own.size
        )
    time, target, regressors = measured.time[own], measured.target[own], measured.regressors[own]
    rows = replace(measured, time=time, target=target, regressors=regressors)
    return rows, simulated.regressors[theirs]
