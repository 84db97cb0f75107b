"""A scenario to compare estimators on, as a TOML file describes it."""

import math
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.jobs.effort_file import read_effort
from stickslip.jobs.positioning.axis_file import read_axis_file
from stickslip.jobs.positioning.axis_table import AxisTable
from stickslip.jobs.positioning.tables import SensorsTable
from stickslip.records import (
    InputError,
    ScenarioTables,
    count_of,
    non_negative,
    positive,
    quantity_field,
)

__all__ = ["InputTable", "StudyFile", "StudyScenario", "read_study"]

_MOST_SAMPLES = 5_000_000
"""Of one run: some ten minutes for every estimator."""

_LEAST_SAMPLES = 100
_MOST_RUNS = 100_000

_LARGEST_DELAY = _LEAST_SAMPLES // 2
"""Of the effort, in samples: even the shortest run has as many in which it acts."""

_UNITS = {"frequencies": "Hz", "effort_delay": "samples"}


@dataclass(frozen=True, kw_only=True)
class InputTable:
    """``[input]``: the effort that is sent to the axis, and the force that disturbs it.

    Attributes
    ----------
    amplitudes
        Of sines that are added up [N or N m].
    frequencies
        Of the sines [Hz], one each.
    random_phases
        Whether the sines begin anywhere, anew in every run; if not, all begin at zero. With an
        encoder and no other noise, nothing else sets one run apart from the next.
    file
        CSV file with the effort in the last column, as ``stickslip excite`` writes it, in the place
        of sines.
    duration
        Of a run [s]; of a file all of it.
    sampling_time
        [s]; a file has its own.
    effort_delay
        Samples that the effort acts later than it is logged.
    disturbance
        Standard deviation of a force that acts beside the effort and is not logged [N or N m].
    disturbance_correlation
        Its correlation from sample to sample [-]; 0 for a white one.

    Raises
    ------
    InputError
        If a value is out of its range, or neither or both of sines and file are given.
    """

    amplitudes: tuple[float, ...] | None = quantity_field("effort", default=None)
    frequencies: tuple[float, ...] | None = None
    random_phases: bool = False
    file: str | None = None
    duration: float | None = quantity_field("time", default=None)
    sampling_time: float | None = quantity_field("sampling_time", default=None)
    effort_delay: int = 0
    disturbance: float = quantity_field("effort", default=0.0)
    disturbance_correlation: float = 0.0

    __pydantic_config__: ClassVar[Any] = {"extra": "forbid"}

    def __post_init__(self) -> None:
        non_negative("disturbance", self.disturbance, "N or N m")
        if not 0 <= self.effort_delay <= _LARGEST_DELAY:
            raise InputError(
                f"effort_delay is {count_of(self.effort_delay, 'sample')}, it must be at least 0 "
                f"and at most {_LARGEST_DELAY}",
                remedy="give the delay of a drive in whole samples, such as 1 or 2",
            )
        if not 0.0 <= self.disturbance_correlation < 1.0:
            raise InputError(
                f"disturbance_correlation is {self.disturbance_correlation:g}, it must be at least "
                "0 and below 1",
                remedy="give 0 for a white disturbance, or such as 0.98",
            )
        sines = ("amplitudes", "frequencies", "duration", "sampling_time")
        if self.file is not None:
            for name in sines:
                if getattr(self, name) is not None:
                    raise InputError(
                        f"{name} and file are both given",
                        remedy=f"leave {name} out, or the file",
                    )
            if self.random_phases:
                raise InputError(
                    "random_phases and file are both given",
                    remedy="leave random_phases out: it is for sines",
                )
            return
        for name in sines:
            if getattr(self, name) is None:
                raise InputError(f"{name} is missing", remedy="give it, or a file")
        self._check_sines()

    def _check_sines(self) -> None:
        amplitudes, frequencies = self.amplitudes or (), self.frequencies or ()
        if not amplitudes or len(amplitudes) != len(frequencies):
            raise InputError(
                f"there are {len(amplitudes)} amplitudes and {len(frequencies)} frequencies",
                remedy="give one of each for every sine",
            )
        step = positive("sampling_time", self.sampling_time or 0.0, "s")
        duration = positive("duration", self.duration or 0.0, "s")
        for amplitude in amplitudes:
            if not math.isfinite(amplitude):
                raise InputError(f"an amplitude is {amplitude}", remedy="give a finite one")
        for frequency in frequencies:
            positive("frequency", frequency, "Hz")
            if frequency * step > 0.5:
                raise InputError(
                    f"frequency is {frequency:g} Hz, and {1.0 / step:g} samples a second show at "
                    f"most {0.5 / step:g} Hz",
                    remedy="lower it, or shorten the sampling time",
                )
        if not _LEAST_SAMPLES - 0.5 <= duration / step <= _MOST_SAMPLES:
            raise InputError(
                f"duration is {duration:g} s, that is {duration / step:.3g} samples of {step:g} s",
                remedy=f"take {_LEAST_SAMPLES} to {_MOST_SAMPLES:g} samples",
            )

    def sampled(
        self, folder: Path, generator: np.random.Generator
    ) -> tuple[Float[np.ndarray, " n"], float]:
        """Return the effort of a run, and its sampling time [s].

        Parameters
        ----------
        folder
            Where a file is looked for.
        generator
            Where random phases come from.

        Raises
        ------
        InputError
            If the file cannot be read, or is too short.
        """
        if self.file is not None:
            effort, step = read_effort(folder / self.file)
            if effort.size < _LEAST_SAMPLES:
                raise InputError(
                    f"the file holds {effort.size} samples, at least {_LEAST_SAMPLES} are needed",
                    where=str(folder / self.file),
                    remedy="give a longer one",
                )
            return effort, step
        step = self.sampling_time or 0.0
        time = step * np.arange(round((self.duration or 0.0) / step))
        frequencies = self.frequencies or ()
        phases = np.zeros(len(frequencies))
        if self.random_phases:
            phases = generator.uniform(0.0, 2.0 * np.pi, len(frequencies))
        sines = [
            amplitude * np.sin(2.0 * np.pi * frequency * time + phase)
            for amplitude, frequency, phase in zip(
                self.amplitudes or (), frequencies, phases, strict=True
            )
        ]
        return np.sum(sines, axis=0), step

    def acting(self, effort: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Return what acts of an effort: the same, late, and nothing before.

        Parameters
        ----------
        effort
            As it is sent and logged [N or N m].
        """
        return np.concatenate((np.zeros(self.effort_delay), effort))[: effort.size]


@dataclass(frozen=True, kw_only=True)
class StudyScenario:
    """An axis, what is sent to it, and what is measured, many times.

    Attributes
    ----------
    name
        What to call it; None for the file's name.
    runs
        How many.
    axis, input, sensors
        Its tables; the seed of the sensors is that of all that is random.

    Raises
    ------
    InputError
        If nothing is random, or there are too few runs or too many.
    """

    name: str | None = None
    runs: int = 100
    axis: AxisTable
    input: InputTable
    sensors: SensorsTable = field(default_factory=SensorsTable)

    __pydantic_config__: ClassVar[Any] = {"extra": "forbid"}

    def __post_init__(self) -> None:
        check_runs(self.runs)
        random = self.input.disturbance or self.input.random_phases
        if not (random or self.sensors.noisy or self.sensors.encoder_step):
            raise InputError(
                "nothing is random in this scenario: every run would be the same",
                remedy="give position_noise, velocity_noise or encoder_step in [sensors], or "
                "disturbance or random_phases in [input]",
            )


def check_runs(runs: int) -> None:
    """Refuse a number of runs that cannot be."""
    if not 2 <= runs <= _MOST_RUNS:
        raise InputError(
            f"runs is {runs}, it must be at least 2 and at most {_MOST_RUNS}",
            remedy="give some tens for a look, 400 for a table",
        )


@dataclass(frozen=True, kw_only=True)
class StudyFile:
    """A scenario with where it was read.

    Attributes
    ----------
    scenario
        What the file says.
    path
        The file.
    sha256
        Of its bytes.
    """

    scenario: StudyScenario
    path: Path
    sha256: str

    @property
    def name(self) -> str:
        """What to call it."""
        return self.scenario.name or self.path.stem.replace("_", " ").replace("-", " ")

    def tables(self) -> ScenarioTables:
        """Return what the scenario says, with units; what is not said is left out."""
        kind = self.scenario.axis.kind
        tables: dict[str, dict[str, tuple[Any, str]]] = {}
        for name in ("axis", "input", "sensors"):
            table: Any = getattr(self.scenario, name)
            tables[name] = {}
            for each in fields(table):
                value, quantity = getattr(table, each.name), each.metadata.get("quantity")
                if value is not None:
                    unit = _UNITS.get(each.name, "")
                    if quantity is not None:
                        unit = quantity.unit(kind)
                    plain = list(value) if isinstance(value, tuple) else value
                    tables[name][each.name] = (plain, unit)
        return tables


def read_study(path: Path | str) -> StudyFile:
    """Read a scenario to compare estimators on from a TOML file.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    InputError
        If it is missing, is not TOML, has an unknown key (near names are suggested) or a value
        that cannot be.
    """
    path = Path(path)
    scenario, sha256 = read_axis_file(
        path, StudyScenario, remedy="see examples/comparisons and the guide on comparing estimators"
    )
    return StudyFile(scenario=scenario, path=path, sha256=sha256)
