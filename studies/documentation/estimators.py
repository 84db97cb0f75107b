"""Test the estimators that part A cites: ``python -m studies.documentation.estimators``.

It takes about three minutes and writes its tables into ``theory/estimators.md``; with their names,
``python -m studies.documentation.estimators kalman``, only these.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Protocol

import numpy as np
from rich.progress import track

from stickslip.estimation import (
    EnergyEstimator,
    ExtendedKalmanFilter,
    FreeDecayEstimator,
    FriedlandParkObserver,
    GradientEstimator,
    IdimInstrumentalVariables,
    IdimLeastSquares,
    LeastSquaresObserver,
    LiaoChienObserver,
    YazdizadehKhorasaniObserver,
    cramer_rao_bound,
)
from stickslip.estimation.online.observers.adaptive_observers import AdaptiveObserver
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import AxisLog, FrictionEstimate, InputError
from stickslip.simulation import Sensors, SimulatedMotion, simulate
from studies.documentation.style import DOCS
from studies.markdown import table, with_table

PAGE = DOCS / "theory" / "estimators.md"
RUNS, MANY = 40, 200
T = 0.001  # [s]
DURATION = 20.0  # [s]
MASS, COULOMB, VISCOUS = 1.0, 1.0, 1.0  # [kg, N, N s/m]
TRUTH = {"coulomb_friction": COULOMB, "viscous_friction": VISCOUS}
FAR = 0.1  # relative error beyond which a filter counts as lost
SMALL, LARGE = 1e-3, 1e-2  # noise of the velocity [m/s]; that of the position is 1/100 s of it
SLOW_AR = 0.98
OBSERVERS: tuple[type[AdaptiveObserver], ...] = (
    FriedlandParkObserver,
    YazdizadehKhorasaniObserver,
    LiaoChienObserver,
    GradientEstimator,
)
TITLES = {
    "friedland-park": "Friedland and Park",
    "yazdizadeh-khorasani": "Yazdizadeh and Khorasani",
    "liao-chien": "Liao and Chien",
    "gradient": "gradient (Slotine and Li)",
    "rls": "recursive least squares",
    "ekf": "extended Kalman filter",
    "idim-ls": "IDIM-LS",
    "idim-iv": "IDIM-IV",
    "energy": "energy",
}


class Estimator(Protocol):
    """Protocol of all estimators here."""

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Return the estimate from a log."""
        ...


def effort() -> np.ndarray:
    """Return the effort of all runs [N]: two sines, for varying speeds and rests at reversals."""
    time = np.arange(0.0, DURATION, T)
    return 3.0 * np.sin(2.0 * time) + 2.0 * np.sin(5.1 * time)


def axis(viscous: float, static: float = COULOMB) -> SingleMass:
    """Return the axis of all runs."""
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=COULOMB, viscous_friction=viscous, static_friction=static
    )
    return SingleMass(mass=MASS, friction=law)


def moved(
    viscous: float, static: float = COULOMB, force: np.ndarray | None = None
) -> SimulatedMotion:
    """Return the motion of the axis under the effort and a disturbance force [N]."""
    pushed = effort() if force is None else effort() + force
    return simulate(axis(viscous, static), pushed, sampling_time=T)


def sensors_of(noise: float, *, measured: bool = True) -> Sensors:
    """Return sensors with a noise of the velocity [m/s], and a hundredth of it on the position."""
    return Sensors(
        position_noise=0.01 * noise,
        velocity_noise=noise if measured else 0.0,
        velocity="measured" if measured else "none",
    )


def seen(motion: SimulatedMotion, noise: float, seed: int, *, measured: bool = True) -> AxisLog:
    """Return the log of a motion with the commanded effort, without the disturbance force."""
    log = sensors_of(noise, measured=measured).measure(motion, np.random.default_rng(seed))
    return replace(log, effort=np.append(effort(), effort()[-1]))


def ar1(seed: int, deviation: float) -> np.ndarray:
    """Return a slow disturbance force [N]."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=effort().size) * deviation * np.sqrt(1.0 - SLOW_AR**2)
    force = np.empty(steps.size)
    force[0] = deviation * rng.normal()
    for k in range(1, steps.size):
        force[k] = SLOW_AR * force[k - 1] + steps[k]
    return force


@dataclass(frozen=True, kw_only=True)
class Score:
    """Relative errors of an estimator in many runs, and shares of runs."""

    errors: dict[str, np.ndarray]
    covered: dict[str, float] | None
    lost: float
    trusted: float
    milliseconds: float

    def cell(self, name: str) -> str:
        """Return mean error and root mean square error in %."""
        values = 100.0 * self.errors[name]
        if values.size == 0:
            return "–"
        return f"{np.mean(values):+.2g} ({np.sqrt(np.mean(values**2)):.2g})"

    def coverage(self, name: str) -> str:
        """Return the share of runs whose interval holds the truth in %."""
        return "none" if self.covered is None else f"{100.0 * self.covered[name]:.0f}"


def scored(estimator: Estimator, logs: Sequence[AxisLog], truth: Mapping[str, float]) -> Score:
    """Fit all logs; a run counts as lost if a friction is off by more than a tenth."""
    errors: dict[str, list[float]] = {name: [] for name in truth}
    inside: dict[str, list[bool]] = {name: [] for name in truth}
    lost = trusted = 0
    estimator.fit(logs[0])  # what is compiled is not timed
    spent = 0.0
    for log in logs:
        start = perf_counter()
        found = estimator.fit(log)
        spent += perf_counter() - start
        trusted += found.status.trusted
        off: list[float] = []
        for name, true in truth.items():
            parameter = found.parameters[name]
            if parameter.value is None:
                continue
            off.append(parameter.value / true - 1.0)
            errors[name].append(off[-1])
            if parameter.ci95 is not None:
                inside[name].append(parameter.ci95[0] <= true <= parameter.ci95[1])
        lost += any(abs(error) > FAR for error in off)
    covered = None
    if all(inside.values()):
        covered = {name: float(np.mean(hits)) for name, hits in inside.items()}
    return Score(
        errors={name: np.array(values) for name, values in errors.items()},
        covered=covered,
        lost=lost / len(logs),
        trusted=trusted / len(logs),
        milliseconds=1e3 * spent / len(logs),
    )


def followed(observer: AdaptiveObserver, motion: SimulatedMotion) -> float:
    """Return the final Coulomb friction of an observer of the total friction, in closed form.

    f_c + c times the mean speed while moving, weighted by exp(-rate t) in the past.
    """
    v = motion.velocity
    moving = v[:-1] * v[1:] > 0
    speed = 0.5 * np.abs(v[:-1] + v[1:])[moving]
    decay = np.exp(-observer.rate * T)
    weights = (1.0 - decay) * decay ** np.arange(speed.size - 1, -1, -1)
    return COULOMB * (1.0 - decay**speed.size) + VISCOUS * float(weights @ speed)


def observers() -> str:
    """Test that the observers fail with viscous damping."""
    dry, wet = (seen(moved(c), 0.0, 0) for c in (0.0, VISCOUS))
    motion = moved(VISCOUS)
    noisy = [seen(motion, SMALL, seed) for seed in range(RUNS)]
    rows: list[list[str]] = []
    for made in track(OBSERVERS, "observers"):
        printed = made(inertia=MASS, viscous=False, dead_band=0.0)
        both = made(inertia=MASS, viscous=True)
        alone = printed.fit(dry).value("coulomb_friction")
        wrong = printed.fit(wet).value("coulomb_friction")
        closed = followed(printed, motion) if made is FriedlandParkObserver else None
        cured = both.fit(wet)
        scores = [scored(replace(both, dead_band=0.0), noisy, TRUTH), scored(both, noisy, TRUTH)]
        rows.append(
            [
                TITLES[printed.name],
                f"{100 * (alone / COULOMB - 1):+.2g}",
                f"{100 * (wrong / COULOMB - 1):+.3g}"
                + ("" if closed is None else f" (closed form {100 * (closed / COULOMB - 1):+.3g})"),
                *(f"{100 * (cured.value(name) / TRUTH[name] - 1):+.2g}" for name in TRUTH),
                *(score.cell(name) for score in scores for name in TRUTH),
            ]
        )
    head = [
        "observer",
        "$f_c$, Coulomb only, $c = 0$",
        f"$f_c$, Coulomb only, $c = {VISCOUS:g}$",
        "$f_c$, both estimated",
        "$c$, both estimated",
        "$f_c$, both, noise, no dead band",
        "$c$, both, noise, no dead band",
        "$f_c$, both, noise, dead band",
        "$c$, both, noise, dead band",
    ]
    return (
        f"Errors in % of the truth at the end of {DURATION:g} s (m = {MASS:g} kg, f_c = "
        f"{COULOMB:g} N; 3 N at 2 rad/s plus 2 N at 5.1 rad/s, held over samples of 1 ms), noise "
        f"being {SMALL:g} m/s on the velocity, mean and in brackets root mean square over {RUNS} "
        "runs.\n\n" + table(head, rows)
    )


def kalman() -> str:
    """Test that the extended Kalman filter is doubtful."""
    cases: dict[str, Callable[[int], AxisLog]] = {}
    motion = moved(VISCOUS)
    cases["white noise, velocity measured"] = lambda seed: seen(motion, LARGE, seed)
    cases["white noise, position only"] = lambda seed: seen(motion, LARGE, seed, measured=False)
    for excess in (0.01, 0.02, 0.3):
        sticky = moved(VISCOUS, static=(1.0 + excess) * COULOMB)
        cases[f"static friction {100 * excess:g} % higher"] = lambda seed, sticky=sticky: seen(
            sticky, LARGE, seed
        )
    cases[f"disturbance force, AR(1) {SLOW_AR:g}, 0.1 N"] = lambda seed: seen(
        moved(VISCOUS, force=ar1(seed, 0.1)), LARGE, seed
    )
    near = {name: 0.9 * true for name, true in TRUTH.items()}
    spread = {name: 0.1 * true for name, true in TRUTH.items()}
    filters = {
        "plain, first guess 0": ExtendedKalmanFilter(inertia=MASS, rest_speed=0.0, force_noise=0.0),
        "plain, first guess 10 % low": ExtendedKalmanFilter(
            inertia=MASS,
            rest_speed=0.0,
            force_noise=0.0,
            initial_values=near,
            initial_deviations=spread,
        ),
        "rests left out, no force noise": ExtendedKalmanFilter(
            inertia=MASS, exact_events=False, force_noise=0.0
        ),
        "rests left out": ExtendedKalmanFilter(inertia=MASS, exact_events=False),
        "rests too, once friction is known": ExtendedKalmanFilter(inertia=MASS),
    }
    rows: list[list[str]] = []
    for case, made in track(cases.items(), "Kalman filter"):
        logs = [made(seed) for seed in range(MANY if "white" in case else RUNS)]
        for title, one in filters.items():
            score = scored(one, logs, TRUTH)
            rows.append(
                [
                    case,
                    title,
                    f"{100 * score.lost:.0f}",
                    f"{100 * score.trusted:.0f}",
                    *(score.cell(name) for name in TRUTH),
                    *(score.coverage(name) for name in TRUTH),
                ]
            )
    head = [
        "log",
        "filter",
        "lost [%]",
        "trusted [%]",
        "$f_c$ [%]",
        "$c$ [%]",
        "$f_c$ covered [%]",
        "$c$ covered [%]",
    ]
    return (
        f"The same axis, {MANY} runs with white noise alone and {RUNS} otherwise, {LARGE:g} m/s on "
        f"the velocity and {0.01 * LARGE:g} m on the position. Lost: an error of more than "
        f"{100 * FAR:.0f} %. Trusted: by the status of the estimate. The Cramér-Rao bound is "
        f"{lowest()}.\n\n" + table(head, rows)
    )


def lowest() -> str:
    """Return the smallest standard deviations under white noise, in words."""
    kinds: list[str] = []
    for kind, measured in (("with the velocity measured", True), ("with the position only", False)):
        bound = cramer_rao_bound(
            axis(VISCOUS),
            effort(),
            sampling_time=T,
            sensors=sensors_of(LARGE, measured=measured),
            sought=tuple(TRUTH),
        ).std
        f_c, c = (f"{100 * bound[name] / true:.2g} %" for name, true in TRUTH.items())
        kinds.append(f"{f_c} of $f_c$ and {c} of $c$ {kind}")
    return ", ".join(kinds)


def decays() -> str:
    """Test Markho's formula on the decay of a mass on a spring."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.8, viscous_friction=0.5)
    arm = FlexibleArm(mass_1=2.0, mass_2=1e12, stiffness=50.0, friction=law)
    free = simulate(arm, np.zeros(2400), sampling_time=0.005, initial_state=(0.5, 0.0, 0.0, 0.0))
    truth = {"mass": 2.0, "coulomb_friction": 0.8, "viscous_friction": 0.5}
    rows: list[list[str]] = []
    for noise in (0.0, 1e-4, 1e-3):
        sensors = Sensors(position_noise=noise, velocity="none", load=False)
        runs = RUNS if noise else 1
        logs = [sensors.measure(free, np.random.default_rng(seed)) for seed in range(runs)]
        score = scored(FreeDecayEstimator(stiffness=50.0), logs, truth)
        covered = [score.coverage(name) if noise else "–" for name in truth]
        rows.append([f"{noise:g}", *(score.cell(name) for name in truth), *covered])
    head = ["noise [m]", "m [%]", "$f_c$ [%]", "$c$ [%]"]
    head += ["m covered [%]", "$f_c$ covered [%]", "$c$ covered [%]"]
    return (
        "A mass of 2 kg on a clamped spring of 50 N/m, released at 0.5 m, f_c = 0.8 N, c = 0.5 N "
        f"s/m, 5 ms; {RUNS} runs each.\n\n" + table(head, rows)
    )


def instruments() -> str:
    """Test how noise in the rows biases least squares with an unknown inertia."""
    motion = moved(VISCOUS)
    truth = {"mass": MASS, **TRUTH}
    rows: list[list[str]] = []
    for noise in track((1e-5, 3e-5, 1e-4), "instruments"):
        logs = [seen(motion, 100.0 * noise, seed, measured=False) for seed in range(RUNS)]
        for one in (IdimLeastSquares(offset=False), IdimInstrumentalVariables(offset=False)):
            made = [one.regression(log) for log in logs]
            solved = [np.linalg.lstsq(each.regressors, each.target, rcond=None)[0] for each in made]
            order = [made[0].names.index(name) for name in truth]
            errors = np.array(solved)[:, order] / np.array(list(truth.values())) - 1.0
            score = Score(
                errors=dict(zip(truth, errors.T, strict=True)),
                covered=None,
                lost=0.0,
                trusted=0.0,
                milliseconds=0.0,
            )
            rows.append([f"{noise:g}", TITLES[one.name], *(score.cell(name) for name in truth)])
    return (
        f"The least-squares solutions of the rows, with any status; {RUNS} runs each, "
        "position only, every 1 ms.\n\n"
        + table(["noise [m]", "estimator", "m [%]", "$f_c$ [%]", "$c$ [%]"], rows)
    )


def side_by_side() -> str:
    """Compare all on the same logs with a known mass."""
    motion = moved(VISCOUS)
    cases: dict[str, Callable[[int], AxisLog]] = {
        "velocity measured": lambda seed: seen(motion, LARGE, seed),
        "position only": lambda seed: seen(motion, LARGE, seed, measured=False),
        "disturbed": lambda seed: seen(moved(VISCOUS, force=ar1(seed, 0.1)), SMALL, seed),
    }
    every: list[Estimator] = [
        EnergyEstimator(inertia=MASS, offset=False),
        ExtendedKalmanFilter(inertia=MASS),
        LeastSquaresObserver(inertia=MASS),
        IdimLeastSquares(inertia=MASS, offset=False),
        IdimInstrumentalVariables(inertia=MASS, offset=False),
        *(made(inertia=MASS, viscous=True) for made in OBSERVERS),
    ]
    rows: list[list[str]] = []
    for case, made in track(cases.items(), "side by side"):
        logs = [made(seed) for seed in range(RUNS)]
        for one in every:
            try:
                score = scored(one, logs, TRUTH)
            except InputError as error:
                rows.append([case, TITLES[name_of(one)], str(error), "", "", "", ""])
                continue
            rows.append(
                [
                    case,
                    TITLES[name_of(one)],
                    *(score.cell(name) for name in TRUTH),
                    *(score.coverage(name) for name in TRUTH),
                    f"{score.milliseconds:.0f}",
                ]
            )
    head = ["log", "estimator", "$f_c$ [%]", "$c$ [%]", "$f_c$ covered [%]", "$c$ covered [%]"]
    return (
        f"{RUNS} runs each, the mass known. Measured and position only: noise as above. Disturbed: "
        f"an AR(1) force of 0.1 N with coefficient {SLOW_AR:g}, and a tenth of the noise.\n\n"
        + table([*head, "ms a fit"], rows)
    )


def name_of(estimator: Estimator) -> str:
    """Return the name in its estimates."""
    return str(getattr(estimator, "name", ""))


def main() -> None:
    """Make all tables, or those that are named."""
    parts = {
        "observers": observers,
        "kalman": kalman,
        "decays": decays,
        "instruments": instruments,
        "together": side_by_side,
    }
    for title in sys.argv[1:] or parts:
        made = parts[title]()
        page = with_table(PAGE.read_text(encoding="utf-8"), title, made)
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
