"""The whole path in one go: simulate an arm, log it, identify it, compare with the truth."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.jobs.identify import identify
from stickslip.jobs.json_file import write_json
from stickslip.logs import LogSchema, read_log, write_csv
from stickslip.records import Identification, InputError
from stickslip.report import write_report

__all__ = ["Demonstration", "demonstrate"]

# The report's table of parameters is lost; these surrogate values reproduce what its text says of
# the motion. Masses [kg], stiffness [N/m], friction [N, N s/m], times [s], noise [m, m/s].
_MASS_1 = _MASS_2 = 1.0
_STIFFNESS = 1.0
_COULOMB_FRICTION = 0.15
_VISCOUS_FRICTION = 0.1
_EFFORT = 1.0
_SWITCHING_TIME = 5.0
_DURATION = 60.0
_SAMPLING_TIME = 0.01
_POSITION_NOISE = 0.005
_VELOCITY_NOISE = 0.05


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
        Where the log, the estimate and the report go; made if it is missing.
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
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"the folder cannot be made ({error.strerror or type(error).__name__})",
            where=str(place),
            remedy="choose a folder you may write to",
        ) from error
    # Imported here, as the compiler behind them takes a second to load.
    from stickslip.friction import CoulombViscousFriction
    from stickslip.plants import FlexibleArm
    from stickslip.simulation import Sensors, simulate

    law = CoulombViscousFriction.symmetric(
        coulomb_friction=_COULOMB_FRICTION, viscous_friction=_VISCOUS_FRICTION
    )
    arm = FlexibleArm(mass_1=_MASS_1, mass_2=_MASS_2, stiffness=_STIFFNESS, friction=law)
    held = round(_SWITCHING_TIME / _SAMPLING_TIME)
    effort = np.zeros(round(_DURATION / _SAMPLING_TIME))
    effort[:held] = _EFFORT
    effort[held : 2 * held] = -_EFFORT
    motion = simulate(arm, effort, sampling_time=_SAMPLING_TIME)
    sensors = Sensors(position_noise=_POSITION_NOISE, velocity_noise=_VELOCITY_NOISE)
    log_file = place / "surrogate_arm.csv"
    write_csv(sensors.measure(motion, np.random.default_rng(seed)), log_file)
    # Read back what was written: the demonstration takes the way that a user's log takes.
    log = read_log(log_file, LogSchema(name="Surrogate arm (simulated)"))
    identification = identify(
        log,
        inertia=_MASS_1,
        load_inertia=_MASS_2,
        stiffness=_STIFFNESS,
        truth={
            "coulomb_friction": _COULOMB_FRICTION,
            "viscous_friction": _VISCOUS_FRICTION,
            "offset": 0.0,
        },
    )
    return Demonstration(
        setting=(
            f"Simulated with surrogate values: masses {_MASS_1:g} and {_MASS_2:g} kg, spring "
            f"{_STIFFNESS:g} N/m (known to the estimator); Coulomb friction "
            f"{_COULOMB_FRICTION:g} N, viscous friction {_VISCOUS_FRICTION:g} N s/m (to be found); "
            f"sensor noise {_POSITION_NOISE:g} m and {_VELOCITY_NOISE:g} m/s."
        ),
        identification=identification,
        log_file=log_file,
        json_file=write_json(identification.estimate.to_dict(), place / "estimate.json"),
        report_file=write_report(identification, place / "report.html"),
    )
