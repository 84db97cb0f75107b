"""Judge friction laws by two public logs: ``python docs/make_real_logs.py``.

It takes about a minute, writes its tables into ``theory/real-logs.md`` and draws the figures. It
needs the files of the EMPS and TX40 benchmarks, which are not part of the project: in the folder
that ``STICKSLIP_DATA`` names, or in ``../shared/data`` beside the checkout.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import make_figures as look
import matplotlib.pyplot as plt
import numpy as np
from make_estimators import table, write

from stickslip.estimation import (
    CoupledJoints,
    EnergyEstimator,
    FittedLaw,
    FrictionForm,
    IdimLeastSquares,
    LawSelection,
    MaximumLikelihoodEstimator,
    RowSettings,
    find_moves,
    force_ripple,
    select_friction_law,
)
from stickslip.estimation.regression.law_selection.linear_fit import fit_rows
from stickslip.logs import read_log
from stickslip.records import AxisLog

ROOT = Path(__file__).parents[1]
PAGE = Path(__file__).parent / "theory" / "real-logs.md"
AS_PUBLISHED = RowSettings(held=False)
PUBLISHED = FittedLaw(
    form=FrictionForm(offset=True),
    inertia=95.1089,
    values={"viscous_friction": 203.5034, "coulomb_friction": 20.3935, "offset": -3.1648},
)
DIRECTIONS = FittedLaw(
    form=FrictionForm(coulomb_per_direction=True, viscous_per_direction=True),
    inertia=95.1540,
    values={
        "viscous_friction_positive": 166.7061,
        "viscous_friction_negative": 240.4236,
        "coulomb_friction_positive": 20.1440,
        "coulomb_friction_negative": 20.6277,
    },
)
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


@dataclass(frozen=True, kw_only=True)
class Emps:
    """Both logs, and what was chosen from the first."""

    own: AxisLog
    pulses: AxisLog
    selection: LawSelection

    @cached_property
    def laws(self) -> dict[str, FittedLaw]:
        """What is compared."""
        chosen = self.selection.law
        return {
            "published": PUBLISHED,
            "published, per direction": DIRECTIONS,
            "`IdimLeastSquares`": FittedLaw.of(IdimLeastSquares().fit(self.own)),
            "`IdimLeastSquares`, per direction": FittedLaw.of(
                IdimLeastSquares(per_direction=True).fit(self.own)
            ),
            "`EnergyEstimator`, per direction": FittedLaw.of(
                EnergyEstimator(per_direction=True).fit(self.own)
            ),
            "`MaximumLikelihoodEstimator`, per direction": FittedLaw.of(
                MaximumLikelihoodEstimator(per_direction=True).fit(self.own)
            ),
            "**chosen**": chosen,
            "**chosen**, its ripple left out": chosen.without_ripple(),
        }


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
    """Read the logs and choose a law."""
    schema = ROOT / "examples" / "emps.toml"
    own, pulses = (
        read_log(data("emps") / f"{name}.mat", schema) for name in ("DATA_EMPS", "DATA_EMPS_PULSES")
    )
    return Emps(own=own, pulses=pulses, selection=select_friction_law(own))


def candidates(found: Emps) -> str:
    """Return how well each law foretells moves it has not seen."""
    rows = []
    for score in found.selection.scores:
        chosen = score.candidate is found.selection.chosen
        verdict = "**chosen**" if chosen else "within" if score.within else ""
        rows.append(
            [
                score.candidate.name,
                f"{score.candidate.size}",
                f"{score.error:.3f}",
                f"{score.excess:.2f} ± {score.excess_std:.2f}",
                " ".join(f"{each:.1f}" for each in score.fold_errors),
                verdict,
            ]
        )
    head = ["law", "parameters", "error [N]", "excess [N²]", "error in each kind of move [N]", ""]
    return table(head, rows)


def values(found: Emps) -> str:
    """Return the parameters of the chosen law."""
    fit, form = found.selection.fit, found.selection.law.form
    rows = [
        [name, f"{value:.4g}", f"{fit.ci95[name][0]:.4g} to {fit.ci95[name][1]:.4g}"]
        for name, value in fit.values.items()
    ]
    if form.stribeck is None or form.period is None:
        raise RuntimeError("the law chosen has no bend or no ripple: write the page anew")
    rows.append(["speed of the bend [m/s]", f"{form.stribeck.velocity:.4g}", "from a grid"])
    rows.append(["period of the ripple [m]", f"{form.period:.4g}", "from its spectrum"])
    return table(["parameter [SI]", "value", "95 % interval"], rows)


def error(law: FittedLaw, log: AxisLog, starts: Sequence[int]) -> float:
    """Return the root mean square error of a free run [mm]."""
    return 1e3 * float(np.sqrt(np.mean((law.free_run(log, starts) - log.measured_position) ** 2)))


def compared(found: Emps) -> str:
    """Return residuals and free runs of all laws."""
    rows = []
    own, pulses = ([start for start, _ in find_moves(log)] for log in (found.own, found.pulses))
    for name, law in found.laws.items():
        residuals = [
            f"{100 * law.effort_residual(log, rows_):.2f}"
            for rows_ in (RowSettings(), AS_PUBLISHED)
            for log in (found.own, found.pulses)
        ]
        runs = [
            f"{error(law, log, each):.2f}"
            for log, begun in ((found.own, own), (found.pulses, pulses))
            for each in (begun, [])
        ]
        rows.append([name, *residuals, *runs])
    head = [
        "law", "own [%]", "pulses [%]", "own, as published [%]", "pulses, as published [%]",
        "own, each move [mm]", "own, whole [mm]", "pulses, each move [mm]", "pulses, whole [mm]",
    ]  # fmt: skip
    return table(head, rows)


def levels(found: Emps) -> str:
    """Return how far the friction of the second log is from what the first one foretells."""
    motion = RowSettings().motion(found.pulses)
    starts = [start for start, _ in find_moves(found.pulses)]
    rows = []
    for name, law in found.laws.items():
        force = law.friction(motion.position, motion.velocity)
        both = motion.decimated(
            np.column_stack([motion.effort - law.inertia * motion.acceleration, force])
        )
        scale = float(both[:, 0] @ both[:, 1] / (both[:, 1] @ both[:, 1]))
        scaled = replace(law, values={key: scale * value for key, value in law.values.items()})
        rows.append(
            [
                name,
                f"{100 * (scale - 1):+.1f}",
                f"{100 * scaled.effort_residual(found.pulses):.2f}",
                f"{error(scaled, found.pulses, starts):.2f}",
                f"{error(scaled, found.pulses, []):.2f}",
            ]
        )
    head = ["law", "friction [%]", "residual [%]", "each move [mm]", "whole [mm]"]
    return table(head, rows)


def phases(found: Emps) -> str:
    """Return amplitude and phase of the ripple, by log and direction."""
    rows = []
    period = found.selection.law.form.period or 1.0
    for name, log in (("DATA_EMPS", found.own), ("DATA_EMPS_PULSES", found.pulses)):
        motion = RowSettings().motion(log)
        for way, sign in (("forward", 1.0), ("backward", -1.0)):
            side = motion.velocity * sign > motion.slow
            form = FrictionForm(stribeck=found.selection.law.form.stribeck, period=period)
            columns = form.columns(motion.position[side], motion.velocity[side])
            fit = fit_rows(
                ("mass", *form.names),
                np.column_stack([motion.acceleration[side], columns]),
                motion.effort[side],
            )
            cosine, sine = fit.values["ripple_cosine_1"], fit.values["ripple_sine_1"]
            rows.append(
                [
                    f"`{name}`",
                    way,
                    f"{1e3 * force_ripple(log).period:.3f}",
                    f"{np.hypot(cosine, sine):.2f}",
                    f"{np.degrees(np.arctan2(sine, cosine)):+.0f}",
                ]
            )
    return table(["log", "way", "period [mm]", "amplitude [N]", "phase [°]"], rows)


def wrist() -> str:
    """Return the friction of the coupled joints beside what was published."""
    folder, schema = data("staubli_tx40"), ROOT / "examples" / "tx40.toml"
    fit = CoupledJoints().fit(read_log(folder, schema, 5), read_log(folder, schema, 6))
    rows = []
    for name, (title, made, published) in TX40.items():
        low, high = fit.ci95[name]
        inside = "yes" if low <= published <= high else "**no**"
        shown = made if "−" not in made[1:] else f"{made} = {published:.3f}"
        rows.append([title, f"{fit.values[name]:.3f}", f"{low:.3f} to {high:.3f}", shown, inside])
    for joint, both in ALONE.items():
        alone = EnergyEstimator().fit(read_log(folder, schema, joint))
        names = ("viscous_friction", "coulomb_friction")
        for name, published in zip(names, both, strict=True):
            interval = alone.parameters[name].ci95
            if interval is None:
                raise RuntimeError(f"{name} of joint {joint} was not found")
            low, high = interval
            kind = name.split("_")[0].replace("coulomb", "Coulomb")
            rows.append(
                [
                    f"{kind}, joint {joint}, alone",
                    f"{alone.value(name):.3f}",
                    f"{low:.3f} to {high:.3f}",
                    f"{published}",
                    "yes" if low <= published <= high else "**no**",
                ]
            )
    head = ["friction [N m s/rad, N m]", "found", "95 % interval", "published", "inside"]
    return table(head, rows)


def law_figure(found: Emps) -> None:
    """Draw friction over speed, its ripple, and the errors of the candidates."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
    law = found.selection.law
    motion = RowSettings(cutoff=60.0).motion(found.own)
    force = motion.effort - law.inertia * motion.acceleration
    shown = slice(motion.settling * 10, None, 5)
    velocity, rest = motion.velocity[shown], np.abs(force[shown])
    for sign, color, way in ((1.0, look.BLUE, "forward"), (-1.0, look.ORANGE, "backward")):
        side = velocity * sign > 0
        left.plot(np.abs(velocity[side]), rest[side], ".", ms=1, alpha=0.15, color=color)
        speed = np.linspace(1e-5, 0.13, 300)
        there = np.zeros_like(speed)
        curve = sign * law.without_ripple().friction(there, sign * speed)
        left.plot(speed, curve, color=color, label=f"{way}, chosen")
        plain = sign * DIRECTIONS.friction(there, sign * speed)
        left.plot(speed, plain, "--", lw=1, color=color, label=f"{way}, published")
    left.set(title="Friction", xlabel="speed [m/s]", ylabel="effort less inertia force [N]")
    left.set(xlim=(0, 0.13), ylim=(0, 58))
    left.legend(loc="lower right", fontsize=8)
    for log, color in ((found.own, look.BLUE), (found.pulses, look.ORANGE)):
        ripple = force_ripple(log)
        name = "own log" if log is found.own else "with pulses"
        middle.plot(ripple.wave_number, ripple.amplitude, lw=0.8, color=color, label=name)
    middle.set(
        title="Force along the way", xlabel="periods in a metre [1/m]", ylabel="amplitude [N]"
    )
    middle.legend()
    scores = found.selection.scores
    for k, score in enumerate(reversed(scores)):
        chosen = score.candidate is found.selection.chosen
        color = look.BLUE if chosen else look.GREEN if score.within else look.GREY
        right.errorbar(score.excess, k, xerr=score.excess_std, fmt="o", ms=3, lw=1, color=color)
    right.set_yticks(range(len(scores)), [score.candidate.name for score in reversed(scores)])
    right.tick_params(axis="y", labelsize=7)
    right.set_xscale("symlog", linthresh=0.5, linscale=1.0)
    right.set_xticks([0, 0.25, 0.5, 1, 2, 5, 10], ["0", "¼", "½", "1", "2", "5", "10"])
    right.set(title="Moves left out", xlabel="squared error over the best one's [N²]")
    right.set_xlim(-0.3, 12)
    look.save(figure, "real-logs-law.png")


def run_figure(found: Emps) -> None:
    """Draw the errors of the free runs."""
    figure, panels = plt.subplots(1, 2, figsize=(10, 3.2), layout="constrained", sharey=True)
    shown = (("published", PUBLISHED, look.GREY), ("per direction", DIRECTIONS, look.ORANGE),
             ("chosen", found.selection.law, look.BLUE))  # fmt: skip
    for axes, log, title in zip(
        panels, (found.own, found.pulses), ("Own log", "With pulses"), strict=True
    ):
        starts = [start for start, _ in find_moves(log)]
        for name, law, color in shown:
            away = 1e3 * (law.free_run(log, starts) - log.measured_position)
            axes.plot(log.time, away, lw=0.8, color=color, label=name)
        axes.set(title=f"{title}, started anew at each move", xlabel="time [s]")
    panels[0].set_ylabel("simulated less measured position [mm]")
    panels[0].legend()
    look.save(figure, "real-logs-free-run.png")


def main() -> None:
    """Make the tables and the figures."""
    look.style()
    found = emps()
    parts = {
        "candidates": candidates(found),
        "values": values(found),
        "compared": compared(found),
        "levels": levels(found),
        "phases": phases(found),
        "wrist": wrist(),
    }
    page = PAGE.read_text(encoding="utf-8")
    for title, text in parts.items():
        page = write(page, title, text)
    PAGE.write_text(page, encoding="utf-8")
    law_figure(found)
    run_figure(found)


if __name__ == "__main__":
    main()
