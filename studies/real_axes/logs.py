"""Load the public logs: as recorded, with their jitter and gaps, in SI units.

The required files are in the folder of public data, the extra ones in a folder of their own (see
`sources`). If a machine reports its effort in ampere, the parameters of the log are in A s²/rad
instead of kg m², and so on.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.io import loadmat

from stickslip.records import AxisLog
from studies.real_axes.reference import PLAIN_TERMS, FilteredLog
from studies.real_axes.sources import EXTRA_FILES

_GRAVITY = (*PLAIN_TERMS, "gravity_sine", "gravity_cosine")

Array = Float[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class ReferenceValue:
    """A value that an estimate is compared with."""

    value: float  #: Published, or from a least-squares fit [unit of the parameter].
    tolerance: float  #: Largest error of the reference itself [same unit].
    source: str  #: Where it comes from.


@dataclass(frozen=True, kw_only=True)
class RealLog:
    """A public log with its reference values and properties."""

    name: str  #: Unique name.
    machine: str  #: The recorded machine.
    log: AxisLog  #: The recording.
    #: Reference values by parameter name.
    reference: Mapping[str, ReferenceValue] = field(default_factory=dict)
    terms: tuple[str, ...] = PLAIN_TERMS  #: Terms of the least-squares reference for this machine.
    #: Terms whose value in a least-squares fit replaces a reference that is not known.
    fitted: tuple[str, ...] = ("inertia", "viscous_friction", "coulomb_friction")
    cutoff: float  #: Cutoff of the reference's low-pass [Hz].
    slow: float  #: Speed up to which the reference leaves rows out [m/s or rad/s].
    effort_unit: str  #: Unit of the logged effort.
    #: Logs of one group are repeats of one experiment; None for a single log.
    group: str | None = None
    #: Whether an effort law fits the log. Otherwise status ``ok`` would be a failure.
    usable: bool = True
    remark: str = ""  #: Remark for the interpretation of the result.

    def filtered(self, log: AxisLog | None = None) -> FilteredLog:
        """Return the log, or a part of it, filtered for the reference."""
        log = self.log if log is None else log
        return FilteredLog(
            time=log.time,
            position=log.measured_position,
            effort=log.effort,
            cutoff=self.cutoff,
            slow=self.slow,
        )


def load_logs(data: Path) -> list[RealLog]:
    """Return the logs in the folder of public data.

    Raises
    ------
    FileNotFoundError
        If a file is missing.
    """
    return [
        *_emps(data / "emps"),
        *_tx40(data / "staubli_tx40"),
        *_ur10e(data / "real_axes"),
        _moteus_log(data / "real_axes" / "moteus_14-29-55.csv", "ri50_14-29", "moteus ri50"),
        *_openarm(data / "real_axes" / "openarm_joint_3.npz"),
        *(
            _lorenz_log(data / "real_axes" / f"lorenz_S3_{k}.txt", f"lorenz_S3_{k}", "lorenz S3")
            for k in range(1, 5)
        ),
    ]


def load_extra_logs(folder: Path) -> tuple[list[RealLog], list[str]]:
    """Return the logs among the extra files, and the names of the files that are absent.

    Raises
    ------
    ValueError
        If a file is another one than `sources` names.
    """
    found = {
        file: each.checked(folder)
        for file, each in EXTRA_FILES.items()
        if (folder / file).is_file()
    }
    missing = [file for file in EXTRA_FILES if file not in found]
    logs = [log for file, path in found.items() if (log := _extra_log(file, path)) is not None]
    panda = {file: path for file, path in found.items() if file.startswith("panda/")}
    if len(panda) == _PANDA_FILES:
        logs.extend(_panda(folder / "panda"))
    return logs, missing


def _known(source: str, **values: tuple[float, float]) -> dict[str, ReferenceValue]:
    return {
        name: ReferenceValue(value=value, tolerance=tolerance, source=source)
        for name, (value, tolerance) in values.items()
    }


def _axis_log(
    name: str,
    kind: str,
    time: Array,
    position: Array,
    effort: Array,
    velocity: Array | None = None,
) -> AxisLog:
    """Return a log without the samples whose time stamp does not increase."""
    increasing = np.concatenate(([True], time[1:] > np.maximum.accumulate(time)[:-1]))
    return AxisLog(
        name=name,
        kind="linear" if kind == "linear" else "rotary",
        time=time[increasing],
        effort=effort[increasing],
        measured_position=position[increasing],
        measured_velocity=None if velocity is None else velocity[increasing],
    )


def _emps(folder: Path) -> Iterator[RealLog]:
    """Yield both logs of the EMPS; friction of the second is 3 % higher throughout."""
    references = {
        "DATA_EMPS": _known(
            "published",
            mass=(95.11, 0.5),
            viscous_friction=(203.5, 5.0),
            coulomb_friction=(20.39, 0.6),
            offset=(-3.165, 0.3),
        ),
        "DATA_EMPS_PULSES": _known(
            "published for the other log",
            mass=(95.11, 1.2),
            viscous_friction=(203.5, 9.0),
            coulomb_friction=(20.39, 1.2),
            offset=(-3.165, 0.3),
        ),
    }
    for name, reference in references.items():
        found = loadmat(folder / f"{name}.mat")
        time, position, signal = (np.ravel(found[key]) for key in ("t", "qm", "vir"))
        yield RealLog(
            name=name,
            machine="EMPS, carriage on a ball screw",
            log=_axis_log(name, "linear", time, position, 35.15 * signal),
            reference=reference,
            cutoff=50.0,
            slow=0.005,
            effort_unit="N",
        )


def _tx40(folder: Path) -> Iterator[RealLog]:
    """Yield joints 1 and 4 of the Stäubli TX40, which carry no gravity load."""
    positions, signals = (
        np.loadtxt(folder / file, delimiter=",", skiprows=1)
        for file in ("pos_read_data.csv", "curr_data.csv")
    )
    published = {
        1: _known("published", viscous_friction=(8.05, 0.25), coulomb_friction=(7.14, 0.4)),
        4: _known("published", viscous_friction=(1.11, 0.04), coulomb_friction=(2.48, 0.13)),
    }
    for joint, ratio in ((1, 32.0), (4, -48.0)):
        name = f"tx40_joint_{joint}"
        yield RealLog(
            name=name,
            machine="Stäubli TX40, all joints move",
            log=_axis_log(
                name,
                "rotary",
                np.arange(len(positions)) / 5000.0,
                positions[:, joint - 1] / ratio,
                signals[:, joint - 1] * ratio,
            ),
            reference=published[joint],
            cutoff=20.0,
            slow=0.05,
            effort_unit="N m",
        )


def _ur10e(folder: Path) -> Iterator[RealLog]:
    references = {
        4: _known(
            "least squares with gravity",
            inertia=(0.046, 0.005),
            viscous_friction=(0.327, 0.01),
            coulomb_friction=(0.266, 0.005),
        ),
        6: _known(
            "least squares",
            inertia=(0.041, 0.005),
            viscous_friction=(0.311, 0.009),
            coulomb_friction=(0.244, 0.005),
        ),
    }
    for joint, reference in references.items():
        yield _ur10e_log(folder / f"ur10e_joint_{joint}.csv", joint, reference)


def _ur10e_log(path: Path, joint: int, reference: Mapping[str, ReferenceValue]) -> RealLog:
    table = np.loadtxt(path, delimiter=",")
    name = f"ur10e_joint_{joint}"
    gravity = joint in {2, 3, 4}
    return RealLog(
        name=name,
        machine="UR10e, one joint moves",
        log=_axis_log(
            name,
            "rotary",
            table[:, 0],
            table[:, joint],
            table[:, 12 + joint],
            table[:, 6 + joint],
        ),
        reference=reference,
        terms=_GRAVITY if gravity else PLAIN_TERMS,
        cutoff=9.0,
        slow=0.05,
        effort_unit="A",
        remark="swings in gravity" if gravity else "",
    )


def _moteus_log(
    path: Path,
    name: str,
    group: str | None,
    *,
    cutoff: float = 20.0,
    slow: float = 1.0,
    usable: bool = True,
    remark: str = "",
) -> RealLog:
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    header = [column.strip() for column in lines[0].split(",")]
    wanted = [header.index(column) for column in _MOTEUS_COLUMNS]
    table = np.genfromtxt(lines[1:], delimiter=",", usecols=wanted)
    table = table[np.isfinite(table).all(axis=1)]
    reference = (
        _known("least squares with delay", inertia=(0.499e-3, 0.01e-3))
        if group == "moteus ri50"
        else {}
    )
    return RealLog(
        name=f"moteus_{name}",
        machine="moteus dynamometer, driving actuator",
        log=_axis_log(f"moteus_{name}", "rotary", table[:, 0], table[:, 1], table[:, 2]),
        reference=reference,
        cutoff=cutoff,
        slow=slow,
        effort_unit="N m",
        group=group,
        usable=usable,
        remark=remark,
    )


_MOTEUS_COLUMNS = ("time [s]", "a1 position [rad]", "a1 torque [Nm]")


def _openarm(path: Path) -> Iterator[RealLog]:
    reference = _known(
        "least squares and authors", coulomb_friction=(0.356, 0.02), viscous_friction=(0.26, 0.03)
    )
    yield _openarm_log(path, 3, reference=reference)
    for joint in (1, 2, 4, 5, 6, 7):
        yield _openarm_log(path, joint, moves=False)


def _openarm_log(
    path: Path,
    joint: int,
    *,
    reference: Mapping[str, ReferenceValue] | None = None,
    moves: bool = True,
) -> RealLog:
    name = f"openarm_joint_{joint}" + ("" if moves else "_at_rest")
    with np.load(path, allow_pickle=False) as found:
        time = found["time"]
        position, velocity, effort = (
            found[key][:, joint - 1] for key in ("q", "qd", "tau_measured")
        )
    return RealLog(
        name=name,
        machine="OpenArm over UART" + ("" if moves else ", joint 3 moves"),
        log=_axis_log(name, "rotary", time, position, effort, velocity),
        reference=reference or {},
        terms=_GRAVITY if joint in {1, 2, 4, 6} else PLAIN_TERMS,
        fitted=("coulomb_friction",),
        cutoff=10.0,
        slow=0.05,
        effort_unit="N m",
        usable=moves,
        remark=_OPENARM_REMARKS.get(joint, "stick-slip") if moves else "at rest",
    )


_OPENARM_REMARKS = {
    2: "stick-slip; the effort drops to 0, positions repeat",
    5: "stick-slip; positions repeat for some 20 ms",
}


def _lorenz_log(path: Path, name: str, group: str) -> RealLog:
    table = np.loadtxt(path)
    remark, fitted = _LORENZ[group.rpartition(" ")[2]]
    reference = (
        _known("least squares", coulomb_friction=(0.0151, 0.0004)) if group == "lorenz S3" else {}
    )
    return RealLog(
        name=name,
        machine="Lorenz motor with a disc",
        log=_axis_log(
            name, "rotary", 1e-3 * np.arange(len(table)), table[:, 0], table[:, 4], table[:, 1]
        ),
        reference=reference,
        fitted=fitted,
        cutoff=20.0,
        slow=1.0,
        effort_unit="N m",
        group=group,
        usable=bool(fitted),
        remark=remark,
    )


_LORENZ: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "S3": ("inertia and viscous torque are fed forward, not logged", ("coulomb_friction",)),
    "Jm": ("", ("inertia", "viscous_friction", "coulomb_friction")),
    "Bm": (
        "inertia torque is fed forward, not logged",
        ("viscous_friction", "coulomb_friction"),
    ),
    "Fc": ("inertia and viscous torque are fed forward, not logged", ("coulomb_friction",)),
    "Fs": ("everything but static friction is fed forward, not logged", ()),
}
"""By kind of the log: a remark, and what its effort contains."""


def _cart_log(path: Path, name: str, group: str | None) -> RealLog:
    table = np.loadtxt(path, delimiter=",")
    return RealLog(
        name=name,
        machine="cart on a belt, current in steps of ±4 A",
        log=_axis_log(
            name,
            "linear",
            table[:, 0],
            table[:, 2],
            table[:, 1] * _CART_TORQUE_CONSTANT / _CART_RADIUS,
            table[:, 3],
        ),
        cutoff=15.0,
        slow=0.03,
        effort_unit="N",
        group=group,
        remark="effort is a command; friction differs over the travel",
    )


_CART_TORQUE_CONSTANT, _CART_RADIUS = 93.4e-3, 0.028


def _camber_log(path: Path, name: str, *, cutoff: float, usable: bool, remark: str) -> RealLog:
    table = np.loadtxt(path)
    rotary = name.startswith("camber_EccA")
    scale = np.pi / 180.0 if rotary else 1e-3
    ampere = 1.0 if name.startswith(("camber_EccA", "camber_LinB")) else 1e-3
    return RealLog(
        name=name,
        machine="camber actuator, bus at 60-100 Hz",
        log=_axis_log(
            name,
            "rotary" if rotary else "linear",
            1e-3 * table[:, 0],
            scale * table[:, 3],
            ampere * table[:, 5],
            scale * table[:, 4],
        ),
        cutoff=cutoff,
        slow=0.02 * scale * float(np.abs(table[:, 4]).max()),
        effort_unit="A",
        usable=usable,
        remark=remark,
    )


_PANDA_FILES = 4


def _panda(folder: Path) -> Iterator[RealLog]:
    def read(what: str) -> Float[np.ndarray, "n 7"]:
        return np.loadtxt(folder / f"exciting_traj_{what}.txt").reshape(-1, 7)

    time = np.loadtxt(folder / "exciting_traj_time.txt")
    position, velocity, torque = (read(what) for what in ("positions", "velocity", "torques"))
    for joint, usable in ((1, False), (7, True)):
        yield RealLog(
            name=f"panda_joint_{joint}",
            machine="Franka Emika Panda, all joints move",
            log=_axis_log(
                f"panda_joint_{joint}",
                "rotary",
                time,
                position[:, joint - 1],
                torque[:, joint - 1],
                velocity[:, joint - 1],
            ),
            cutoff=10.0,
            slow=0.02,
            effort_unit="N m",
            usable=usable,
            remark="" if usable else "inertia changes with the other joints, which also load it",
        )


def _extra_log(file: str, path: Path) -> RealLog | None:
    """Return the log of a file, or None for a file that is only a part of one."""
    make = _EXTRA.get(file.partition("/")[0])
    return None if make is None else make(path, path.stem)


def _extra_cart_log(path: Path, stem: str) -> RealLog:
    place = stem.rpartition("_")[2]
    group = f"cart at {place}" if place.startswith("0m") else None
    return _cart_log(path, stem.replace("Test", "_").replace("testOffPoint", ""), group)


def _extra_camber_log(path: Path, stem: str) -> RealLog:
    sweep = "sine-sweep" in stem
    name = "camber_" + stem.partition("_")[0] + ("_pp" if "_pp" in stem else "")
    remark = {
        "camber_LinA_pp": "",
        "camber_LinA": "current of the slow and of the fast part follow different laws",
        "camber_LinD": "current of the slow and of the fast part follow different laws",
    }.get(name, "current is updated every 90 ms, its sign is the other one")
    return _camber_log(path, name, cutoff=15.0 if sweep else 8.0, usable=not remark, remark=remark)


def _extra_moteus_log(path: Path, stem: str) -> RealLog:
    name, group, settings = _MOTEUS[stem.removeprefix("futek_test_")]
    return _moteus_log(path, name, group, **settings)


_GEARED = {"slow": 0.3, "remark": "input faster than the sampling"}
_FAST = {"remark": "steps of 1 to 2 ms, every few of them one of 10 ms"}
_STAIRS = {"cutoff": 10.0, "usable": False, "remark": "velocity stairs in one direction"}
_DRIVEN = {"cutoff": 10.0, "usable": False, "remark": "the other actuator drives for half the time"}

_MOTEUS: Mapping[str, tuple[str, str | None, Mapping[str, Any]]] = {
    "06_05_2021_14-28-13": ("ri50_14-28", "moteus ri50", {}),
    "06_05_2021_17-09-17": ("ri50_17-09", "moteus ri50", {}),
    "06_05_2021_14-23-18": ("ri50_no_back", None, {}),
    "06_05_2021_14-11-02": ("shaft", None, {}),
    "06_05_2021_14-21-05": ("shaft_no_plate", None, {}),
    "05_05_2021_17-35-01": ("ex8_05_17-35", "moteus ex8", _GEARED),
    "06_05_2021_14-07-32": ("ex8_06_14-07", "moteus ex8", _GEARED),
    "06_05_2021_17-22-41": ("ex8_06_17-22", "moteus ex8", _GEARED),
    "25_05_2021_16-14-40": ("fast_16-14", "moteus fast", _FAST),
    "25_05_2021_16-24-02": ("fast_16-24", "moteus fast", _FAST),
    "27_04_2021_17-39-20": ("stairs_17-39", None, _STAIRS),
    "27_04_2021_17-52-10": ("stairs_17-52", None, _DRIVEN),
    "13_05_2021_17-55-58": ("stairs_13_05", None, _DRIVEN),
}


def _extra_lorenz_log(path: Path, stem: str) -> RealLog:
    stem = stem.removeprefix("data_").removeprefix("Lorenz_")
    return _lorenz_log(path, f"lorenz_{stem}", f"lorenz {stem.partition('_')[0]}")


_EXTRA: Mapping[str, Callable[[Path, str], RealLog]] = {
    "ur10e": lambda path, stem: _ur10e_log(path, int(stem[-1]), {}),
    "moteus": _extra_moteus_log,
    "openarm": lambda path, stem: _openarm_log(path, int(stem[-1])),
    "lorenz": _extra_lorenz_log,
    "cart": _extra_cart_log,
    "camber": _extra_camber_log,
}
"""By folder: how a file and its stem become a log."""
