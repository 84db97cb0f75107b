"""Joint fits of three logs of one axis on the plant of the mismatch study.

``python -m studies.joint --sets 200`` prints a table. The three logs of a set last 5 s each. They
have their own moves, noise of the effort (half to twice that of the mismatch study), offset and
delay of the effort (0 to 3 ms). The plant shares no code with `stickslip.simulation`.

In the case ``different``, the second log has 10 % more Coulomb friction than the others.
"""

import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.stats import binomtest

from stickslip.estimation import SelectedModelEstimator
from stickslip.estimation.joint.estimator import JointEstimator
from stickslip.records import AxisLog, FrictionEstimate, Status
from studies import markdown
from studies.mismatch.axes import (
    CYCLE,
    Kind,
    Setup,
    controller_of,
    draw_setup,
    motion_of,
    physical,
    true_values,
)
from studies.mismatch.plant import FINE_STEP, Inputs, run_plant

LOGS = ("morning", "noon", "evening")
COMMON = ("inertia", "viscous_friction", "coulomb_friction")
DIFFERENT = "noon"
_DURATION = 5.0  # s
_LARGEST_DELAY = 3e-3  # s
_CASES = ("same", "different")


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Result of one set of logs."""

    status: Status  #: Of the joint fit.
    #: Whether the true value of each of `COMMON` lies inside its interval; None without a value.
    inside: tuple[bool | None, ...]
    #: Of each over its standard deviation [-].
    error: Float[np.ndarray, " 3"]
    #: Standard deviation over that of the combined single fits, (sum of s^-2)^(-1/2) [-].
    std_ratio: Float[np.ndarray, " 3"]
    #: Of the joint fit and of each single fit, over the true value [-], shape (3, 4).
    errors: Float[np.ndarray, "3 4"]
    #: Number of delays whose interval holds the true value, and number of delays estimated [-].
    delays_inside: int
    delays: int
    p_value: float  #: Of the consistency test [-].
    named: tuple[str, ...]  #: Log and parameter that the test names first; empty if it names none.
    difference: float  #: That it names, relative [-]; 0 for none.


def logs_of(seed: int, *, more_coulomb: float = 0.0) -> tuple[list[AxisLog], Setup, list[float]]:
    """Return three logs of one axis, the axis, and the delay of the effort of each log [s].

    ``more_coulomb`` is the Coulomb friction of the second log over that of the others, less one
    [-].
    """
    rng = np.random.default_rng([seed, 2718])
    kind: Kind = "linear" if seed % 2 == 0 else "rotary"
    axis = replace(draw_setup(rng, kind, seed), duration=_DURATION)
    logs: list[AxisLog] = []
    delays: list[float] = []
    for name in LOGS:
        drawn = draw_setup(rng, kind, seed)
        setup = replace(axis, speeds=drawn.speeds, rests=drawn.rests, start=drawn.start)
        delay = FINE_STEP * round(rng.uniform(0.0, _LARGEST_DELAY) / FINE_STEP)
        plant = physical(axis)
        more = 1.0 + more_coulomb if name == DIFFERENT else 1.0
        coulomb = plant.coulomb_positive
        plant = plant._replace(
            coulomb_positive=more * coulomb,
            coulomb_negative=more * coulomb,
            offset=drawn.offset * coulomb,
            actuation_delay=delay,
        )
        time = CYCLE * np.arange(round(_DURATION / CYCLE))
        motion = motion_of(setup, time)
        feedforward = setup.acceleration_feedforward * setup.mass * motion.acceleration
        feedforward += setup.velocity_feedforward * plant.viscous_positive * motion.velocity
        run = run_plant(
            plant,
            controller_of(setup),
            Inputs(
                reference_position=motion.position,
                reference_velocity=motion.velocity,
                feedforward=feedforward,
                integrate=motion.moving.astype(float),
                disturbance=np.zeros(time.size),
                fine_steps=np.full(time.size, round(CYCLE / FINE_STEP)),
            ),
        )
        level = axis.noise * plant.limit * 2.0 ** rng.uniform(-1.0, 1.0)
        effort = run.effort + level * rng.standard_normal(time.size)
        logs.append(
            AxisLog(
                name=name, kind=kind, time=run.time, effort=effort, measured_position=run.reading
            )
        )
        delays.append(delay)
    return logs, axis, delays


def outcome_of(seed: int, *, more_coulomb: float = 0.0) -> Outcome:
    """Return the result of one set of `logs_of`."""
    logs, axis, delays = logs_of(seed, more_coulomb=more_coulomb)
    joint = JointEstimator().fit(logs)
    singles = [SelectedModelEstimator().fit(log) for log in logs]
    truth = true_values(axis)
    names = ["mass" if axis.kind == "linear" and n == "inertia" else n for n in COMMON]
    inside: list[bool | None] = []
    error, ratio = np.full(3, np.nan), np.full(3, np.nan)
    errors = np.full((3, 4), np.nan)
    for k, name in enumerate(names):
        value, std = _value(joint, name)
        every = np.array([_value(single, name) for single in singles])
        found = joint.parameters.get(name)
        interval = None if found is None else found.ci95
        inside.append(None if interval is None else interval[0] <= truth[name] <= interval[1])
        error[k] = (value - truth[name]) / std
        ratio[k] = std * np.sqrt(np.sum(every[:, 1] ** -2.0))
        errors[k] = np.array([value, *every[:, 0]]) / truth[name] - 1.0
    intervals = [
        (p.ci95, delay)
        for log, delay in zip(LOGS, delays, strict=True)
        if (p := joint.parameters.get(f"effort_delay[{log}]")) is not None and p.ci95 is not None
    ]
    test = joint.joint
    deviations = () if test is None else tuple(d for d in test.deviations if d.material)
    return Outcome(
        status=joint.status,
        inside=tuple(inside),
        error=error,
        std_ratio=ratio,
        errors=errors,
        delays_inside=sum(low <= delay <= high for (low, high), delay in intervals),
        delays=len(intervals),
        p_value=np.nan if test is None or test.p_value is None else test.p_value,
        named=(deviations[0].log, deviations[0].parameter) if deviations else (),
        difference=deviations[0].relative if deviations else 0.0,
    )


def _value(estimate: FrictionEstimate, name: str) -> tuple[float, float]:
    found = estimate.parameters.get(name)
    if found is None or found.value is None or found.std is None:
        return np.nan, np.nan
    return found.value, found.std


def table(same: Sequence[Outcome], different: Sequence[Outcome]) -> str:
    """Return the results of sets with equal and with different friction as a table in Markdown."""
    ok = [run for run in same if run.status is Status.OK]
    inside = np.array([list(run.inside) for run in ok if None not in run.inside], dtype=bool)
    ratio = np.array([run.std_ratio for run in ok])
    errors = np.abs(np.array([run.errors for run in ok]).reshape(-1, 3, 4))
    joint, single = (
        np.nanmedian(errors[:, :, 0], axis=0),
        np.nanmedian(errors[:, :, 1:], axis=(0, 2)),
    )
    by_parameter = [
        [
            "coverage of the 95 % intervals [%]",
            *(_rate(each) for each in inside.T),
            _rate(inside.ravel()),
        ],
        [
            "standard deviation, joint over combined single fits, median [-]",
            *(f"{np.nanmedian(each):.2f}" for each in ratio.T),
            f"{np.nanmedian(ratio):.2f}",
        ],
        [
            "median error, joint over single [-] (1/√3 = 0.58)",
            *(f"{each:.2f}" for each in joint / single),
            "",
        ],
    ]
    levels = (0.01, 0.05, 0.2)
    named_first = [run.named == (DIFFERENT, "coulomb_friction") for run in different]
    of_sets = {
        "sets with equal friction": str(len(same)),
        "of these with status ok [%]": _rate([run.status is Status.OK for run in same]),
        "false alarms of the consistency test, nominal 1 % [%]": _rate(
            [bool(run.named) for run in same]
        ),
        "p below 0.01 / below 0.05 / below 0.2 [%]": " / ".join(
            _rate([run.p_value < level for run in same]) for level in levels
        ),
        "coverage of the delays [%]": _rate(np.repeat([True, False], _delays(same))),
        f"sets with 10 % more Coulomb friction in {DIFFERENT}": str(len(different)),
        "of these detected [%]": _rate([bool(run.named) for run in different]),
        "detected, and that log and Coulomb friction named first [%]": _rate(named_first),
    }
    if different:
        median = 100 * float(np.median([run.difference for run in different]))
        of_sets["difference named, median [%]"] = f"{median:.1f}"
    head = ("quantity", "inertia", "viscous friction", "Coulomb friction", "all")
    parts = (
        markdown.table(head, by_parameter, words=1),
        markdown.table(("quantity", "result"), list(of_sets.items()), words=1),
    )
    return "\n".join(parts)


def _delays(runs: Sequence[Outcome]) -> tuple[int, int]:
    inside = sum(run.delays_inside for run in runs)
    return inside, sum(run.delays for run in runs) - inside


def _rate(hits: Sequence[bool] | np.ndarray) -> str:
    """Return a rate in per cent with its 95 % bounds."""
    n = len(hits)
    if n == 0:
        return "-"
    found = binomtest(int(np.sum(hits)), n)
    bounds = found.proportion_ci(method="wilson")
    return f"{100 * found.statistic:.1f} [{100 * bounds.low:.1f}, {100 * bounds.high:.1f}]"


def main() -> int:
    """Run the command line; return the exit status."""
    parser = ArgumentParser(prog="python -m studies.joint", description=__doc__)
    parser.add_argument("--sets", type=int, default=200, help="of logs, of each case")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--case", choices=_CASES, help="only this one")
    parser.add_argument("--out", type=Path, help="Markdown file")
    given = parser.parse_args()
    runs: dict[str, list[Outcome]] = {case: [] for case in _CASES}
    for case, more in zip(_CASES, (0.0, 0.1), strict=True):
        if given.case not in (None, case):
            continue
        for seed in range(given.first_seed, given.first_seed + given.sets):
            runs[case].append(outcome_of(seed, more_coulomb=more))
            if sys.stderr.isatty():
                sys.stderr.write(f"\r{case}: {len(runs[case])} of {given.sets} sets")
    text = table(runs["same"], runs["different"])
    sys.stdout.write(text)
    if given.out is not None:
        given.out.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
