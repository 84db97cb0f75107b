"""Make the stored reference cases anew (a few minutes on one core).

    .venv/bin/python tests/references/make_reference.py

writes single_mass.json, flexible_arm.json and design_case.json beside this file: problems in exact
floats, states with 30 digits. With case names as arguments, it prints those cases and writes
nothing.
"""

import random
import sys
from collections.abc import Iterator
from itertools import product

from event_driven import Run, simulate
from exact_plants import FlexibleArm, Friction, Plant, SingleMass
from mpmath import mp, mpf
from reference_cases import FOLDER, STORED_DIGITS, Case, StoredRun, runs_of, write

COMMAND = "python tests/references/make_reference.py"

_PERTURBATION = mpf(10) ** -25
"""Relative size of the changes that measure how well-conditioned a case is."""

_LAWS: dict[str, dict[str, tuple[float, float]]] = {
    "dry": {"coulomb": (0.25, 0.25), "static": (0.25, 0.25), "viscous": (0.0, 0.0)},
    "dry-static": {"coulomb": (0.2, 0.2), "static": (0.3, 0.3), "viscous": (0.0, 0.0)},
    "viscous": {"coulomb": (0.25, 0.25), "static": (0.25, 0.25), "viscous": (0.05, 0.05)},
    "viscous-static": {"coulomb": (0.2, 0.2), "static": (0.35, 0.35), "viscous": (0.1, 0.1)},
    "barely-viscous": {"coulomb": (0.2, 0.2), "static": (0.2, 0.2), "viscous": (1e-9, 1e-9)},
    "very-viscous": {"coulomb": (0.2, 0.2), "static": (0.3, 0.3), "viscous": (4.0, 4.0)},
    "directions": {"coulomb": (0.2, 0.3), "static": (0.25, 0.4), "viscous": (0.05, 0.3)},
    "one-way-viscous": {"coulomb": (0.3, 0.15), "static": (0.3, 0.15), "viscous": (0.2, 0.0)},
}
_OFFSETS = {"directions": 0.05, "one-way-viscous": -0.1}


def _random_effort(
    seed: int, samples: int, held: tuple[int, int], largest: float
) -> tuple[tuple[float, int], ...]:
    """Draw efforts with few binary digits, each held for some samples; some are zero."""
    draw = random.Random(seed)  # noqa: S311  (a test input, not a secret)
    effort: list[float] = []
    while len(effort) < samples:
        value = draw.choice((0, draw.randint(-32, 32), draw.randint(-32, 32))) / 32 * largest
        effort += [value] * draw.randint(*held)
    return runs_of(effort[:samples])


def _arm(mass_1: float = 1.0, mass_2: float = 1.0, stiffness: float = 1.0) -> dict[str, float]:
    return {"mass_1": mass_1, "mass_2": mass_2, "stiffness": stiffness}


# sampling time, stiffness (for omega T of 0.001 to 6), samples, samples an effort is held
_ARM_TIMES = [
    (0.001, 0.5, 6000, (100, 500)),
    (0.01, 1.0, 2500, (20, 150)),
    (0.1, 1.0, 400, (2, 20)),
    (0.5, 1.0, 200, (1, 6)),
    (1.0, 1.0, 150, (1, 4)),
    (2.0, 1.0, 100, (1, 3)),
    (2.0, 4.5, 100, (1, 3)),
]
_MASS_TIMES = [
    (0.001, 6000, (100, 500)),
    (0.01, 1500, (20, 250)),
    (0.1, 400, (1, 12)),
    (1.0, 150, (1, 3)),
    (2.0, 100, (1, 2)),
]


def _arm_grid() -> Iterator[Case]:
    for number, ((time, stiffness, samples, held), law) in enumerate(product(_ARM_TIMES, _LAWS)):
        omega_time = (2 * stiffness) ** 0.5 * time
        moving = (0.0, 0.0, 0.0, -0.5) if time < 0.005 else (0.0, 0.0, 0.0, 0.0)
        yield Case(
            name=f"{law}-T{time:g}-k{stiffness:g}",
            about=f"random efforts, omega T = {omega_time:.2g}",
            plant=_arm(stiffness=stiffness),
            **_LAWS[law],
            offset=_OFFSETS.get(law, 0.0),
            sampling_time=time,
            initial_state=moving,
            effort_runs=_random_effort(1000 + number, samples, held, 2.0 if time < 0.005 else 1.0),
        )


def _mass_grid() -> Iterator[Case]:
    for number, ((time, samples, held), law) in enumerate(product(_MASS_TIMES, _LAWS)):
        yield Case(
            name=f"{law}-T{time:g}",
            about="random efforts",
            plant={"mass": 1.0},
            **_LAWS[law],
            offset=_OFFSETS.get(law, 0.0),
            sampling_time=time,
            initial_state=(0.0, -0.25 if time < 0.005 else 0.0),
            effort_runs=_random_effort(2000 + number, samples, held, 1.0),
        )


def _symmetric(coulomb: float, static: float, viscous: float) -> dict[str, tuple[float, float]]:
    return {
        "coulomb": (coulomb, coulomb),
        "static": (static, static),
        "viscous": (viscous, viscous),
    }


def _special_arms() -> Iterator[Case]:
    yield Case(
        name="surrogate",
        about="the surrogate arm: first mass comes to rest at 20.2 s, second swings on at 0.116 m",
        plant=_arm(),
        **_symmetric(0.15, 0.15, 0.1),
        sampling_time=0.01,
        initial_state=(0.0,) * 4,
        effort_runs=((1.0, 500), (-1.0, 500), (0.0, 5000)),
        kept=60,
    )
    yield Case(
        name="bang-bang",
        about="+-0.5 N in turn for 2 s each, 64 s",
        plant=_arm(),
        **_symmetric(0.1, 0.1, 0.05),
        sampling_time=0.01,
        initial_state=(0.0,) * 4,
        effort_runs=((0.5, 200), (-0.5, 200)) * 16,
        kept=40,
    )
    for name, heavy in (("light-motor", _arm(0.01, 1.0)), ("light-load", _arm(1.0, 0.01))):
        for law in ("viscous-static", "directions"):
            yield Case(
                name=f"{name}-{law}",
                about="mass ratio of 100",
                plant=heavy,
                **_LAWS[law],
                sampling_time=0.05,
                initial_state=(0.0,) * 4,
                effort_runs=_random_effort(31, 400, (1, 30), 1.0),
            )
    yield Case(
        name="micrometres",
        about="small forces and motions, stiff spring, heavy masses",
        plant=_arm(80.0, 20.0, 3.0e5),
        **_symmetric(12.0, 18.0, 90.0),
        offset=-3.2,
        sampling_time=0.001,
        initial_state=(1.0e-6, 0.0, 0.0, 0.0),
        effort_runs=_random_effort(32, 1500, (2, 60), 30.0),
    )
    yield Case(
        name="swinging-load",
        about="the load alone swings and frees the stuck motor again and again",
        plant=_arm(4.0, 1.0, 2.0),
        **_symmetric(0.5, 0.75, 0.02),
        sampling_time=0.7,
        initial_state=(0.0, 0.0, 6.0, 0.0),
        effort_runs=((0.0, 120),),
        kept=40,
    )
    yield Case(
        name="thrown",
        about="the load is thrown at a stuck motor; long samples hold many stops each",
        plant=_arm(0.25, 2.0, 3.0),
        **_symmetric(0.25, 0.5, 0.01),
        sampling_time=8.0,
        initial_state=(0.0, 0.0, 0.0, 4.0),
        effort_runs=((0.0, 12), (0.3, 12)),
        kept=24,
    )
    # With m1 = m2, effort = Coulomb friction and c = 0 the centre of mass keeps its velocity V and
    # v1 = V (1 + a cos(omega t)): it grazes zero for a = 1. Here v1(0) = V + A, v2(0) = V - A.
    for name, share in (
        ("clear", 1.0 - 2.0**-10),
        ("near", 1.0 - 2.0**-20),
        ("nearer", 1.0 - 2.0**-30),
        ("past", 1.0 + 2.0**-10),
        ("just-past", 1.0 + 2.0**-20),
        ("barely-past", 1.0 + 2.0**-30),
        ("exactly", 1.0),
    ):
        for static in (0.125, 0.1875):
            if name == "exactly" and static > 0.125:
                continue  # the motion is discontinuous there; see the simulator's own tests
            yield Case(
                name=f"grazing-{name}-fs{static:g}",
                about=f"velocity of the motor comes within {1 - share:.1e} of grazing zero",
                plant=_arm(),
                **_symmetric(0.125, static, 0.0),
                sampling_time=0.25,
                initial_state=(0.0, 1.0 + share, 0.0, 1.0 - share),
                effort_runs=((0.125, 80),),
                exact_tie=name == "exactly",
                kept=20,
            )
    # The spring force of a load swinging beside a stuck motor just reaches the static friction.
    for name, swing in (("inside", 1 - 2.0**-20), ("outside", 1 + 2.0**-20)):
        for static in (0.5, 0.625):
            yield Case(
                name=f"breakaway-just-{name}-fs{static:g}",
                about="spring force peaks within 1e-6 of the static friction",
                plant=_arm(),
                **_symmetric(0.5, static, 0.0625),
                sampling_time=0.5,
                initial_state=(0.0, 0.0, 0.0, static * swing),
                effort_runs=((0.0, 60),),
                kept=20,
            )


def _special_masses() -> Iterator[Case]:
    yield Case(
        name="table-1-pulses",
        about="report part B, Table 1: pulses of 300 N from 1 to 15 samples",
        plant={"mass": 150.0},
        **_symmetric(100.0, 130.0, 700.0),
        sampling_time=0.01,
        initial_state=(0.0, 0.0),
        effort_runs=tuple(
            run
            for width in (1, 2, 3, 7, 15)
            for run in ((300.0, width), (0.0, 40), (-300.0, width), (0.0, 40))
        ),
        kept=40,
    )
    yield Case(
        name="positioning-stage",
        about="a stage of 95 kg, friction per direction, offset",
        plant={"mass": 95.154},
        coulomb=(20.144, 20.6277),
        static=(26.0, 24.0),
        viscous=(166.7061, 240.4236),
        offset=-3.1648,
        sampling_time=0.001,
        initial_state=(0.0, 0.0),
        effort_runs=_random_effort(41, 6000, (30, 700), 80.0),
    )
    yield Case(
        name="stuck-under-95-N",
        about="an effort below static friction moves nothing, ever",
        plant={"mass": 1.0},
        **_symmetric(60.0, 100.0, 5.0),
        sampling_time=0.01,
        initial_state=(0.1, 0.0),
        effort_runs=((95.0, 200), (-95.0, 200), (100.0, 10), (-100.0, 10)),
        exact_tie=True,
    )
    yield Case(
        name="stop-at-sample",
        about="velocity is zero exactly at a sample; the next effort cannot free the mass",
        plant={"mass": 2.0},
        **_symmetric(0.5, 1.0, 0.0),
        sampling_time=0.25,
        initial_state=(0.0, 1.0),
        effort_runs=((-0.5, 8), (0.75, 8), (-0.9375, 4), (1.5, 4), (-1.5, 6), (-0.75, 8)),
        exact_tie=True,
        kept=40,
    )
    yield Case(
        name="heavy-drop",
        about="decaying through many time constants to the terminal velocity and to rest",
        plant={"mass": 0.01},
        **_symmetric(0.1, 0.125, 20.0),
        sampling_time=0.5,
        initial_state=(0.0, 3.0),
        effort_runs=((-1.0, 3), (1.0, 3), (0.05, 3), (0.11, 3), (-0.13, 3), (0.0, 3)),
    )
    for exponent in (-3, -6, -10, -14):
        yield Case(
            name=f"viscous-1e{exponent}",
            about="viscous friction on the way to none",
            plant={"mass": 1.0},
            **_symmetric(0.25, 0.25, 10.0**exponent),
            sampling_time=0.5,
            initial_state=(0.0, 0.0),
            effort_runs=_random_effort(51, 100, (1, 4), 1.0),
        )


def _design() -> Iterator[Case]:
    yield Case(
        name="design",
        about="+0.5 N and -0.5 N for 2 s each, then none: the benchmark of the simulators",
        plant=_arm(),
        **_symmetric(0.1, 0.1, 0.05),
        sampling_time=0.01,
        initial_state=(0.0,) * 4,
        effort_runs=((0.5, 200), (-0.5, 200), (0.0, 6000)),
        kept=160,
    )


def plant_of(case: Case) -> Plant:
    """Make the reference's plant of a case."""
    friction = Friction(
        coulomb=case.coulomb, static=case.static, viscous=case.viscous, offset=case.offset
    )
    kind = SingleMass if "mass" in case.plant else FlexibleArm
    return kind(**case.plant, friction=friction)


def _perturbed(case: Case, digits: int) -> Run:
    """Run the case with efforts and masses changed in the 25th digit."""
    draw = random.Random(case.name)  # noqa: S311  (as above)
    with mp.workdps(digits):
        changes = {
            name: value * (1 + draw.uniform(-1, 1) * _PERTURBATION)
            for name, value in case.plant.items()
        }
        plant = plant_of(case)
        for name, value in changes.items():
            setattr(plant, name, value)
        effort = [value * (1 + draw.uniform(-1, 1) * _PERTURBATION) for value in case.effort]
    return simulate(plant, effort, case.sampling_time, case.initial_state, digits=digits)


def compute(case: Case, *, digits: int = 100, conditioning: bool = True) -> StoredRun:
    """Run a case and keep what is stored of it."""
    run = simulate(
        plant_of(case), case.effort, case.sampling_time, case.initial_state, digits=digits
    )
    with mp.workdps(digits):
        largest = [max(abs(value) for s in run.states for value in s[part::2]) for part in (0, 1)]
        amplification = None
        if conditioning and not case.exact_tie:
            other = _perturbed(case, digits)
            amplification = max(
                (
                    float(abs(a - b) / (largest[i % 2] * _PERTURBATION))
                    for state, twin in zip(run.states, other.states, strict=True)
                    for i, (a, b) in enumerate(zip(state, twin, strict=True))
                    if largest[i % 2]
                ),
                default=0.0,
            )
        kinds = ("stick", "reversal", "breakaway", "start", "touch")
        return StoredRun(
            case=case,
            states={
                k: tuple(mp.nstr(value, STORED_DIGITS) for value in run.states[k])
                for k in case.kept_samples
            },
            at_rest={k: run.stuck[k] for k in case.kept_samples},
            events={kind: run.count(kind) for kind in kinds},
            hidden=run.hidden(),
            largest_position=float(largest[0]),
            largest_velocity=float(largest[1]),
            amplification=amplification,
        )


def _report(stored: StoredRun) -> None:
    happened = ", ".join(f"{count} {kind}" for kind, count in stored.events.items() if count)
    print(  # noqa: T201  (the script's progress)
        f"{stored.case.name}: {happened or 'no event'}; {stored.hidden} hidden; "
        f"amplification {stored.amplification}",
        flush=True,
    )


def main() -> None:
    """Write the files, or print the named cases."""
    files = {
        "design_case": list(_design()),
        "single_mass": [*_mass_grid(), *_special_masses()],
        "flexible_arm": [*_arm_grid(), *_special_arms()],
    }
    for name, cases in files.items():
        if len(sys.argv) > 1:
            for case in cases:
                if case.name in sys.argv[1:]:
                    _report(compute(case))
            continue
        runs = []
        for case in cases:
            runs.append(compute(case))
            _report(runs[-1])
        write(FOLDER / f"{name}.json", COMMAND, runs)


if __name__ == "__main__":
    main()
