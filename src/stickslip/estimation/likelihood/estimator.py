"""Maximum likelihood (output error) on the exact simulator."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Literal

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.fitted import Fit, RowsEstimator
from stickslip.estimation.fit.rows import Regression, summarise_motion
from stickslip.estimation.fit.solve import check_excited, provenance_of, solve
from stickslip.estimation.likelihood.axis_parameters import SIDES, AxisParameters, load_name
from stickslip.estimation.likelihood.first_guess import first_guess
from stickslip.estimation.likelihood.search import (
    Maximum,
    StaticRange,
    staged_search,
    with_static_friction,
)
from stickslip.estimation.likelihood.windows import ChannelNoise, Window, whitened, windows_of
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import check_given, first_guesses, options_of
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.sensor_noise import chosen_cutoff, position_noise
from stickslip.estimation.signals.velocity_delay import without_wrong_velocity
from stickslip.friction import FrictionTerms
from stickslip.plants import Plant
from stickslip.records import (
    AxisKind,
    AxisLog,
    InputError,
    count_of,
    mass_name,
    one_of,
    positive,
    whole,
)

_LEAST_SAMPLES = 50  # of a stretch without gaps [-]
_LARGEST_CORRELATION = 0.2
"""Of successive errors after whitening, beyond which they are not those of the sensors alone: a
force that the model lacks adds up in them, and biases the parameters."""
_ROUNDING = 1e-6  # of the range: errors that small have the colour of rounding
_SMALLEST_RATIO = 1e-7  # of singular values of columns of unit norm [-]: rounding below it
_LARGEST_SHARE = 2.0
"""A combination of columns is determined by the log if its standard deviation is less than half of
what the whole motion would make of the strongest one."""


@dataclass(frozen=True, kw_only=True)
class LikelihoodMaximum:
    """The likeliest axis, sensors' noise and first states of a log."""

    plant: Plant  #: With the likeliest parameters.
    values: Mapping[str, float]  #: Of the parameters sought, by name [SI].
    delay: int  #: Of the effort [samples].
    #: Standard deviation [unit of the channel], and correlation from reading to reading, by
    #: channel, such as ``"position"``.
    noise: Mapping[str, ChannelNoise]
    #: Position and velocity of each mass [SI], of each stretch.
    initial_states: tuple[tuple[float, ...], ...]
    #: Up to a constant that does not depend on the parameters or the delay [-].
    log_likelihood: float
    #: Whether the likelihood may jump nearby, as an event of the likeliest motion grazes.
    grazing: bool


@dataclass(frozen=True, kw_only=True)
class _Found:
    """A maximum with what is needed to make rows of it."""

    log: AxisLog
    parameters: AxisParameters
    windows: list[Window]
    maximum: Maximum
    delay: int  # [samples]
    sought_delay: bool
    static: StaticRange | None = None
    notes: tuple[str, ...]
    clipped: bool


@dataclass(frozen=True, kw_only=True)
class MaximumLikelihoodEstimator(RowsEstimator):
    """Friction and masses with which the simulated motion is likeliest to have been measured.

    The axis is simulated exactly under the logged effort from an unknown first state, through every
    stick and slip (output error: the errors are those of the sensors, not of the effort). The
    likelihood is maximised by Gauss-Newton steps on exact gradients
    (`stickslip.simulation.simulate_sensitivity`). Errors of each channel are Gaussian with an
    unknown variance, white or a first-order autoregression; a run of equal readings of an encoder
    is one reading.

    It is the most accurate there is where the model is right and the effort is known: no other
    unbiased estimator has smaller errors on long logs. A disturbing force adds up in the motion and
    is no sensor noise; then a ``horizon`` keeps it from adding up, and the energy estimator is the
    better choice.

    Attributes
    ----------
    inertia
        Moving mass or inertia if it is known [kg or kg m^2], of a flexible arm that of the driven
        side; None estimates it.
    load_inertia, stiffness
        Of a flexible arm [kg or kg m^2, N/m or N m/rad] if they are known.
    flexible
        Whether the axis is a flexible arm: then a load inertia or stiffness not given is estimated,
        and what is sought of the three needs a first guess. None takes an arm if a load inertia or
        stiffness is given.
    per_direction
        Whether Coulomb, viscous (and static) friction are estimated for each direction apart.
    offset
        Whether a constant offset is estimated; None does unless ``per_direction``.
    static_friction
        Whether a static friction above the Coulomb friction is estimated; else it is equal to it.
        A rigid axis shows it only between the efforts that held it and those that freed it.
    noise
        ``"white"``, or ``"coloured"`` for a first-order autoregression in each channel.
    largest_delay
        Effort delays of 0 to so many samples are tried, and the likeliest is taken.
    horizon
        Duration after which the simulation starts anew from an unknown state [s]; None never does.
    initial_values
        First guesses by parameter name [SI]; those not named come from the energy estimator.

    Raises
    ------
    InputError
        If a setting is out of range, offset and per_direction are both asked for, or what is sought
        of a flexible arm has no first guess.

    Examples
    --------
    >>> import numpy as np
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> from stickslip.simulation import Sensors, simulate
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=3.0)
    >>> effort = 9.0 * np.sin(np.arange(2000) * 0.02)
    >>> motion = simulate(SingleMass(mass=1.5, friction=law), effort, sampling_time=0.005)
    >>> sensors = Sensors(encoder_step=1e-4, velocity="none")
    >>> estimate = MaximumLikelihoodEstimator().fit(sensors.measure(motion))
    >>> [round(estimate.value(name), 2) for name in ("mass", "coulomb_friction")]
    [1.5, 2.0]
    """

    inertia: float | None = None
    load_inertia: float | None = None
    stiffness: float | None = None
    flexible: bool | None = None
    per_direction: bool = False
    offset: bool | None = None
    static_friction: bool = False
    noise: Literal["white", "coloured"] = "coloured"
    largest_delay: int = 0
    horizon: float | None = None
    initial_values: Mapping[str, float] | None = None
    name: ClassVar[str] = "maximum-likelihood"

    def __post_init__(self) -> None:
        units = {"inertia": "kg or kg m^2", "load_inertia": "kg or kg m^2"}
        units |= {"stiffness": "N/m or N m/rad", "horizon": "s"}
        check_given(self, positive, units)
        one_of("noise", self.noise, ("white", "coloured"))
        whole("largest_delay", self.largest_delay, unit="samples")
        arm = self.load_inertia is not None or self.stiffness is not None
        if self.flexible is None:
            object.__setattr__(self, "flexible", arm)
        elif arm and not self.flexible:
            raise InputError("parts_of_rigid_axis")
        names = (*self.parameter_names("linear"), *self.parameter_names("rotary"))
        guesses = first_guesses(self.initial_values, names)
        object.__setattr__(self, "initial_values", guesses)
        for one, other in (("mass", "inertia"), ("load_mass", "load_inertia"), ("stiffness",) * 2):
            if self.flexible and one in names and one not in guesses and other not in guesses:
                raise InputError("no_guess_of_arm", name=other)

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated, but for static friction."""
        return FrictionTerms.asked(per_direction=self.per_direction, offset=self.offset)

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the covariance."""
        known = self._known(kind)
        structure = [name for name, value in known.items() if value is None]
        sides = SIDES if self.per_direction else ("",)
        static = [f"static_friction{side}" for side in sides] if self.static_friction else []
        return (*structure, *self.terms.names, *static)

    def _known(self, kind: AxisKind) -> dict[str, float | None]:
        """Return masses and stiffness by name; None where they are estimated."""
        known = {mass_name(kind): self.inertia}
        if self.flexible:
            known |= {load_name(kind): self.load_inertia, "stiffness": self.stiffness}
        return known

    def maximum(self, log: AxisLog) -> LikelihoodMaximum:
        """Return all that is likeliest: parameters, delay, noise and first states."""
        found = self._found(log)
        maximum, parameters = found.maximum, found.parameters
        values = dict(zip(parameters.names, maximum.values.tolist(), strict=True))
        channels = [channel.name for channel in found.windows[0].channels]
        motions = [
            window.simulated(parameters, maximum.values, state)
            for window, state in zip(found.windows, maximum.states, strict=True)
        ]
        return LikelihoodMaximum(
            plant=parameters.plant(maximum.values),
            values=values if found.static is None else values | found.static.values,
            delay=found.delay,
            noise=dict(zip(channels, maximum.noise, strict=True)),
            initial_states=tuple(tuple(state.tolist()) for state in maximum.states),
            log_likelihood=-maximum.cost,
            grazing=any(motion.any_grazing for motion in motions),
        )

    def regression(self, log: AxisLog) -> Regression:
        """Return the whitened errors of the likeliest motion, linearised there.

        Their least-squares solution is the likeliest parameters; their Gramian is the Fisher
        information.
        """
        return _rows_at(self._found(log))

    def details(self, log: AxisLog) -> Fit:
        """Return the estimate with its rows, for a report."""
        found = self._found(log)
        rows = _rows_at(found)
        provenance = provenance_of(log, options_of(self))
        estimate = solve(rows, estimator=self.name, provenance=provenance)
        return Fit(
            estimate=estimate if found.static is None else found.static.added_to(estimate),
            rows=rows,
            inertia=self.inertia,
            load_inertia=self.load_inertia,
            stiffness=self.stiffness,
        )

    def _prepared(self, log: AxisLog) -> tuple[AxisLog, LowPass, tuple[str, ...], bool]:
        """Return the log to search in, its low-pass, notes on it, and whether it is clipped."""
        check_excited(log)
        whole = repaired(log)
        low_pass = LowPass.of(whole.sampling_time)
        log, wrong = without_wrong_velocity(whole, low_pass, load=bool(self.flexible))
        least = max(_LEAST_SAMPLES, self.largest_delay + 2)
        if max(len(part) for part in log.segments()) < least:
            raise InputError(
                "no_long_stretch",
                where=log.name,
                least=least,
                samples=len(log),
                sampling_time=log.sampling_time,
                decimation=None,
            )
        load = bool(self.flexible) and log.measured_load_position is not None
        cutoff, _ = chosen_cutoff(log, low_pass, _LEAST_SAMPLES, load=load)
        return log, replace(low_pass, cutoff=cutoff), (*whole.notes, *wrong), whole.clipped

    def _found(self, log: AxisLog) -> _Found:
        """Search the likeliest parameters, and the likeliest delay."""
        log, low_pass, notes, clipped = self._prepared(log)
        coloured, names = self.noise == "coloured", self.parameter_names(log.kind)
        rigid_static = self.static_friction and not self.flexible
        if rigid_static:
            names = tuple(name for name in names if "static" not in name)
        given = self._known(log.kind).items()
        parameters = AxisParameters(
            kind=log.kind,
            names=names,
            known={name: value for name, value in given if value is not None},
            flexible=bool(self.flexible),
        )
        guess = first_guess(log, parameters, self.initial_values or {}, cutoff=low_pass.cutoff)
        tried: list[_Found] = []
        for delay in range(self.largest_delay + 1):
            if tried:
                guess = _likeliest(tried).maximum.values
            cut = partial(
                windows_of,
                log,
                low_pass,
                delay=delay,
                skipped=self.largest_delay,
                flexible=parameters.flexible,
            )
            windows, maximum, note = staged_search(
                log, cut, parameters, guess, horizon=self.horizon, coloured=coloured
            )
            tried.append(
                _Found(
                    log=log,
                    parameters=parameters,
                    windows=windows,
                    maximum=maximum,
                    delay=delay,
                    sought_delay=self.largest_delay > 0,
                    notes=(*notes, *note),
                    clipped=clipped,
                )
            )
        best = _likeliest(tried)
        if rigid_static:
            known, maximum, static = with_static_friction(
                best.windows,
                parameters,
                best.maximum,
                per_direction=self.per_direction,
                coloured=coloured,
            )
            best = replace(best, parameters=known, maximum=maximum, static=static)
        return replace(best, notes=(*best.notes, *self._search_notes(best)))

    def _search_notes(self, found: _Found) -> tuple[str, ...]:
        """Return what a user should know of the search, one sentence each."""
        parts: list[str] = []
        for channel, noise in zip(found.windows[0].channels, found.maximum.noise, strict=True):
            unit = found.log.unit(channel.name.removeprefix("load_"))
            colour = f" (correlation {noise.correlation:.2g})" if noise.correlation else ""
            parts.append(f"{channel.name.replace('_', ' ')} {noise.std:.3g} {unit}{colour}")
        notes = [f"likeliest noise of the sensors: {', '.join(parts)}"]
        if self.largest_delay:
            notes.append(
                f"the effort acts {count_of(found.delay, 'sample')} late (likeliest of 0 to "
                f"{self.largest_delay})"
            )
        readings = sum(c.readings.size for w in found.windows for c in w.channels)
        rows = sum(of.rows for of in found.maximum.noise)
        if rows < readings:
            notes.append(f"{readings} readings are worth {rows}: runs of equal ones count once")
        if not found.maximum.converged:
            notes.append("the search has not converged: the motion may depend on it by jumps")
        return tuple(notes)


def _likeliest(tried: Sequence[_Found]) -> _Found:
    return min(tried, key=lambda found: found.maximum.cost)


def _projected(
    rows: Float[np.ndarray, "n q"], states: Float[np.ndarray, "n s"]
) -> Float[np.ndarray, "n q"]:
    """Return rows without what the columns of the first states explain."""
    used = states[:, np.any(states != 0.0, axis=0)]
    basis = np.linalg.qr(used)[0] if used.shape[1] else used
    return rows - basis @ (basis.T @ rows)


def _rows_at(found: _Found) -> Regression:
    """Return errors and their derivatives at the likeliest parameters, whitened, in time's order.

    What the first states explain is projected out, so that the Gramian of the rows is the Fisher
    information of the parameters with the states unknown (Schur complement). All rows are in the
    unit of the position.
    """
    windows, parameters, maximum = found.windows, found.parameters, found.maximum
    notes, p = found.notes, maximum.values.size
    scale = maximum.noise[0].std  # the position's
    blocks: list[Float[np.ndarray, "n columns"]] = []
    velocities: list[Float[np.ndarray, " n"]] = []
    effect = 0.0
    sums = np.zeros((len(maximum.noise), 2))
    for window, state in zip(windows, maximum.states, strict=True):
        errors, changes = window.linearised(parameters, maximum.values, state)
        parts: list[Float[np.ndarray, "n columns"]] = []
        for c, (error, change, of, time) in enumerate(
            zip(errors, changes, maximum.noise, window.row_times(), strict=True)
        ):
            rows = whitened(np.column_stack([error, change]), of.correlation) * (scale / of.std)
            parts.append(np.column_stack([time, rows]))
            if np.sqrt(np.mean(error**2)) > _ROUNDING * np.ptp(window.channels[c].readings):
                sums[c] += rows[1:, 0] @ rows[:-1, 0], rows[:, 0] @ rows[:, 0]
        stacked = np.concatenate(parts)
        kept = _projected(stacked[:, 1 : 2 + p], stacked[:, 2 + p :])
        blocks.append(np.column_stack([stacked[:, 0], kept]))
        motion = window.simulated(parameters, maximum.values, state)
        velocities.append(motion.velocity)
        moved = window.channels[0].errors(np.full(window.time.size, np.mean(motion.position)))
        effect += float(np.sum(whitened(moved, maximum.noise[0].correlation) ** 2))
    correlation = float(np.max(np.abs(sums[:, 0]) / np.where(sums[:, 1] > 0, sums[:, 1], np.inf)))
    biased = correlation > _LARGEST_CORRELATION
    if biased:
        notes = (
            *notes,
            f"successive errors are still correlated ({correlation:.2g}) when a first-order "
            "autoregression is taken out: a disturbing force, or another law of friction, moves "
            "the axis besides what is modelled, or the effort acts later than is looked for "
            "(largest_delay, or --largest-delay of stickslip compare)",
        )
    rows = np.concatenate(blocks)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    target = rows[:, 1] + rows[:, 2:] @ maximum.values
    noise = float(np.sqrt(np.mean(rows[:, 1] ** 2)))
    size = float(np.linalg.norm(target))
    ratio = _LARGEST_SHARE * noise / size if size > 0 else 1.0
    positions = [window.channels[0].readings for window in windows]
    return Regression(
        kind=found.log.kind,
        names=parameters.names,
        time=rows[:, 0],
        target=target,
        regressors=rows[:, 2:],
        regressor_noise=np.zeros(p),
        quantity="position",
        motion=summarise_motion(
            positions,
            velocities,
            windows[0].sampling_time,
            (max(position_noise(x) for x in positions), 0.0),
        ),
        samples=len(found.log),
        notes=notes,
        effect=float(np.sqrt(effect)),
        smallest_singular_ratio=max(ratio, _SMALLEST_RATIO),
        resolution=0.0,
        effort_delay=found.delay if found.sought_delay else None,
        biased=biased or found.clipped,
    )
