"""Results made from closed forms, so that their pages are tested without a run."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stickslip.records import (
    AxisKind,
    Ending,
    EstimatorScore,
    EstimatorStudy,
    LearnedPulses,
    ParameterScore,
    Positioning,
    PositioningMove,
    PositioningRun,
    PulseRecord,
)

__all__ = ["NAME", "make", "make_run", "study"]

NAME = 'task <b>&"x"</b>'


def pulses(count: int, *, hunting: bool) -> Iterator[PulseRecord]:
    error = 0.01
    for k in range(count):
        predicted = error if not hunting or k < 2 else (-1.0) ** k * 1e-4
        moved = k != 1
        achieved = 0.9 * predicted if moved else 0.0
        yield PulseRecord(
            time=0.1 * k,
            levels=((300.0, 0.03), (-120.0, 0.01)) if k == 0 else ((300.0, 0.02),),
            error=error,
            predicted_displacement=predicted,
            achieved_displacement=achieved,
            moved=moved,
        )
        error -= achieved


def make_run(
    number: int,
    *,
    ending: Ending = Ending.REACHED,
    count: int = 6,
    samples: int = 400,
    moves: int = 1,
    sensed: bool = True,
) -> PositioningRun:
    time = np.linspace(0.0, max(0.1 * (count + 4), 1.0), samples + 1)
    decaying = 0.01 * np.exp(-8.0 * time) + (1e-4 * np.sin(60.0 * time) if count > 50 else 1e-6)
    noise = 1e-6 * np.random.default_rng(number).standard_normal(samples + 1)
    effort = np.where((time[:-1] * 10.0) % 1.0 < 0.2, 300.0, 0.0) * (time[:-1] < 0.1 * count)
    ends = np.linspace(0.0, time[-1], moves + 1)
    made = tuple(pulses(count, hunting=ending is Ending.HUNTING))
    return PositioningRun(
        number=number,
        time=time,
        error=decaying,
        measured_error=decaying + noise if sensed else decaying,
        effort=effort,
        estimate_time=0.1 * np.arange(count + 1),
        estimates={
            "mass": np.full(count + 1, 150.0),
            "coulomb_friction_positive": 100.0 - 20.0 * 0.5 ** np.arange(count + 1.0),
            "static_friction_positive": np.full(count + 1, 120.0),
        },
        moves=tuple(
            PositioningMove(
                number=k + 1,
                start_time=float(ends[k]),
                end_time=float(ends[k + 1]),
                start=0.0,
                target=0.01,
                ending=ending,
                reason="nothing <helps>" if ending is Ending.STOPPED else None,
                final_error=-1.234e-6 if ending.reached else 8.8e-5,
                late_errors=(-7.21e-5, 1.14e-4),
                settling_time=0.31 if ending.reached else None,
                peak_effort=300.0,
                pulses=made if k == 0 else (),
            )
            for k in range(moves)
        ),
    )


def make(*runs: PositioningRun, kind: AxisKind = "linear") -> Positioning:
    return Positioning(
        name=NAME,
        kind=kind,
        method="exact",
        controller="pulses planned by the exact law",
        tolerance=2e-5,
        scenario={
            "axis": {"mass": (150.0, "kg"), "offset": (5.0, "N")},
            "guess": {"estimate": ("<file>.json", "")},
        },
        truth={
            "mass": 151.0,
            "coulomb_friction_positive": 100.0,
            "static_friction_positive": 130.0,
        },
        believed={"mass": "estimate <file>.json"},
        runs=runs or (make_run(1),),
        limits={"static_friction_positive": (None, 173.0)},
        learned=LearnedPulses(method="exact", kind=kind, values={}, covariance=np.eye(1)),
        notes=("a <note>",),
        file="a <task>.toml",
        sha256="ab" * 32,
        stickslip_version="1.2.3",
    )


def study(**changes: object) -> EstimatorStudy:
    def score(bias: float, ratio: float | None) -> ParameterScore:
        return ParameterScore(
            name="mass", truth=2.0, bias=bias, rmse=0.02, runs=9, bound_ratio=ratio, coverage=0.956
        )

    made = EstimatorStudy(
        name="a <b> scenario",
        kind="linear",
        runs=9,
        samples=101,
        scenario={
            "axis": {"mass": (2.0, "kg")},
            "input": {"frequencies": ([0.5, 1.0], "Hz"), "random_phases": (True, "")},
        },
        truth={"mass": 2.0},
        bound={"mass": 0.01},
        scores=(
            EstimatorScore(name="energy", trusted=1.0, scores={"mass": score(0.001, 2.0)}),
            EstimatorScore(name="idim-ls", trusted=0.5, scores={"mass": score(-0.0199, None)}),
            EstimatorScore(
                name="ekf", trusted=1.0, assumes_inertia=True, scores={"mass": score(0.0, None)}
            ),
            EstimatorScore(name="free-decay", why_not="no decay"),
        ),
        notes=("a note",),
        file="x.toml",
        sha256="abc",
        stickslip_version="0",
    )
    return replace(made, **changes)  # pyright: ignore[reportArgumentType] - of the test's own making
