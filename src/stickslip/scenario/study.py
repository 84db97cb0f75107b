"""A scenario to compare estimators on: an axis, its effort, and its sensors."""

import csv
import io
import math
from abc import abstractmethod
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from pydantic import model_validator

from stickslip.input_files import bytes_of
from stickslip.records import InputError, ScenarioTables, finite, non_negative, positive
from stickslip.scenario.axis import AXES, Axis
from stickslip.scenario.table import Document, Read, ScenarioError, Table, key, required
from stickslip.scenario.task import SensorsTable

_MOST_SAMPLES = 5_000_000  # of one run: some ten minutes for every estimator

_LEAST_SAMPLES = 100  # of one run
_MOST_RUNS = 100_000  # of a study

_LARGEST_DELAY = _LEAST_SAMPLES // 2
"""Of the effort, in samples: even the shortest run has as many in which it acts."""

_TABLES = ("axis", "input", "sensors")


class InputTable(Table):
    """The effort of the axis, its delay, and the force that disturbs it."""

    random_phases: bool = key(
        "whether each run begins its sines anywhere; otherwise all begin at zero", default=False
    )
    effort_delay: int = key(
        "samples that the effort acts later than it is logged", ("samples", "samples"), default=0
    )
    disturbance: float = key(
        "standard deviation of a force that is not logged", "effort", non_negative, default=0.0
    )
    disturbance_correlation: float = key(
        "its correlation from sample to sample; 0 for a white one", default=0.0
    )

    @model_validator(mode="after")
    def _check_disturbance(self) -> "InputTable":
        if not 0 <= self.effort_delay <= _LARGEST_DELAY:
            raise InputError(
                "out_of_range",
                name="effort_delay",
                value=self.effort_delay,
                least=0,
                most=_LARGEST_DELAY,
                unit="samples",
            )
        if not 0.0 <= self.disturbance_correlation < 1.0:
            raise InputError("correlation_out_of_range", value=self.disturbance_correlation)
        return self

    @abstractmethod
    def build(
        self, folder: Path, generator: np.random.Generator
    ) -> tuple[Float[np.ndarray, " n"], float]:
        """Return the effort of a run [N or N m], and its sampling time [s]."""

    def acting(self, effort: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Return an effort with its delay; nothing acts before."""
        return np.concatenate((np.zeros(self.effort_delay), effort))[: effort.size]


class SineInput(InputTable):
    """A sum of sines."""

    alternative = "file"

    amplitudes: tuple[float, ...] = required("of the sines", "effort")
    frequencies: tuple[float, ...] = required("of the sines, one each", ("Hz", "Hz"))
    duration: float = required("of a run", "time", positive)
    sampling_time: float = required("of a run", "sampling_time", positive)

    @model_validator(mode="after")
    def _check_sines(self) -> "SineInput":
        amplitudes, frequencies = self.amplitudes, self.frequencies
        step, duration = self.sampling_time, self.duration
        if not amplitudes or len(amplitudes) != len(frequencies):
            raise InputError(
                "unequal_sines", amplitudes=len(amplitudes), frequencies=len(frequencies)
            )
        for amplitude in amplitudes:
            finite("amplitude", amplitude, "N or N m")
        for frequency in frequencies:
            positive("frequency", frequency, "Hz")
            if frequency * step > 0.5:
                raise InputError(
                    "sine_above_nyquist", value=frequency, rate=1.0 / step, limit=0.5 / step
                )
        if not _LEAST_SAMPLES - 0.5 <= duration / step <= _MOST_SAMPLES:
            raise InputError(
                "samples_out_of_range",
                name="duration",
                value=duration,
                samples=duration / step,
                sampling_time=step,
                least=_LEAST_SAMPLES,
                most=_MOST_SAMPLES,
            )
        return self

    def build(
        self, folder: Path, generator: np.random.Generator
    ) -> tuple[Float[np.ndarray, " n"], float]:
        step = self.sampling_time
        time = step * np.arange(round(self.duration / step))
        phases = np.zeros(len(self.frequencies))
        if self.random_phases:
            phases = generator.uniform(0.0, 2.0 * np.pi, len(self.frequencies))
        sines = [
            amplitude * np.sin(2.0 * np.pi * frequency * time + phase)
            for amplitude, frequency, phase in zip(
                self.amplitudes, self.frequencies, phases, strict=True
            )
        ]
        return np.sum(sines, axis=0), step


class FileInput(InputTable):
    """An effort from a CSV file, as ``stickslip excite`` writes it."""

    file: str = required("CSV file with the effort in its last column, in place of sines")

    @model_validator(mode="after")
    def _check_phases(self) -> "FileInput":
        if self.random_phases:
            raise InputError("both_given", names=("random_phases", "file"))
        return self

    def build(
        self, folder: Path, generator: np.random.Generator
    ) -> tuple[Float[np.ndarray, " n"], float]:
        effort, step = read_effort(folder / self.file)
        if effort.size < _LEAST_SAMPLES:
            where = str(folder / self.file)
            raise InputError(
                "too_few_samples", where=where, samples=effort.size, least=_LEAST_SAMPLES
            )
        return effort, step


_UNEVEN = 1e-3  # of a step: time stamps are rounded when they are written


def read_effort(path: Path) -> tuple[Float[np.ndarray, " n"], float]:
    """Return effort [N or N m] and sampling time [s] of a file of `stickslip.tasks.write_effort`.

    The file has a heading, time stamps [s] in the first column and the effort in the last.
    """
    where = str(path)
    content = bytes_of(path, "file of efforts", math.inf)
    try:
        text = io.StringIO(content.decode("utf-8-sig"), newline="")
        rows = [row for row in csv.reader(text) if row]
        table = np.array([[float(row[0]), float(row[-1])] for row in rows[1:]])
    except (ValueError, csv.Error) as error:
        raise InputError("efforts_not_numbers", where=where, reason=str(error)) from None
    if len(table) < 2 or not np.all(np.isfinite(table)):
        raise InputError("efforts_too_few", where=where)
    steps = np.diff(table[:, 0])
    step = float(np.mean(steps))
    if step <= 0 or np.max(np.abs(steps - step)) > _UNEVEN * step:
        raise InputError("efforts_uneven", where=where)
    return table[:, 1], step


def check_runs(runs: int) -> None:
    """Check that a number of runs is at least 2, and not too large."""
    if not 2 <= runs <= _MOST_RUNS:
        raise InputError("out_of_range", name="runs", value=runs, least=2, most=_MOST_RUNS, unit="")


class StudyHead(Table):
    """The keys before the first table."""

    name: str | None = key("title of the study", says="the file's name")
    runs: int = key("how many runs", default=100)

    @model_validator(mode="after")
    def _check_runs(self) -> "StudyHead":
        check_runs(self.runs)
        return self


@dataclass(frozen=True, kw_only=True)
class StudyScenario:
    """Runs of an axis with an effort and sensors, whose seed is that of all that is random."""

    runs: int
    axis: Axis
    input: InputTable
    sensors: SensorsTable

    def __post_init__(self) -> None:
        random = self.input.disturbance or self.input.random_phases
        if not (random or self.sensors.noisy or self.sensors.encoder_step):
            raise ScenarioError("nothing_random")

    def tables(self) -> ScenarioTables:
        """Return the values of all tables, with units."""
        return {name: getattr(self, name).shown(self.axis.kind) for name in _TABLES}


StudyFile = Read[StudyScenario]


def read_study(path: Path | str) -> StudyFile:
    """Read a scenario to compare estimators on from a TOML file.

    Raises
    ------
    InputError
        If it is missing, is not TOML, has an unknown key (near names are suggested) or a value
        out of its range, or nothing in it is random.
    """
    path = Path(path)
    document = Document(path, StudyHead, _TABLES)
    head, axis = document.table("", StudyHead), document.table("axis", AXES)
    given = document.raw("input")
    for name in SineInput.model_fields:
        if "file" in given and name in given and name not in FileInput.model_fields:
            raise ScenarioError("both_given", where=f"{path}, [input]", names=(name, "file"))
    effort = document.table("input", FileInput if "file" in given else SineInput)
    sensors = document.table("sensors", SensorsTable, optional=True)
    try:
        scenario = StudyScenario(runs=head.runs, axis=axis, input=effort, sensors=sensors)
    except InputError as error:
        raise error.at(str(path), keys=True) from None
    return StudyFile(scenario=scenario, title=head.name, path=path, sha256=document.sha256)
