"""Friction of the joints of public arms, all of which move at once, beside published values.

``python -m studies.robot_joints --data DATA --extra EXTRA`` prints two tables. DATA has the folder
``staubli_tx40`` of the tests; `FILES` has the origins of those of EXTRA. They are not part of the
project. The published values are Coulomb and viscous friction, so that no term that bends the
friction curve is selected here. The second table has the published method on the log of the UR10e,
with and without samples near reversals.
"""

import hashlib
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
from studies.real_axes.sources import ExtraFile

_BENDS = ("two-thirds", "quadratic", "stribeck", "low speed")
_CLOSE = 0.1  # of a published value [-]
_SLOWEST = 0.05  # of the largest speed of a joint: the axis slides above, with and without noise
_MOTORS = 100.0  # Hz, of the low-pass of motor speeds, as published
_TX40 = ("thanhndv212/figaroh-examples", "c0b5c7f0fda10078be55104f9ee76ac106b7a5ee")
_UR10E = ("shamilmamedov/dynamic_calibration", "11af40e7deb758ec080a175fed8fcdd6c99aca29")
_PANDA = ("marcocognetti/FrankaEmikaPandaDynModel", "24d85ce4e648e2e894c832bfeee9b16711eb1a1a")
_PANDA_URDF = ("justagist/franka_panda_description", "62335618e7f141755524836c738efe9c01396440")
_GEN3 = ("roahmlab/RAPTOR", "979a42d6135c51d8c4556a698b865f18cb0bbaaf")
_RECORDED = "matlab/data/Exciting_Traj/Trajectory_1/rbt_log/exciting_traj_"
_RUNS = "Examples/Kinova/SystemIdentification/IterativeSystemIdentification/full_params_data/"
_RUNS_SHA256 = {
    "t": (
        "c34d31a3606d8bdfad53bc6a33c29c05c855462a7220868d2402d4cbc0f599d6",
        "fb4509ca623f67cb4458f9c36ea7bf164bf7031dbe00a70311acf3d8a9545903",
        "25593141e7f3ac57d608e02eb06381033784a52e30f798a8b15cc6ea4c122e74",
        "d42745846bfdfacf289441124e0392d1f3629f917ac42e986f2c6c69ada90093",
    ),
    "q": (
        "8ff1c151ca81b6f67eb4d8f971af786fba281d23959f2ec64477afaf2f57888c",
        "e306f87d613b23b16f9339b026378b2fb73dcc80c7d0fc1f75d48dcc1a82a2b8",
        "25bc73105d1d9b1c17b854ab3323899ce5e8bc1b168937c1e424dc4b10a7d2c6",
        "33bce8f903fb085fde98dc4e25dd4e4b987c16839e637bd17aae1d7c8b55516e",
    ),
    "tau": (
        "3c274f1851c80ea98ff33168807384081a0a8abb2358f28c9c18ae859907e372",
        "431b897d9bf94b58f30c8d6b69c2ce7c6beb00cbb448e2bd209bfba757be3388",
        "e8105fee25dad19f72bb30cc6958b2d2397e11d13f245d2574cdf371e670ef37",
        "378b87d3cc0d04859806b9b06ee9a15ddb8079f8b233e68f6579db17f40cc0d3",
    ),
}
_BETWEEN_RUNS = 2.0  # s, of the log that they make together
_SCHEMA = Path(__file__).parents[1] / "examples" / "tx40.toml"

FILES: Mapping[str, ExtraFile] = {
    file: ExtraFile(file=file, repository=origin[0], commit=origin[1], path=path, sha256=digest)
    for file, origin, path, digest in (
        (
            "tx40.urdf",
            _TX40,
            "examples/staubli_TX40/urdf/tx40_mdh_modified.urdf",
            "3d00cbd46279c915d594b1bb4610dbac78d1e99ed27f95de70984bde13486074",
        ),
        (
            "ur10e.urdf",
            _UR10E,
            "URe/urdf/ur10e.urdf",
            "0d2abc6ebc70725c691a35aa6c2d03fd6e8158017a1b7da7a10a3ef52de7b821",
        ),
        (
            "ur10e.csv",
            _UR10E,
            "dataset_ur10e/identification_data/ur-20_02_10-30sec_12harm.csv",
            "341fff80f177be564c8720ea898165addfd46d7cbe6f3ffd8923eeaae0eef000",
        ),
        (
            "panda.urdf",
            _PANDA_URDF,
            "robots/panda_arm.urdf",
            "2c5198fa0d8e0bb583ede3b34f2b30dfc8243b13849ce543f94cda4035c607c6",
        ),
        (
            "panda_time.txt",
            _PANDA,
            f"{_RECORDED}time.txt",
            "031063612f297011dc005ab29830903e36f4bfeba77bce59c0fbde13620fb20d",
        ),
        (
            "panda_positions.txt",
            _PANDA,
            f"{_RECORDED}positions.txt",
            "50bf82a082c439aff8220e8142985c8dd783f7ddc1415987cd75c9efb88bcf69",
        ),
        (
            "panda_torques.txt",
            _PANDA,
            f"{_RECORDED}torques.txt",
            "11fda32785bb29ce444e14e0f45f4893aab7142dc6ee29576d828ab154852f9c",
        ),
        (
            "gen3.urdf",
            _GEN3,
            "Robots/kinova-gen3/kinova.urdf",
            "7be86d56bd722efb71f489d913f4f771a8f848cf910600e1cf2c2faec17b8296",
        ),
        *(
            (f"gen3_{name}_{run}.csv", _GEN3, f"{_RUNS}{name}_downsampled_{run}.csv", digest)
            for name, digests in _RUNS_SHA256.items()
            for run, digest in enumerate(digests, 1)
        ),
    )
}


@dataclass(frozen=True, kw_only=True)
class Published:
    """Published friction of a joint or a reference for it [N m, N m s/rad], and its log."""

    arm: str
    joint: str
    coulomb: float
    viscous: float
    log: AxisLog


def _checked(folder: Path, file: str) -> Path:
    path = folder / file
    if hashlib.sha256(path.read_bytes()).hexdigest() != FILES[file].sha256:
        raise ValueError(f"{path} has another hash than {FILES[file].address}")
    return path


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
    logs = axes_of_robot(read_axes(data / "staubli_tx40", schema), _checked(extra, "tx40.urdf"))
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
    table = np.loadtxt(_checked(extra, "ur10e.csv"), delimiter=",")[634:3510]
    return {
        "time": table[:, 0] - table[0, 0],
        "position": table[:, 1:7],
        "velocity": table[:, 7:13],
        "effort": gains * table[:, 13:19],
    }


def _ur10e(extra: Path) -> Iterator[Published]:
    """Yield the joints with the published method over the samples in which they slide."""
    log = _ur10e_log(extra)
    urdf = _checked(extra, "ur10e.urdf")
    slides = arm_friction(Chain.of(urdf, _UR10E_JOINTS), **log, slowest=_SLOWEST)
    logs = axes_of_robot(_logs(log["time"], log["position"], log["effort"]), urdf)
    yield from _published("UR10e", logs, slides.coulomb.tolist(), slides.viscous.tolist())


def method_rows(extra: Path) -> Iterator[list[str]]:
    """Yield rows of the published friction of the UR10e, and of the published method on its log."""
    log, chain = _ur10e_log(extra), Chain.of(_checked(extra, "ur10e.urdf"), _UR10E_JOINTS)
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
            name: np.loadtxt(_checked(extra, f"gen3_{name}_{run}.csv")) for name in _RUNS_SHA256
        }
        read["t"] += end + _BETWEEN_RUNS - read["t"][0]
        end = read["t"][-1]
        for name, values in read.items():
            columns[name].append(np.unwrap(values, axis=0) if name == "q" else values)
    every = [np.concatenate(parts) for parts in columns.values()]
    logs = axes_of_robot(_logs(*every), _checked(extra, "gen3.urdf"))
    yield from _published("Gen3", logs, coulomb, viscous)


def _panda(extra: Path) -> Iterator[Published]:
    """Yield the joints; their sigmoid friction (Gaz and others 2019) as line over the speeds."""
    size = (0.54615, 0.87224, 0.64068, 1.2794, 0.83904, 0.30301, 0.56489)
    shift = (0.039533, 0.025882, -0.04607, 0.036194, 0.026226, -0.021047, 0.0035526)
    slope = (5.1181, 9.0657, 10.136, 5.5903, 8.3469, 17.133, 10.336)
    time = np.loadtxt(_checked(extra, "panda_time.txt"))
    position, torque = (
        np.loadtxt(_checked(extra, f"panda_{name}.txt")).reshape(-1, 7)
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
    logs = axes_of_robot(_logs(time, position, torque), _checked(extra, "panda.urdf"))
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
