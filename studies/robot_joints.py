"""Friction of the joints of public arms, all of which move at once, beside published values.

``python -m studies.robot_joints --data DATA --extra EXTRA`` prints two tables. DATA has the folder
``staubli_tx40`` of the tests; robot_joints.toml lists the files of EXTRA, which are not part of the
project. The published values are Coulomb and viscous friction, so that no term that bends the
friction curve is selected here. The second table has the published method on the log of the UR10e,
with and without samples near reversals.
"""

from argparse import ArgumentParser
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.signal import butter, filtfilt

from stickslip.estimation import SelectedModelEstimator
from stickslip.logs import read_axes, read_schema
from stickslip.records import AxisLog, FrictionEstimate
from stickslip.tasks import axes_of_robot
from studies.arm_regression import Chain, Friction, arm_friction
from studies.markdown import table
from studies.real_axes.sources import listed_files

_BENDS = ("two-thirds", "quadratic", "stribeck", "low speed")
_CLOSE = 0.1  # of a published value [-]
_SLOWEST = 0.05  # of the largest speed of a joint: the axis slides above, with and without noise
_MOTORS = 100.0  # Hz, of the low-pass of motor speeds, as published
_BETWEEN_RUNS = 2.0  # s, of the log that they make together
_SCHEMA = Path(__file__).parents[1] / "examples" / "tx40.toml"

FILES = listed_files(Path(__file__).with_suffix(".toml"))
"""The files of the folder EXTRA, by their names."""


@dataclass(frozen=True, kw_only=True)
class Published:
    """Published friction of a joint or a reference for it [N m, N m s/rad], and its log."""

    arm: str
    joint: str
    coulomb: float
    viscous: float
    log: AxisLog


def _tx40(data: Path, extra: Path) -> Iterator[Published]:
    """Yield joints 1 to 5 and the motor of joint 6, which turns by the sum of joints 5 and 6.

    Zeros, the coupling, and published values as in ``staubli_tx40_tools.py`` and
    ``TX40_config.yaml``. The viscous friction that is published for joint 5 holds that of motor 6
    (0.616 N m s/rad), which its own torque does not overcome.
    """
    coulomb, viscous = (7.14, 8.26, 6.34, 2.48, 3.03), (8.05, 5.53, 1.97, 1.11, 1.86 - 0.616)
    schema = read_schema(_SCHEMA)
    moved = {
        "2": "motor:Joint_2 / 32 - pi / 2",
        "3": "motor:Joint_3 / 45 + pi / 2",
        "6": "motor:Joint_6 / 32 - motor:Joint_5 / 45",
    }
    for axis, position in moved.items():
        own = replace(schema.axes[axis], position=position)
        schema = replace(schema, axes={**schema.axes, axis: own})
    logs = axes_of_robot(
        read_axes(data / "staubli_tx40", schema), FILES["tx40.urdf"].checked(extra)
    )
    yield from _published("TX40", logs, coulomb, viscous)
    five, six = logs["5"], logs["6"]
    if isinstance(five, AxisLog) and isinstance(six, AxisLog):
        yield _motor_6(five, six)


def _motor_6(five: AxisLog, six: AxisLog) -> Published:
    """Return the motor of joint 6 with its published friction as that of one axis.

    That is 1.95 N m and 0.616 N m s/rad of the motor, 0.282 N m and 0.65 - 0.616 N m s/rad of joint
    6 alone: along the logged motion, the line over the speed of the motor that is nearest.
    """
    low_pass = butter(4, _MOTORS, fs=1.0 / six.sampling_time)
    joint_5, joint_6 = (
        np.gradient(filtfilt(*low_pass, log.measured_position), log.sampling_time)
        for log in (five, six)
    )
    motor = joint_5 + joint_6
    friction = 0.616 * motor + 1.95 * np.sign(motor)
    friction += (0.65 - 0.616) * joint_6 + 0.282 * np.sign(joint_6)
    slides = np.abs(motor) > _SLOWEST * np.abs(motor).max()
    line = _line(motor[slides], friction[slides])
    log = replace(six, measured_position=five.measured_position + six.measured_position)
    return Published(arm="TX40", joint="motor 6", coulomb=line[0], viscous=line[1], log=log)


def _line(speed: Float[np.ndarray, " n"], friction: Float[np.ndarray, " n"]) -> tuple[float, float]:
    """Return the Coulomb and viscous friction of the line nearest to a friction curve."""
    columns = np.column_stack([np.sign(speed), speed, np.ones(speed.size)])
    coulomb, viscous, _ = np.linalg.lstsq(columns, friction, rcond=None)[0].tolist()
    return coulomb, viscous


_UR10E_FRICTION = Friction(  # of `UR10E_parameters.txt`
    coulomb=np.array([12.548, 13.266, 4.994, 1.998, 2.690, 2.298]),
    viscous=np.array([21.256, 20.221, 10.378, 3.575, 2.491, 3.026]),
)
_UR10E_JOINTS = tuple(
    f"{name}_joint"
    for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
)


def _ur10e_log(extra: Path) -> dict[str, Float[np.ndarray, "..."]]:
    """Return the log behind the published values: file and rows of ``main.m``, published gains."""
    gains = np.array([10.0, 10.6956, 8.4566, 9.0029, 9.4800, 10.1232])  # N m/A
    table = np.loadtxt(FILES["ur10e.csv"].checked(extra), delimiter=",")[634:3510]
    return {
        "time": table[:, 0] - table[0, 0],
        "position": table[:, 1:7],
        "velocity": table[:, 7:13],
        "effort": gains * table[:, 13:19],
    }


def _ur10e(extra: Path) -> Iterator[Published]:
    """Yield the joints with the published method over the samples in which they slide."""
    log = _ur10e_log(extra)
    urdf = FILES["ur10e.urdf"].checked(extra)
    slides = arm_friction(Chain.of(urdf, _UR10E_JOINTS), **log, slowest=_SLOWEST)
    logs = axes_of_robot(_logs(log["time"], log["position"], log["effort"]), urdf)
    yield from _published("UR10e", logs, slides.coulomb.tolist(), slides.viscous.tolist())


def method_rows(extra: Path) -> Iterator[list[str]]:
    """Yield rows of the published friction of the UR10e, and of the published method on its log."""
    log, chain = _ur10e_log(extra), Chain.of(FILES["ur10e.urdf"].checked(extra), _UR10E_JOINTS)
    every, slides = (arm_friction(chain, **log, slowest=each) for each in (0.0, _SLOWEST))
    speed = np.median(np.abs(log["velocity"]), axis=0)
    published, found = (each.coulomb + each.viscous * speed for each in (_UR10E_FRICTION, slides))
    for k in range(len(_UR10E_JOINTS)):
        cells = [
            f"{values[k]:.3g}"
            for kind in ("coulomb", "viscous")
            for values in (getattr(each, kind) for each in (_UR10E_FRICTION, every, slides))
        ]
        more = 100.0 * (found[k] / published[k] - 1.0)
        yield [f"UR10e {k + 1}", *cells, f"{speed[k]:.2f} rad/s: {more:+.1f} %"]


def _gen3(extra: Path) -> Iterator[Published]:
    """Yield the joints over four runs; friction of ``friction_parameters_solution_6.csv``.

    Zhang, Zhou and Vasudevan (2025), "Provably-safe, online system identification": least squares
    with the masses of the model, a constant inertia of each drive and no offset.
    """
    coulomb = (0.078406, 0.35552, 0.39523, 0.45348, 0.093010, 0.11691, 0.19954)
    viscous = (11.3153, 13.0805, 10.8422, 11.5937, 9.8041, 10.6230, 9.6101)
    columns: dict[str, list[Float[np.ndarray, "..."]]] = {"t": [], "q": [], "tau": []}
    end = -_BETWEEN_RUNS
    for run in range(1, 5):
        read = {
            name: np.loadtxt(FILES[f"gen3_{name}_{run}.csv"].checked(extra))
            for name in ("t", "q", "tau")
        }
        read["t"] += end + _BETWEEN_RUNS - read["t"][0]
        end = read["t"][-1]
        for name, values in read.items():
            columns[name].append(np.unwrap(values, axis=0) if name == "q" else values)
    every = [np.concatenate(parts) for parts in columns.values()]
    logs = axes_of_robot(_logs(*every), FILES["gen3.urdf"].checked(extra))
    yield from _published("Gen3", logs, coulomb, viscous)


def _panda(extra: Path) -> Iterator[Published]:
    """Yield the joints; their sigmoid friction (Gaz and others 2019) as line over the speeds."""
    size = (0.54615, 0.87224, 0.64068, 1.2794, 0.83904, 0.30301, 0.56489)
    shift = (0.039533, 0.025882, -0.04607, 0.036194, 0.026226, -0.021047, 0.0035526)
    slope = (5.1181, 9.0657, 10.136, 5.5903, 8.3469, 17.133, 10.336)
    time = np.loadtxt(FILES["panda_time.txt"].checked(extra))
    position, torque = (
        np.loadtxt(FILES[f"panda_{name}.txt"].checked(extra)).reshape(-1, 7)
        for name in ("positions", "torques")
    )
    new = np.concatenate(([True], np.diff(time) > 0))
    time, position, torque = time[new], position[new], torque[new]
    coulomb, viscous = np.empty(7), np.empty(7)
    for k in range(7):
        span = 50  # samples, over which the stamps are good enough for a speed
        speed = (position[span:, k] - position[:-span, k]) / (time[span:] - time[:-span])
        speed = speed[np.abs(speed) > 0.02 * np.max(np.abs(speed))]
        friction = size[k] / (1.0 + np.exp(-slope[k] * (speed + shift[k])))
        coulomb[k], viscous[k] = _line(speed, friction)
    logs = axes_of_robot(_logs(time, position, torque), FILES["panda.urdf"].checked(extra))
    yield from _published("Panda", logs, coulomb.tolist(), viscous.tolist())


def _logs(
    time: Float[np.ndarray, " n"],
    position: Float[np.ndarray, "n joints"],
    effort: Float[np.ndarray, "n joints"],
) -> dict[str, AxisLog]:
    return {
        f"joint {k + 1}": AxisLog(
            name=f"joint {k + 1}",
            kind="rotary",
            time=time,
            effort=effort[:, k],
            measured_position=position[:, k],
        )
        for k in range(position.shape[1])
    }


def _published(
    arm: str,
    logs: Mapping[str, AxisLog | Exception],
    coulomb: Sequence[float],
    viscous: Sequence[float],
) -> Iterator[Published]:
    for k, log in enumerate(list(logs.values())[: len(coulomb)]):
        if isinstance(log, Exception):
            raise log
        yield Published(arm=arm, joint=str(k + 1), coulomb=coulomb[k], viscous=viscous[k], log=log)


def row(published: Published) -> list[str]:
    """Return the row of a joint."""
    chosen = SelectedModelEstimator(exclude=_BENDS).fit(published.log)
    usual = SelectedModelEstimator().fit(published.log)
    coulomb = _cells(chosen, "coulomb_friction", published.coulomb)
    viscous = _cells(chosen, "viscous_friction", published.viscous)
    terms = ", ".join(usual.selection.selected) if usual.selection else ""
    return [
        f"{published.arm} {published.joint}",
        chosen.status.value,
        f"{published.coulomb:.3g}",
        *coulomb,
        f"{published.viscous:.3g}",
        *viscous,
        f"{usual.status.value}: {terms or '-'}",
    ]


def _cells(estimate: FrictionEstimate, name: str, published: float) -> tuple[str, str]:
    """Return an estimate with half of its interval, and how it compares."""
    parameter = estimate.parameters.get(name)
    if parameter is None or parameter.value is None or parameter.ci95 is None:
        return "not identified", ""
    low, high = parameter.ci95
    close = abs(parameter.value - published) <= _CLOSE * abs(published)
    inside = low <= published <= high
    word = "inside" if inside else ("within 10 %" if close else "**outside**")
    return f"{parameter.value:.3g} ± {0.5 * (high - low):.2g}", word


def main() -> None:
    """Print the tables."""
    parser = ArgumentParser(prog="python -m studies.robot_joints", description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with staubli_tx40")
    parser.add_argument("--extra", type=Path, required=True, help="folder with the other files")
    given = parser.parse_args()
    found = ("status", "Coulomb, reference", "found", "", "viscous, reference", "found", "")
    every = (
        *_tx40(given.data, given.extra),
        *_gen3(given.extra),
        *_ur10e(given.extra),
        *_panda(given.extra),
    )
    print(table(["joint", *found, "by default"], [row(each) for each in every]))  # noqa: T201
    kinds = ("published", "all samples", "sliding")
    quantities = [f"{kind}, {each}" for kind in ("Coulomb", "viscous") for each in kinds]
    head = ["joint", *quantities, "median speed: friction, sliding to published"]
    print(table(head, list(method_rows(given.extra))))  # noqa: T201


if __name__ == "__main__":
    main()
