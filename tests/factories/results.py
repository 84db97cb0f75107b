"""Results made from closed forms, so that their pages are tested without a run."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stickslip.records import (
    ArmRun,
    ArmSeries,
    AxisKind,
    Ending,
    EstimatorScore,
    EstimatorStudy,
    LandingPhase,
    LandingPhaseName,
    LearnedPulses,
    ParameterScore,
    Positioning,
    PositioningMove,
    PositioningRun,
    PulseRecord,
)

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
            "mass": np.append(140.0, np.full(count, 150.0)),
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
        first_guess_sources={"mass": "estimate <file>.json"},
        runs=runs or (make_run(1),),
        limits={"static_friction_positive": (None, 173.0)},
        learned=LearnedPulses(method="exact", kind=kind, values={}, covariance=np.eye(1)),
        notes=("a <note>",),
        file="a <task>.toml",
        sha256="ab" * 32,
        stickslip_version="1.2.3",
    )


def _flown(move: int, start: float, target: float, ends: float | None) -> ArmSeries:
    phase = np.linspace(0.0, 1.0, 41)
    share = phase**2 * (3.0 - 2.0 * phase)
    return ArmSeries(
        move=move,
        start_time=start,
        sampling_time=0.05,
        pulses=40,
        target=target,
        coulomb_friction=0.149,
        viscous_friction=0.101,
        effort=np.sign(np.sin(np.arange(40.0))),
        position=target - 0.2 + 0.2 * share,
        load_position=target - 0.2 + 0.2 * share,
        start_swing=0.05,
        final_position=ends,
        final_swing=None if ends is None else 2e-5,
    )


def make_arm(
    *,
    samples: int = 600,
    moves: int = 1,
    number: int = 1,
    phases: bool = True,
    sensed: bool = True,
    series: int = 2,
) -> PositioningRun:
    end = 30.0 * moves
    time = np.linspace(0.0, end, samples + 1)
    within = time % 30.0
    gone = 1.0 - np.exp(-within)
    load = gone + np.where(within < 14.0, 0.2 * np.sin(time), 2e-5 * np.sin(time))
    target = np.where(np.minimum(time // 30.0, moves - 1) % 2 == 0, 1.0, 0.0)
    start = 1.0 - target
    position, load = start + (target - start) * gone, start + (target - start) * load
    noise = 1e-4 * np.random.default_rng(number).standard_normal(samples + 1) * sensed
    names: tuple[tuple[LandingPhaseName, float], ...] = (
        ("feedback", 0.0),
        ("resting", 8.0),
        ("series", 12.0),
        ("done", 16.0),
    )
    starts: list[tuple[LandingPhaseName, float]] = [
        (name, 30.0 * k + at) for k in range(moves) for name, at in names
    ]
    ends = [*(at for _, at in starts[1:]), end]
    arm = ArmRun(
        target=target,
        position=position,
        load_position=load,
        measured_position=position + noise,
        measured_load_position=load + noise,
        resting=within > 14.0,
        series=tuple(
            _flown(1 + k % moves, 12.0 + 0.1 * k, 1.0, 0.9999 if k else None) for k in range(series)
        )
        if phases
        else (),
    )
    return PositioningRun(
        number=number,
        time=time,
        error=arm.error,
        measured_error=arm.measured_error,
        effort=np.sin(time[:-1]) * (time[:-1] < 14.0),
        estimate_time=np.linspace(0.0, end, 50),
        estimates={
            "coulomb_friction": 0.15 - 0.1 * 0.5 ** np.arange(50.0),
            "viscous_friction": np.full(50, 0.1),
        },
        moves=tuple(
            PositioningMove(
                number=k + 1,
                start_time=30.0 * k,
                end_time=30.0 * (k + 1),
                start=float(k % 2),
                target=float((k + 1) % 2),
                ending=Ending.REACHED,
                reason=None,
                final_error=-1.234e-5,
                late_errors=(-2e-5, 1e-5),
                settling_time=14.0,
                peak_effort=1.0,
                pulses=(),
                swing=2.346e-5,
            )
            for k in range(moves)
        ),
        arm=arm,
        phases=tuple(
            LandingPhase(name=name, start_time=at, end_time=until, reason=f"because <{k}>")
            for k, ((name, at), until) in enumerate(zip(starts, ends, strict=True))
        )
        if phases
        else (),
        deviations={"coulomb_friction": np.where(np.arange(50) < 3, np.inf, 0.01)},
    )


def make_landing(*runs: PositioningRun) -> Positioning:
    return Positioning(
        name='arm <b>&"x"</b>',
        kind="linear",
        method="landing",
        controller="feedback, then series of pulses",
        tolerance=1e-4,
        scenario={
            "axis": {"load_mass": (1.0, "kg"), "stiffness": (1.0, "N/m")},
            "controller": {"effort_limit": (1.0, "N")},
        },
        truth={"coulomb_friction": 0.15, "viscous_friction": 0.1},
        first_guess_sources={"load_mass": "the axis, taken as known", "stiffness": "the scenario"},
        runs=runs or (make_arm(),),
        limits={},
        learned=None,
        notes=("Known: <all>.",),
        file="arm <1>.toml",
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
