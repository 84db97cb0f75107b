"""Maximum likelihood (output error) on the exact simulator."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Literal

from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import check_excited, provenance_of, solve
from stickslip.estimation.likelihood.axis_parameters import (
    AxisParameters,
    load_name,
    mass_name,
)
from stickslip.estimation.likelihood.maximum_rows import rows_at
from stickslip.estimation.likelihood.noise_model import ChannelNoise
from stickslip.estimation.likelihood.search.first_guess import first_guess
from stickslip.estimation.likelihood.search.maximum import Maximum
from stickslip.estimation.likelihood.search.stages import staged_search
from stickslip.estimation.likelihood.search.static_profile import StaticRange, with_static_friction
from stickslip.estimation.likelihood.windows import Window
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import check_given, first_guesses
from stickslip.estimation.signals.kinematics import LowPass, default_cutoff
from stickslip.estimation.signals.sensor_noise import chosen_cutoff
from stickslip.estimation.signals.velocity_delay import without_wrong_velocity
from stickslip.friction import FrictionTerms
from stickslip.plants import Plant
from stickslip.records import (
    AxisKind,
    AxisLog,
    FrictionEstimate,
    InputError,
    count_of,
    positive,
)

__all__ = ["LikelihoodMaximum", "MaximumLikelihoodEstimator"]

_LEAST_ROWS = 50


@dataclass(frozen=True, kw_only=True)
class LikelihoodMaximum:
    """The likeliest axis, sensors' noise and first states of a log.

    Attributes
    ----------
    plant
        With the likeliest parameters.
    values
        Of the parameters sought, by name [SI].
    delay
        Samples that the effort acts late.
    noise
        By channel, such as ``"position"``: standard deviation [unit of the channel], and
        correlation from reading to reading.
    initial_states
        Of each stretch: position and velocity of each mass [SI].
    log_likelihood
        Up to a constant that does not depend on the parameters or the delay [-].
    grazing
        Whether the likelihood may jump nearby: an event of the likeliest motion grazes.
    """

    plant: Plant
    values: Mapping[str, float]
    delay: int
    noise: Mapping[str, ChannelNoise]
    initial_states: tuple[tuple[float, ...], ...]
    log_likelihood: float
    grazing: bool


@dataclass(frozen=True, kw_only=True)
class _Found:
    """A maximum with what is needed to make rows of it."""

    log: AxisLog
    parameters: AxisParameters
    windows: list[Window]
    maximum: Maximum
    delay: int
    static: StaticRange | None
    notes: tuple[str, ...]
    clipped: bool


@dataclass(frozen=True, kw_only=True)
class MaximumLikelihoodEstimator:
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

    def __post_init__(self) -> None:
        check_given(
            self,
            positive,
            {
                "inertia": "kg or kg m^2",
                "load_inertia": "kg or kg m^2",
                "stiffness": "N/m or N m/rad",
                "horizon": "s",
            },
        )
        if self.noise not in ("white", "coloured"):
            raise InputError(f"noise is {self.noise!r}", remedy="give 'white' or 'coloured'")
        if self.largest_delay < 0:
            raise InputError(
                f"largest_delay is {count_of(self.largest_delay, 'sample')}",
                remedy="give 0 or more whole samples",
            )
        arm = self.load_inertia is not None or self.stiffness is not None
        if self.flexible is None:
            object.__setattr__(self, "flexible", arm)
        elif arm and not self.flexible:
            raise InputError(
                "a load inertia or stiffness is given for an axis that is not flexible",
                remedy="leave them out, or flexible=False",
            )
        guesses = first_guesses(
            self.initial_values, (*self.parameter_names("linear"), *self.parameter_names("rotary"))
        )
        object.__setattr__(self, "initial_values", guesses)
        if self.flexible:
            self._check_arm_guesses(guesses)

    def _check_arm_guesses(self, guesses: Mapping[str, float]) -> None:
        for one, other in (("mass", "inertia"), ("load_mass", "load_inertia"), ("stiffness",) * 2):
            sought = one in self.parameter_names("linear")
            if sought and one not in guesses and other not in guesses:
                raise InputError(
                    f"the {other.replace('_', ' ')} of a flexible arm is sought without a first "
                    "guess",
                    remedy=f"give initial_values={{'{other}': ...}}, or the value itself",
                )

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "maximum-likelihood"

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated, but for static friction."""
        return FrictionTerms.asked(per_direction=self.per_direction, offset=self.offset)

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the covariance.

        Parameters
        ----------
        kind
            ``"linear"`` or ``"rotary"``.
        """
        structure = [] if self.inertia is not None else [mass_name(kind)]
        if self.flexible:
            structure += [] if self.load_inertia is not None else [load_name(kind)]
            structure += [] if self.stiffness is not None else ["stiffness"]
        sides = ("_positive", "_negative") if self.per_direction else ("",)
        static = [f"static_friction{side}" for side in sides] if self.static_friction else []
        return (*structure, *self.terms.names, *static)

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log.

        Raises
        ------
        InputError
            If the log is too short, or nothing moves or pushes in it.
        """
        return self.details(log).estimate

    def maximum(self, log: AxisLog) -> LikelihoodMaximum:
        """Return all that is likeliest: parameters, delay, noise and first states.

        Raises
        ------
        InputError
            As `fit` does.
        """
        found = self._found(log)
        plant = found.parameters.plant(found.maximum.values)
        values = dict(zip(found.parameters.names, found.maximum.values.tolist(), strict=True))
        return LikelihoodMaximum(
            plant=plant,
            values=values if found.static is None else values | found.static.values,
            delay=found.delay,
            noise={
                channel.name: noise
                for channel, noise in zip(
                    found.windows[0].channels, found.maximum.noise, strict=True
                )
            },
            initial_states=tuple(tuple(state.tolist()) for state in found.maximum.states),
            log_likelihood=-found.maximum.cost,
            grazing=any(
                w.simulated(found.parameters, found.maximum.values, s).any_grazing
                for w, s in zip(found.windows, found.maximum.states, strict=True)
            ),
        )

    def regression(self, log: AxisLog) -> Regression:
        """Return the whitened errors of the likeliest motion, linearised there.

        Their least-squares solution is the likeliest parameters; their Gramian is the Fisher
        information.

        Raises
        ------
        InputError
            As `fit` does.
        """
        return self._rows(self._found(log))

    def details(self, log: AxisLog) -> Fit:
        """Return the estimate with its rows, for a report.

        Raises
        ------
        InputError
            As `fit` does.
        """
        found = self._found(log)
        rows = self._rows(found)
        options = {field.name: getattr(self, field.name) for field in fields(self)}
        options |= {"estimator": self.name, "initial_values": dict(self.initial_values or {})}
        estimate = solve(rows, estimator=self.name, provenance=provenance_of(log, options))
        return Fit(
            estimate=estimate if found.static is None else found.static.added_to(estimate),
            rows=rows,
            inertia=self.inertia,
            load_inertia=self.load_inertia,
            stiffness=self.stiffness,
        )

    def _rows(self, found: _Found) -> Regression:
        rows = rows_at(
            found.windows,
            found.parameters,
            found.maximum,
            kind=found.log.kind,
            samples=len(found.log),
            notes=found.notes,
        )
        return replace(
            rows,
            effort_delay=found.delay if self.largest_delay else None,
            biased=rows.biased or found.clipped,
        )

    def _found(self, log: AxisLog) -> _Found:
        """Search the likeliest parameters, and the likeliest delay."""
        check_excited(log)
        log = whole = repaired(log)
        low_pass = LowPass(order=4, cutoff=default_cutoff(log.sampling_time))
        log, wrong = without_wrong_velocity(log, low_pass, load=bool(self.flexible))
        least = max(_LEAST_ROWS, self.largest_delay + 2)
        longest = max(len(part) for part in log.segments())
        if longest < least:
            raise InputError(
                f"the log has no stretch of {least} samples without a gap ({len(log)} samples in "
                f"all, one every {log.sampling_time:.4g} s)",
                where=log.name,
                remedy="record a longer log",
            )
        load = bool(self.flexible) and log.measured_load_position is not None
        cutoff, _ = chosen_cutoff(log, low_pass, _LEAST_ROWS, load=load)
        low_pass = replace(low_pass, cutoff=cutoff)
        rigid_static = self.static_friction and not self.flexible
        names = [
            name
            for name in self.parameter_names(log.kind)
            if not rigid_static or "static" not in name
        ]
        own = (mass_name(log.kind), load_name(log.kind), "stiffness")
        given = zip(own, (self.inertia, self.load_inertia, self.stiffness), strict=True)
        parameters = AxisParameters(
            kind=log.kind,
            names=tuple(names),
            known={name: value for name, value in given if value is not None},
            flexible=bool(self.flexible),
        )
        guess = first_guess(log, parameters, self.initial_values or {}, cutoff=cutoff)
        best: _Found | None = None
        for delay in range(self.largest_delay + 1):
            start = guess if best is None else best.maximum.values
            windows, maximum, note = staged_search(
                log,
                low_pass,
                parameters,
                start,
                delay=delay,
                skipped=self.largest_delay,
                horizon=self.horizon,
                coloured=self.noise == "coloured",
            )
            if best is None or maximum.cost < best.maximum.cost:
                notes = (*whole.notes, *wrong, *note)
                best = _Found(
                    log=log,
                    parameters=parameters,
                    windows=windows,
                    maximum=maximum,
                    delay=delay,
                    static=None,
                    notes=notes,
                    clipped=whole.clipped,
                )
        if best is None:
            message = "no delay was tried"
            raise ArithmeticError(message)
        if rigid_static:
            known, maximum, static = with_static_friction(
                best.windows,
                parameters,
                best.maximum,
                per_direction=self.per_direction,
                coloured=self.noise == "coloured",
            )
            best = replace(best, parameters=known, maximum=maximum, static=static)
        return replace(best, notes=(*best.notes, *self._told(best)))

    def _told(self, found: _Found) -> tuple[str, ...]:
        """Return what a user should know of the search, one sentence each."""
        log = found.log
        parts: list[str] = []
        for channel, noise in zip(found.windows[0].channels, found.maximum.noise, strict=True):
            unit = log.unit(channel.name.removeprefix("load_"))
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
