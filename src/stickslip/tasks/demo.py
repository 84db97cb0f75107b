"""The demonstration: simulate an arm, log it, identify it, and land it on a target."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.logs import LogSchema, read_log, write_csv
from stickslip.outputs import files_at_once
from stickslip.presentation import write_report
from stickslip.records import Identification, Positioning, whole
from stickslip.tasks import surrogate
from stickslip.tasks.identification import identify
from stickslip.tasks.json_file import write_json
from stickslip.tasks.positioning.task import position

_LOG, _ESTIMATE, _REPORT = "surrogate_arm.csv", "estimate.json", "report.html"
_SCENARIO, _LANDING = "landing.toml", "landing.html"

_TARGET, _EFFORT_LIMIT = 1.0, 2.0  # of the landing [m, N]
_LANDING_TIME = 60.0  # [s]
_LANDING_SAMPLING_TIME = 0.02  # [s]; half the rate of the log does
_SURELY = 3.0  # standard deviations of a measured position: how near the arm is to land


@dataclass(frozen=True, kw_only=True)
class Demonstration:
    """Results of a demonstration, and the files with them."""

    setting: str  #: One sentence on the simulated arm.
    identification: Identification  #: The estimate beside the truth.
    landing: Positioning  #: Landing of the arm on a target, with the estimate for its first guess.
    log_file: Path  #: The simulated log.
    json_file: Path  #: The estimate.
    report_file: Path  #: The report on the estimate.
    scenario_file: Path  #: The scenario of the landing.
    landing_file: Path  #: The report on the landing.


def demonstrate(folder: Path | str, *, seed: int = 1) -> Demonstration:
    """Simulate the surrogate arm with its sensors, identify it, land it, and write all files.

    The arm of van de Wijdeven (2002), part A: two masses and a spring, friction on the first mass,
    driven by a positive effort for 5 s, a negative one for 5 s, then none until 60 s. It is
    identified from that log; with this estimate for its first guess, and the same sensors, feedback
    and series of pulses then land both masses at rest on a target.

    Parameters
    ----------
    folder
        Folder of the files, all of them or none; made if it is missing.
    seed
        Seed of the sensors' noise.

    Raises
    ------
    InputError
        If the seed is negative or nothing can be written in the folder.
    """
    whole("seed", seed)
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
        # The log is read from its file, like a user's
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
        (scratch / _SCENARIO).write_text(_scenario(seed), encoding="utf-8")
        landing = position(scratch / _SCENARIO)
        write_report(landing, scratch / _LANDING)
    return Demonstration(
        setting=f"Simulated with surrogate values: {surrogate.SETTING}.",
        identification=identification,
        landing=landing,
        log_file=place / _LOG,
        json_file=place / _ESTIMATE,
        report_file=place / _REPORT,
        scenario_file=place / _SCENARIO,
        landing_file=place / _LANDING,
    )


def _scenario(seed: int) -> str:
    """Return the landing as a scenario: the arm and the sensors of the log, and its estimate."""
    return f"""\
# The arm of {_LOG} lands on a target. Its friction is first taken from {_ESTIMATE}; masses and
# spring are known. Run it again as
#     stickslip position {_SCENARIO} --report {_LANDING}

name = "The identified arm lands"

[axis]                        # what is simulated
mass = {surrogate.MASS_1}
load_mass = {surrogate.MASS_2}
stiffness = {surrogate.STIFFNESS}
coulomb_friction = {surrogate.COULOMB_FRICTION}
viscous_friction = {surrogate.VISCOUS_FRICTION}

[task]
target = {_TARGET}                  # m
tolerance = {_SURELY * surrogate.POSITION_NOISE:g}             # m: three times the noise
duration = {_LANDING_TIME}               # s
sampling_time = {_LANDING_SAMPLING_TIME}

[sensors]                     # those of the log
position_noise = {surrogate.POSITION_NOISE}
velocity_noise = {surrogate.VELOCITY_NOISE}
seed = {seed}

[controller]
method = "landing"
effort_limit = {_EFFORT_LIMIT}            # N

[guess]
estimate = "{_ESTIMATE}"
"""
