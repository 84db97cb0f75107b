"""Friction of the joints of public arms, all of which move at once, beside published values.

``python -m studies.robot_joints --data DATA --extra EXTRA`` prints a table. DATA has the folder
``staubli_tx40`` of the tests; `FILES` says where those of EXTRA are from. They are not part of the
project. The published values are Coulomb and viscous friction, so that no term that bends the
friction curve is selected here.
"""

import hashlib
from argparse import ArgumentParser
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from stickslip.estimation import SelectedModelEstimator
from stickslip.logs import read_axes, read_schema
from stickslip.records import AxisLog, FrictionEstimate
from stickslip.tasks import axes_of_robot
from studies.real_axes.sources import ExtraFile

__all__ = ["FILES", "Published", "row"]

_BENDS = ("two-thirds", "quadratic", "stribeck", "low speed")
_CLOSE = 0.1  # of a published value [-]
_TX40 = ("thanhndv212/figaroh-examples", "c0b5c7f0fda10078be55104f9ee76ac106b7a5ee")
_UR10E = ("shamilmamedov/dynamic_calibration", "11af40e7deb758ec080a175fed8fcdd6c99aca29")
_PANDA = ("marcocognetti/FrankaEmikaPandaDynModel", "24d85ce4e648e2e894c832bfeee9b16711eb1a1a")
_PANDA_URDF = ("justagist/franka_panda_description", "62335618e7f141755524836c738efe9c01396440")
_RECORDED = "matlab/data/Exciting_Traj/Trajectory_1/rbt_log/exciting_traj_"
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
            "dataset_ur10e/identification_data/ur-20_02_12-50sec_12harm.csv",
            "bb48cca42716a88f8b255d2d1b3eb3fa4a6eac4a9a52b694d4c1066ce8b4ca51",
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
    )
}


@dataclass(frozen=True, kw_only=True)
class Published:
    """Published friction of a joint [N m, N m s/rad], and its log."""

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
    """Yield joints 1 to 5; joint 6 has the friction of two motions on one motor.

    Zeros, and the coupling of motor 6 to joints 5 and 6, as in ``staubli_tx40_tools.py``;
    published values of ``TX40_config.yaml``. The viscous friction that is published for joint 5
    holds that of motor 6 (0.616 N m s/rad), which its own torque does not overcome.
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


def _ur10e(extra: Path) -> Iterator[Published]:
    """Yield the joints, with the gains and values of ``UR10E_parameters.txt``."""
    gains = np.array([10.0, 10.6956, 8.4566, 9.0029, 9.4800, 10.1232])  # N m/A
    coulomb = (12.548, 13.266, 4.994, 1.998, 2.690, 2.298)
    viscous = (21.256, 20.221, 10.378, 3.575, 2.491, 3.026)
    table = np.loadtxt(_checked(extra, "ur10e.csv"), delimiter=",")[355:5090]  # as its authors
    time, position, current = table[:, 0] - table[0, 0], table[:, 1:7], table[:, 13:19]
    logs = _logs(time, position, gains * current)
    yield from _published("UR10e", axes_of_robot(logs, _checked(extra, "ur10e.urdf")),
                          coulomb, viscous)  # fmt: skip


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
        columns = np.column_stack([speed, np.sign(speed), np.ones(speed.size)])
        viscous[k], coulomb[k], _ = np.linalg.lstsq(columns, friction, rcond=None)[0]
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


def row(published: Published) -> str:
    """Return the row of a joint."""
    chosen = SelectedModelEstimator(exclude=_BENDS).fit(published.log)
    usual = SelectedModelEstimator().fit(published.log)
    coulomb = _cell(chosen, "coulomb_friction", published.coulomb)
    viscous = _cell(chosen, "viscous_friction", published.viscous)
    terms = ", ".join(usual.selection.selected) if usual.selection else ""
    return (
        f"| {published.arm} {published.joint} | {chosen.status.value} | {published.coulomb:.3g} | "
        f"{coulomb} | {published.viscous:.3g} | {viscous} | {usual.status.value}: {terms or '-'} |"
    )


def _cell(estimate: FrictionEstimate, name: str, published: float) -> str:
    """Return an estimate with half of its interval, and how it compares."""
    parameter = estimate.parameters.get(name)
    if parameter is None or parameter.value is None or parameter.ci95 is None:
        return "not identified |"
    low, high = parameter.ci95
    close = abs(parameter.value - published) <= _CLOSE * abs(published)
    inside = low <= published <= high
    word = "inside" if inside else ("within 10 %" if close else "**outside**")
    return f"{parameter.value:.3g} ± {0.5 * (high - low):.2g} | {word}"


def main() -> None:
    """Print the table."""
    parser = ArgumentParser(prog="python -m studies.robot_joints", description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with staubli_tx40")
    parser.add_argument("--extra", type=Path, required=True, help="folder with the other files")
    given = parser.parse_args()
    titles = "joint;status;Coulomb, published;found;;viscous, published;found;;by default"
    head = titles.split(";")
    lines = [f"| {' | '.join(head)} |", f"|{' --- |' * len(head)}"]
    every = (*_tx40(given.data, given.extra), *_ur10e(given.extra), *_panda(given.extra))
    print("\n".join([*lines, *(row(each) for each in every)]))  # noqa: T201


if __name__ == "__main__":
    main()
