"""The whole path in one go: simulate an arm, log it, identify it, compare with the truth."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.jobs import surrogate
from stickslip.jobs.identify import identify
from stickslip.jobs.json_file import write_json
from stickslip.logs import LogSchema, read_log, write_csv
from stickslip.outputs import files_at_once
from stickslip.records import Identification, InputError
from stickslip.report import write_report

__all__ = ["Demonstration", "demonstrate"]

_LOG, _ESTIMATE, _REPORT = "surrogate_arm.csv", "estimate.json", "report.html"


@dataclass(frozen=True, kw_only=True)
class Demonstration:
    """What a demonstration made.

    Attributes
    ----------
    setting
        One sentence: what was simulated.
    identification
        The estimate beside the truth.
    log_file, json_file, report_file
        The simulated log, the estimate and the report.
    """

    setting: str
    identification: Identification
    log_file: Path
    json_file: Path
    report_file: Path


def demonstrate(folder: Path | str, *, seed: int = 1) -> Demonstration:
    """Simulate the surrogate arm with its sensors, identify it by energies, and write all files.

    The arm of the report's part A: two masses and a spring, friction on the first mass, pushed one
    way for 5 s, the other way for 5 s, then left alone until 60 s.

    Parameters
    ----------
    folder
        Where the log, the estimate and the report go, all of them or none; made if it is missing.
    seed
        Of the sensors' noise.

    Raises
    ------
    InputError
        If the seed is negative or nothing can be written in the folder.
    """
    if seed < 0:
        raise InputError(f"seed is {seed}, it must not be negative", remedy="give 0 or more")
    place = Path(folder)
    with files_at_once(place, what="the demonstration") as scratch:
        # Imported here, as the compiler behind it takes a second to load.
        from stickslip.simulation import simulate

        motion = simulate(
            surrogate.surrogate_arm(),
            surrogate.bang_bang_effort(),
            sampling_time=surrogate.SAMPLING_TIME,
        )
        sensors = surrogate.surrogate_sensors()
        write_csv(sensors.measure(motion, np.random.default_rng(seed)), scratch / _LOG)
        # Read back what was written: the demonstration takes the way that a user's log takes.
        log = read_log(scratch / _LOG, LogSchema(name="Surrogate arm (simulated)"))
        identification = identify(
            log,
            inertia=surrogate.MASS_1,
            load_inertia=surrogate.MASS_2,
            stiffness=surrogate.STIFFNESS,
            truth={**surrogate.TRUTH, "offset": 0.0},
        )
        write_json(identification.estimate.to_dict(), scratch / _ESTIMATE)
        write_report(identification, scratch / _REPORT)
    return Demonstration(
        setting=f"Simulated with surrogate values: {surrogate.SETTING}.",
        identification=identification,
        log_file=place / _LOG,
        json_file=place / _ESTIMATE,
        report_file=place / _REPORT,
    )
