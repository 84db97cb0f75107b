"""Base class of the observers of the friction force: samples, rows, first states, and a fit."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from stickslip.estimation.energy.samples import check_fits, filtered_samples
from stickslip.estimation.fit.rows import Regression, summarise_motion
from stickslip.estimation.fit.solve import check_excited, provenance_of
from stickslip.estimation.online.faults.admission import restart_admission, set_admission
from stickslip.estimation.online.faults.guard import set_guard
from stickslip.estimation.online.faults.health import OnlineHealth, health_of
from stickslip.estimation.online.method import Kernel, OnlineMethod, State
from stickslip.estimation.online.observers import kernels as at
from stickslip.estimation.online.recursion import VALUES, recursion_fields
from stickslip.estimation.point_estimate import NO_INTERVAL, estimate_of
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import check_given, first_guesses, options_of
from stickslip.estimation.signals.kinematics import LowPass, noise_level, slow_speed
from stickslip.estimation.signals.sensor_noise import position_noise
from stickslip.records import (
    AxisKind,
    AxisLog,
    FrictionEstimate,
    mass_name,
    non_negative,
    positive,
    share_text,
)

_FRICTION: tuple[str, ...] = ("viscous_friction", "coulomb_friction", "offset")
_LAST_SHARE = 0.2  # of a log, in which an observer should have settled [-]
_SETTLED = 0.02  # relative change of an estimate in that part [-]
_MEMORY = 2.0  # periods of the cutoff that the low-pass smears a jump over, on either side
_QUIET = 0.1  # noise of the force over the rms effort
_LEAST_ROWS = 3  # a parameter


@dataclass(frozen=True, kw_only=True)
class ForceObserver(OnlineMethod):
    """An estimator that compares the friction force of each sample with its own estimate."""

    # Moving mass or inertia [kg or kg m^2], of a flexible arm that of the driven side.
    inertia: float | None
    #: Of the spring of a flexible arm [N/m or N m/rad], whose load's position the log must then
    #: hold; None for a rigid axis.
    stiffness: float | None = None
    offset: bool = False  #: Whether a constant offset is estimated.
    #: Of the low-pass before positions are differentiated, in a log without velocities [Hz]; None
    #: takes a tenth of the sampling rate and at most 100 Hz.
    cutoff: float | None = None
    #: Speed below which the axis may be at rest, and nothing is learned [m/s or rad/s]; None takes
    #: none on line, and in `fit` what the log suggests.
    dead_band: float | None = None
    #: First guesses by parameter name [SI]; 0 for those not named. What is not estimated is taken
    #: as known at its first guess.
    initial_values: Mapping[str, float] | None = None
    #: Samples by which the effort acts after it is logged [-], also a fraction; negative if it
    #: acts before it is logged. At most 30.
    effort_delay: float = 0.0
    name: ClassVar[str]
    _kernel: ClassVar[Any]

    def __post_init__(self) -> None:
        units = {"inertia": "kg or kg m^2", "stiffness": "N/m or N m/rad", "cutoff": "Hz"}
        check_given(self, positive, units)
        check_given(self, non_negative, {"dead_band": "m/s or rad/s"})
        known = (*(() if self.inertia is not None else ("mass", "inertia")), *_FRICTION)
        guesses = first_guesses(self.initial_values, known)
        object.__setattr__(self, "initial_values", guesses)

    @property
    def kernel(self) -> Kernel:
        """The compiled step (see `OnlineMethod.kernel`)."""
        return type(self)._kernel

    @property
    @abstractmethod
    def _estimated(self) -> tuple[str, ...]:
        """Names of the friction parameters that are estimated."""

    @property
    def _values_from(self) -> int:
        """Place of the viscous friction in a state."""
        return VALUES + (self.inertia is None)

    @property
    def values_at(self) -> slice:
        """Where Coulomb and viscous friction lie in a state, in that order."""
        return slice(self._values_from + 1, self._values_from - 1, -1)

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the online estimates."""
        mass = mass_name(kind)
        return (*(() if self.inertia is not None else (mass,)), *self._estimated)

    def init(self, *, sampling_time: float) -> State:
        """Return the state before the first sample; the sampling time is in s."""
        vector = np.zeros(at.STATE_SIZE)
        s = at.fields(vector)
        s.recursion.sampling_time = T = positive("sampling_time", sampling_time, "s")
        s.recursion.stiffness = self.stiffness or 0.0
        s.inertia, s.dead_band = self.inertia or 0.0, self.dead_band or 0.0
        vector[self._values_from : self._values_from + len(_FRICTION)] = self._first_guesses()
        self._initialise(s)
        load = self.stiffness is not None
        set_admission(
            s.admission,
            sampling_time=T,
            effort_delay=self.effort_delay,
            inertia=self.inertia,
            measured=(True, load, load),
        )
        set_guard(vector, s.guard)
        return vector

    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far; no force noise is estimated."""
        s = at.fields(state)
        return health_of(s.admission, resets=int(s.guard.resets))

    @abstractmethod
    def _initialise(self, s: Any) -> None:
        """Write the settings of the method into the fields of a first state."""

    @property
    def _guesses(self) -> Mapping[str, float]:
        return self.initial_values or {}

    def _first_guesses(self) -> list[float]:
        return [self._guesses.get(name, 0.0) for name in _FRICTION]

    @property
    def _places(self) -> list[int]:
        """Places in a state of what is estimated."""
        friction = [self._values_from + _FRICTION.index(name) for name in self._estimated]
        return [VALUES, *friction] if self.inertia is None else friction

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps; return the state and the estimates after each.

        Velocities that the log has not are differences of smoothed positions. The log must have the
        sampling time of the state, and the load of a flexible arm.
        """
        check_fits(log, float(recursion_fields(state).sampling_time))
        after = state.copy()
        samples, quiet = self._signals(log)
        waiting = max(int(np.ceil(-self.effort_delay)), 0)  # the motion is delayed instead
        quiet = np.concatenate([np.zeros(waiting, dtype=bool), quiet])[: len(log)]
        history = at.observer_run(at.METHODS.index(self.name), after, samples, quiet)
        return after, history[:, [place - VALUES for place in self._places]]

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Return the estimates at the end of a log, without intervals."""
        check_excited(log)
        log = repaired(log)
        settled = self._settled(log)
        state = settled.init(sampling_time=log.sampling_time)
        histories: list[Float[np.ndarray, "n p"]] = []
        for part in log.segments():
            s = at.fields(state)
            s.known = 0
            restart_admission(s.admission)
            state, history = settled.run(state, part)
            histories.append(history)
        values = state[settled._places]
        names = self.parameter_names(log.kind)
        notes = (*log.notes, NO_INTERVAL, *_unrest(names, np.concatenate(histories)))
        return estimate_of(
            replace(settled.regression(log), biased=log.clipped),
            values.tolist(),
            estimator=self.name,
            provenance=provenance_of(log, options_of(settled)),
            notes=notes,
        )

    def regression(self, log: AxisLog, *, quiet: bool = True) -> Regression:
        """Return friction forces and rows of stretches in motion, each the mean of a short block.

        Differences of momentum over single samples are all noise, over blocks they are not.
        ``quiet`` blocks last as long as it takes for their noise to be small beside the effort;
        others a period of the cutoff frequency.
        """
        T = log.sampling_time
        parts = list(log.segments())
        samples = [self._samples(part) for part in parts]
        noises = [position_noise(part.measured_position) for part in parts]
        speed_noise = max(map(self._speed_noise, parts))
        effort = float(np.sqrt(np.mean(log.effort**2)))
        size = self._block(T)
        if quiet and effort > 0:
            jump = np.sqrt(2.0) * speed_noise * (self.inertia or 0.0) / T
            size = max(size, int(np.ceil(jump / (_QUIET * effort))))
        names = self.parameter_names(log.kind)
        rows = self._rows(parts, samples, size)
        if len(rows) < _LEAST_ROWS * len(names):  # no motion lasts so long
            size = self._block(T)
            rows = self._rows(parts, samples, size)
        in_columns = dict.fromkeys(_FRICTION, 0.0)
        in_columns["viscous_friction"] = speed_noise / np.sqrt(size)
        difference = speed_noise * np.sqrt(2.0) / (size * T)
        return Regression(
            kind=log.kind,
            names=names,
            time=rows[:, 0],
            target=rows[:, 1],
            regressors=rows[:, 2:],
            regressor_noise=np.array([in_columns.get(name, difference) for name in names]),
            quantity="effort",
            motion=summarise_motion(
                [part.measured_position for part in parts],
                [one[:, 2] for one in samples],
                T,
                (max(noises), speed_noise),
            ),
            samples=len(log),
            effect=float(effort * np.sqrt(len(rows))),
        )

    def _speed_noise(self, part: AxisLog) -> float:
        """Return the standard deviation of the noise of the velocities used [m/s or rad/s]."""
        if part.measured_velocity is not None:
            return noise_level(part.measured_velocity)
        T = part.sampling_time
        low_pass = self._low_pass(T)
        return position_noise(part.measured_position) * low_pass.noise_gain(T, derivatives=1)

    def _rows(
        self, parts: Sequence[AxisLog], samples: Sequence[Float[np.ndarray, "_ 5"]], size: int
    ) -> Float[np.ndarray, "m c"]:
        """Return time, target and row of all stretches, means over blocks of usable samples."""
        tables = [self._balance(part, one) for part, one in zip(parts, samples, strict=True)]
        return np.concatenate([_block_means(*one, size) for one in tables])

    def _balance(
        self, part: AxisLog, samples: Float[np.ndarray, "n 5"]
    ) -> tuple[Float[np.ndarray, "m c"], Bool[np.ndarray, " m"]]:
        """Return time, target and row of each sample, and whether it is usable."""
        T = part.sampling_time
        u, x, v, x2, v2 = samples.T
        stretch, rate = x - x2, v - v2
        held = 0.5 * (stretch[:-1] + stretch[1:]) - T / 12.0 * np.diff(rate)
        acceleration = np.diff(v) / T
        force = u[:-1] - (self.inertia or 0.0) * acceleration - (self.stiffness or 0.0) * held
        columns = {
            "viscous_friction": 0.5 * (v[:-1] + v[1:]),
            "coulomb_friction": np.sign(v[1:]),
            "offset": np.ones_like(force),
        }
        for name, guess in zip(_FRICTION, self._first_guesses(), strict=True):
            if name not in self._estimated:
                force = force - guess * columns[name]
        sought = [columns[name] for name in self._estimated]
        mass = [acceleration] if self.inertia is None else []
        table = np.column_stack([part.time[1:], force, *mass, *sought])
        slower = np.minimum(np.abs(v[:-1]), np.abs(v[1:]))
        usable = (v[:-1] * v[1:] > 0.0) & (slower > (self.dead_band or 0.0))
        return table, usable

    def _block(self, sampling_time: float) -> int:
        """Return how many samples a period of the cutoff frequency has."""
        return max(round(1.0 / (self._low_pass(sampling_time).cutoff * sampling_time)), 1)

    def _low_pass(self, sampling_time: float) -> LowPass:
        return LowPass.of(sampling_time, self.cutoff)

    def _settled(self, log: AxisLog) -> "ForceObserver":
        """Return the observer with the dead band that a log suggests."""
        if self.dead_band is not None:
            return self
        parts = list(log.segments())
        largest = max(float(np.max(np.abs(self._samples(part)[:, 2]))) for part in parts)
        return replace(self, dead_band=slow_speed(largest, max(map(self._speed_noise, parts))))

    def _samples(self, part: AxisLog) -> Float[np.ndarray, "n 5"]:
        """Return the samples of `_signals` without delay, with a velocity of 0 where quiet."""
        samples, quiet = self._signals(part, effort_delay=self.effort_delay)
        samples[quiet, 2] = 0.0
        return samples

    def _signals(
        self, part: AxisLog, *, effort_delay: float = 0.0
    ) -> tuple[Float[np.ndarray, "n 5"], Bool[np.ndarray, " n"]]:
        """Return effort, position, velocity, load position and load velocity, and what is quiet.

        Where velocities are differences of smoothed positions, the effort is smoothed alike. Quiet
        are samples in which the axis may be at rest, and their neighbours, whose noise would
        otherwise decide which samples count: the next one of a measured velocity, and what the
        low-pass smears a reversal over, or the end of the log.
        """
        T = part.sampling_time
        low_pass = self._low_pass(T)
        load = self.stiffness is not None
        samples = filtered_samples(part, low_pass, load=load, effort_delay=effort_delay)
        v = samples[:, 2]
        slow = np.abs(v) <= (self.dead_band or 0.0)
        reach = 1 if self.dead_band else 0
        if part.measured_velocity is None:
            samples[:, 0] = low_pass.apply(samples[:, 0], T)
            slow[1:] |= v[:-1] * v[1:] <= 0.0
            slow[[0, -1]] = True
            reach = round(_MEMORY * self._block(T))
        return samples, ndimage.maximum_filter1d(slow.astype(np.uint8), 2 * reach + 1) > 0


def _block_means(
    table: Float[np.ndarray, "n c"], usable: Bool[np.ndarray, " n"], size: int
) -> Float[np.ndarray, "m c"]:
    """Return the means of whole blocks of usable rows, counted anew after each that is not."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], usable, [False]))))
    starts = [
        np.arange(start, stop - size + 1, size)
        for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    ]
    first = np.concatenate([np.empty(0, dtype=int), *starts])
    sums = np.cumulative_sum(table, axis=0, include_initial=True)
    return (sums[first + size] - sums[first]) / size


def _unrest(names: tuple[str, ...], history: Float[np.ndarray, "n p"]) -> tuple[str, ...]:
    """Return a note on estimates that still move at the end of a log."""
    last = history[-max(round(_LAST_SHARE * len(history)), 1) :]
    size = np.maximum(np.abs(last[-1]), np.finfo(float).tiny)
    moved = np.ptp(last, axis=0) / size
    k = int(np.argmax(moved))
    if moved[k] <= _SETTLED:
        return ()
    name = names[k].replace("_", " ")
    return (f"{name} moved by {share_text(moved[k])} in the last fifth of the log",)
