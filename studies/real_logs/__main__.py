"""Make the tables and figures of the page on two public logs.

    python -m studies.real_logs [--page PAGE.md] [--figures FOLDER]

It takes about a minute and rewrites the tables of the page and two figures. It needs the files of
the EMPS and TX40 benchmarks, which are not part of the project: in the folder that
``STICKSLIP_DATA`` names, or in ``../shared/data``.
"""

import os
from argparse import ArgumentParser
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from stickslip.estimation import (
    EnergyEstimator,
    IdimLeastSquares,
    MaximumLikelihoodEstimator,
    SelectedModelEstimator,
)
from stickslip.logs import read_log
from stickslip.records import AxisLog, FrictionEstimate
from studies.markdown import table, with_table
from studies.real_logs.laws import DIRECTIONS, PUBLISHED, AxisLaw
from studies.real_logs.motion import smooth_motion
from studies.real_logs.wrist import fit_coupled_joints

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "evidence" / "real-logs.md"
FIGURES = ROOT / "docs" / "figures"
EMPS = ("DATA_EMPS", "DATA_EMPS_PULSES")
TX40 = {
    "viscous_friction_1": ("viscous, motor 5", "1.86 − 0.616", 1.86 - 0.616),
    "coulomb_friction_1": ("Coulomb, motor 5", "3.03", 3.03),
    "viscous_friction_2": ("viscous, motor 6", "0.616", 0.616),
    "coulomb_friction_2": ("Coulomb, motor 6", "1.95", 1.95),
    "viscous_friction_12": ("viscous, joint 6", "0.65 − 0.616", 0.65 - 0.616),
    "coulomb_friction_12": ("Coulomb, joint 6", "0.282", 0.282),
    "offset_1": ("offset, motor 5", "−0.0288 − 0.127", -0.0288 - 0.127),
    "offset_2": ("offset, motor 6", "0.127", 0.127),
}
ALONE = {1: (8.05, 7.14), 4: (1.11, 2.48)}
BLUE, ORANGE, GREY = "#1f77b4", "#ff7f0e", "#7f7f7f"


@dataclass(frozen=True, kw_only=True)
class Emps:
    """Both logs, the selected model of each, and the laws that are compared."""

    logs: tuple[AxisLog, AxisLog]
    estimates: tuple[FrictionEstimate, FrictionEstimate]
    laws: dict[str, AxisLaw]


def data(name: str) -> Path:
    """Return the folder of a benchmark, or stop."""
    places = [ROOT.parent / "shared" / "data"]
    if "STICKSLIP_DATA" in os.environ:
        places.insert(0, Path(os.environ["STICKSLIP_DATA"]))
    for place in places:
        if (place / name).is_dir():
            return place / name
    raise SystemExit(
        f"The benchmark {name!r} is not here: name the folder that holds a folder {name!r} in the "
        "environment variable STICKSLIP_DATA ('stickslip data emps' fetches the EMPS)."
    )


def emps() -> Emps:
    """Read both logs and identify the axis from each."""
    schema = ROOT / "examples" / "emps.toml"
    own, pulses = (read_log(data("emps") / f"{name}.mat", schema) for name in EMPS)
    estimates = SelectedModelEstimator().fit(own), SelectedModelEstimator().fit(pulses)
    energy = EnergyEstimator(per_direction=True).fit(own)
    likelihood = MaximumLikelihoodEstimator(per_direction=True).fit(own)
    laws = {
        "published": PUBLISHED,
        "published, per direction": DIRECTIONS,
        "`IdimLeastSquares`": AxisLaw.of(IdimLeastSquares().fit(own)),
        "`IdimLeastSquares`, per direction": AxisLaw.of(
            IdimLeastSquares(per_direction=True).fit(own)
        ),
        "`EnergyEstimator`, per direction": AxisLaw.of(energy),
        "`MaximumLikelihoodEstimator`, per direction": AxisLaw.of(likelihood),
        "**`SelectedModelEstimator`**": AxisLaw.of(estimates[0]),
        "**`SelectedModelEstimator`**, its ripple left out": (
            AxisLaw.of(estimates[0]).without_ripple()
        ),
    }
    return Emps(logs=(own, pulses), estimates=estimates, laws=laws)


def terms(found: Emps) -> str:
    """Return how much each term improves the prediction of moves left out of the fit."""
    rows = []
    for name, estimate in zip(EMPS, found.estimates, strict=True):
        if estimate.selection is None:
            raise RuntimeError("the estimate holds no selection")
        rows += [
            [
                f"`{name}`",
                score.term,
                f"{100 * score.gain:.1f} ± {100 * score.gain_std:.1f}",
                f"{score.p_value:.2g}",
                f"{100 * score.share:.2f}",
                "selected" if score.selected else "",
            ]
            for score in estimate.selection.scores
        ]
    head = ["log", "term", "squared error on moves left out [−%]", "p", "of the effort [%]", ""]
    return table(head, rows)


def values(found: Emps) -> str:
    """Return the parameters from each log."""
    names = dict.fromkeys(name for each in found.estimates for name in each.parameters)
    rows = []
    for name in names:
        row = [name]
        for estimate in found.estimates:
            parameter = estimate.parameters.get(name)
            if parameter is None or parameter.ci95 is None:
                row.append("")
                continue
            low, high = parameter.ci95
            row.append(f"{estimate.value(name):.4g} ({low:.4g} to {high:.4g})")
        rows.append(row)
    return table(["parameter [SI]", *(f"`{name}`" for name in EMPS)], rows)


def compared(found: Emps) -> str:
    """Return residuals and free runs of all laws."""
    rows = []
    for name, law in found.laws.items():
        residuals = [
            f"{100 * law.residual(log, later=later):.2f}"
            for later in (None, 0.0)
            for log in found.logs
        ]
        runs = [
            f"{error(law, log, each_move=each):.2f}" for log in found.logs for each in (True, False)
        ]
        rows.append([name, *residuals, *runs])
    head = [
        "law", "own [%]", "pulses [%]", "own, as published [%]", "pulses, as published [%]",
        "own, each move [mm]", "own, whole [mm]", "pulses, each move [mm]", "pulses, whole [mm]",
    ]  # fmt: skip
    return table(head, rows)


def error(law: AxisLaw, log: AxisLog, *, each_move: bool) -> float:
    """Return the root mean square error of a free run [mm]."""
    away = law.free_run(log, each_move=each_move) - log.measured_position
    return 1e3 * float(np.sqrt(np.mean(away**2)))


def wrist() -> str:
    """Return the friction of the coupled joints beside what was published."""
    folder, schema = data("staubli_tx40"), ROOT / "examples" / "tx40.toml"
    fit = fit_coupled_joints(*(read_log(folder, schema, joint) for joint in (5, 6)))
    rows = []
    for name, (title, sum_of, published) in TX40.items():
        low, high = fit.ci95[name]
        shown = sum_of if "−" not in sum_of[1:] else f"{sum_of} = {published:.3f}"
        rows.append([title, f"{fit.values[name]:.3f}", f"{low:.3f} to {high:.3f}", shown,
                     "yes" if low <= published <= high else "**no**"])  # fmt: skip
    for joint, both in ALONE.items():
        alone = EnergyEstimator().fit(read_log(folder, schema, joint))
        for kind, published in zip(("viscous", "Coulomb"), both, strict=True):
            name = f"{kind.lower()}_friction"
            interval = alone.parameters[name].ci95
            if interval is None:
                raise RuntimeError(f"{name} of joint {joint} is not identified")
            low, high = interval
            rows.append([f"{kind}, joint {joint}, alone", f"{alone.value(name):.3f}",
                         f"{low:.3f} to {high:.3f}", f"{published}",
                         "yes" if low <= published <= high else "**no**"])  # fmt: skip
    head = ["friction [N m s/rad, N m]", "estimate", "95 % interval", "published", "inside"]
    return table(head, rows)


def law_figure(found: Emps, folder: Path) -> None:
    """Draw friction over speed, and the gain of each term."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
    law = found.laws["**`SelectedModelEstimator`**"]
    motion = smooth_motion(found.logs[0], cutoff=60.0)
    force = motion.effort - law.mass * motion.acceleration
    shown = slice(10 * motion.start, None, 5)
    velocity, rest = motion.velocity[shown], np.abs(force[shown])
    for sign, color, way in ((1.0, BLUE, "forward"), (-1.0, ORANGE, "backward")):
        side = velocity * sign > 0
        left.plot(np.abs(velocity[side]), rest[side], ".", ms=1, alpha=0.15, color=color)
        speed = np.linspace(1e-5, 0.13, 300)
        left.plot(speed, sign * law.friction(sign * speed), color=color, label=f"{way}, selected")
        plain = sign * DIRECTIONS.friction(sign * speed)
        left.plot(speed, plain, "--", lw=1, color=color, label=f"{way}, published")
    left.set(title="Friction", xlabel="speed [m/s]", ylabel="effort less inertia force [N]")
    left.set(xlim=(0, 0.13), ylim=(0, 58))
    left.legend(loc="lower right", fontsize=8)
    scores = [s for each in found.estimates for s in each.selection.scores]  # type: ignore[union-attr]
    names = list(dict.fromkeys(score.term for score in scores))
    for estimate, color, name, up in zip(
        found.estimates, (BLUE, ORANGE), ("own log", "with pulses"), (0.12, -0.12), strict=True
    ):
        for score in estimate.selection.scores:  # type: ignore[union-attr]
            place = -names.index(score.term) + up
            right.errorbar(100 * score.gain, place, xerr=100 * score.gain_std, color=color, ms=5,
                           fmt="o", mfc=color if score.selected else "none")  # fmt: skip
        right.plot([], [], "o", color=color, label=name)
    right.set_yticks([-k for k in range(len(names))], names)
    right.axvline(0.0, color="black", lw=0.6)
    right.set(title="Terms", xlabel="squared error on moves left out [−%]")
    right.set_xscale("symlog", linthresh=5.0)
    right.set_xticks([-5, 0, 5, 20, 50], ["-5", "0", "5", "20", "50"])
    right.legend(loc="lower right", fontsize=8)
    figure.savefig(folder / "real-logs-law.png", dpi=120)


def run_figure(found: Emps, folder: Path) -> None:
    """Draw the errors of the free runs."""
    figure, panels = plt.subplots(1, 2, figsize=(10, 3.2), layout="constrained", sharey=True)
    shown = (("published", "published", GREY),
             ("published, per direction", "per direction", ORANGE),
             ("**`SelectedModelEstimator`**", "selected", BLUE))  # fmt: skip
    for axes, log, title in zip(panels, found.logs, ("Own log", "With pulses"), strict=True):
        for key, name, color in shown:
            run = found.laws[key].free_run(log, each_move=True)
            away = 1e3 * (run - log.measured_position)
            axes.plot(log.time, away, lw=0.8, color=color, label=name)
        axes.set(title=f"{title}, started anew at each move", xlabel="time [s]")
    panels[0].set_ylabel("simulated less measured position [mm]")
    panels[0].legend()
    figure.savefig(folder / "real-logs-free-run.png", dpi=120)


def main() -> None:
    """Make the tables and the figures."""
    parser = ArgumentParser(prog="python -m studies.real_logs", description=__doc__.split("\n")[0])
    parser.add_argument("--page", type=Path, default=PAGE, help="page whose tables are rewritten")
    parser.add_argument("--figures", type=Path, default=FIGURES, help="folder of the figures")
    given = parser.parse_args()
    found = emps()
    parts = {
        "terms": terms(found),
        "values": values(found),
        "compared": compared(found),
        "wrist": wrist(),
    }
    page = given.page.read_text(encoding="utf-8")
    for title, text in parts.items():
        page = with_table(page, title, text)
    given.page.write_text(page, encoding="utf-8")
    law_figure(found, given.figures)
    run_figure(found, given.figures)


if __name__ == "__main__":
    main()
