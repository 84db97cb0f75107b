"""Judge controllers under faults: ``python -m studies.positioning_faults [axis|arm ...]``.

Writes docs/evidence/positioning-faults-table.md unless ``--print`` is given.
"""

import argparse
from collections import Counter
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.progress import track

from stickslip.tasks.parallel import in_parallel
from studies.documentation.style import DOCS
from studies.markdown import table
from studies.positioning_faults.cases import ARM_CASES, AXIS_CASES, Case
from studies.positioning_faults.run import Axis, Outcome, arms, axes, move_axis

_SEED = 1
RUNAWAY = 1.5
"""Moves beyond the path at any time: an axis that came so far has run away."""


def row(case: Case, axis: Sequence[Axis], outcomes: Sequence[Outcome]) -> list[str]:
    """Return the row of a case."""
    n = len(outcomes)
    relative = [(1e-4, 1e-3, 1e-2)] if axis[0].flexible else []
    within = [
        " / ".join(str(sum(max(o.errors) <= each for o in outcomes)) for each in bounds)
        for bounds in relative
    ] or [str(sum(not any(np.isnan(o.settling)) for o in outcomes))]
    settled = [value for o in outcomes for value in o.settling if not np.isnan(value)]
    over = [value for o in outcomes for value in o.over_shortest if not np.isnan(value)]
    reasons = Counter(reason for o in outcomes for reason in o.why if reason)
    most = reasons.most_common(1)
    return [
        case.name,
        f"{within[0]} of {n}",
        f"{np.median(settled):.2f}" if settled else "–",
        *([f"{np.median(over):.2f}" if over else "–"] if axis[0].flexible else []),
        f"{max(o.farthest for o in outcomes):.2g}",
        str(sum(o.farthest > RUNAWAY for o in outcomes)),
        str(sum(o.left for o in outcomes)),
        str(sum(o.false for o in outcomes)),
        f"{max(o.peak for o in outcomes):.3g}",
        str(sum(bool(o.raised) for o in outcomes)),
        f"{most[0][0]} ({most[0][1]})" if most else "",
    ]


def study(drawn: Sequence[Axis], cases: Sequence[Case], *, workers: int = 1) -> str:
    """Return the table of all cases."""
    rows: list[list[str]] = []
    progress = Console(stderr=True)
    for case in track(cases, console=progress, transient=True):
        if workers > 1:
            jobs = [lambda axis=axis, case=case: move_axis(axis, case) for axis in drawn]
            outcomes = in_parallel(jobs, workers=workers, advance=lambda: None)
        else:
            outcomes = [move_axis(axis, case) for axis in drawn]
        rows.append(row(case, drawn, outcomes))
        progress.print(" | ".join(rows[-1]), markup=False, soft_wrap=True)
    within = "both moves within 1e-4 / 1e-3 / 1e-2" if drawn[0].flexible else "within 20 µm"
    return table(
        [
            "case",
            within,
            "median settling time [s]",
            *(["median over the shortest"] if drawn[0].flexible else []),
            "farthest beyond the path / move",
            f"runs away (over {RUNAWAY:g} moves)",
            "leaves the travel",
            "wrong reached",
            "peak effort / limit",
            "errors raised",
            "most frequent reason to stop",
        ],
        rows,
    )


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(prog="python -m studies.positioning_faults")
    parser.add_argument("plants", nargs="*", help="exact, landing, arm, arm-known; all by default")
    parser.add_argument("--axes", type=int, default=100)
    parser.add_argument("--arms", type=int, default=50)
    parser.add_argument("--duration", type=float, default=100.0, help="of a move of an arm [s]")
    parser.add_argument("--arm-method", default="tracked", help="controller of arms")
    parser.add_argument("--cases", default="", help="part of the names of the cases")
    parser.add_argument("--sampling-time", type=float, default=0.01, help="of axes [s]")
    parser.add_argument("--arm-sampling-time", type=float, default=0.02, help="of arms [s]")
    parser.add_argument("--ratio", type=float, default=3.0, help="effort limit over friction")
    parser.add_argument("--print", action="store_true", help="write no file")
    given = parser.parse_args()
    parts: list[str] = []
    for name in given.plants or ("exact", "arm-known", "arm"):
        if name.startswith("arm"):
            known = name == "arm-known"
            drawn = arms(
                given.arms,
                _SEED,
                known=known,
                method=given.arm_method,
                duration=given.duration,
                sampling_time=given.arm_sampling_time,
            )
            cases = ARM_CASES
        else:
            drawn = axes(
                given.axes,
                _SEED,
                method=name,
                sampling_time=given.sampling_time,
                ratio=given.ratio,
            )
            cases = AXIS_CASES
        chosen = [case for case in cases if given.cases in case.name]
        parts += [f"## {name}\n", study(drawn, chosen)]
        Console().print("\n".join(parts[-2:]), markup=False, soft_wrap=True)
    if not given.print:
        path = DOCS / "evidence" / "positioning-faults-table.md"
        path.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
