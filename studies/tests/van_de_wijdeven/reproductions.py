"""Finished reproductions made from closed forms, and checks of the files of any reproduction."""

import json
import struct

import numpy as np

from studies.van_de_wijdeven import Reproduced
from studies.van_de_wijdeven.records import (
    CarriedRuns,
    Claim,
    ConjunctionReproduction,
    ControllerScore,
    Curve,
    EnergyReproduction,
    FiveRuns,
    FrictionErrorEffect,
    LandingScore,
    Measure,
    Panel,
    PrintedNumber,
    PulseReproduction,
    ReferenceSeries,
    ReproducedFigure,
    ResolutionScore,
    Spread,
    SuccessiveSeries,
    VariantScore,
)

NAMES = ("coulomb_friction", "viscous_friction")


def energy_figure(number: str = "6.1", *, columns: int = 1, rows: int = 2) -> ReproducedFigure:
    x = np.linspace(0.0, 10.0, 101)
    panel = Panel(
        title="a panel",
        x_label="time [s]",
        y_label="error e_y [J]",
        curves=(
            Curve(label="estimate", role="first", x=x, y=np.sin(x)),
            Curve(label="truth", role="truth", x=x[[0, -1]], y=np.zeros(2)),
        ),
    )
    return ReproducedFigure(
        number=number,
        title="An error <b>",
        caption="Of W_c & others.",
        columns=columns,
        panels=(panel,) * (rows * columns),
    )


def energy_claim(*, agrees: bool) -> Claim:
    return Claim(
        name="mean",
        place="Eq. 5.5",
        statement="Noise <i>has</i> no effect on σ_v1².",
        measures=(
            Measure(
                case="",
                quantity="mean",
                unit="J",
                value=-0.4,
                low=-0.5 if agrees else 0.0,
                high=0.5,
            ),
        ),
        why="E{u v} = −K_d σ_v²",
    )


def variant_score(loop: str, noise: float, *, sure: bool) -> VariantScore:
    return VariantScore(
        loop="feedforward" if loop == "feedforward" else "feedback",
        variant="robust" if sure else "printed",
        noise=noise,
        assumed=None if sure else 0.5,
        runs=20,
        failed=0,
        bias=dict(zip(NAMES, (-0.0123, 1.5), strict=True)),
        rmse=dict(zip(NAMES, (0.0234, np.nan if sure else 1.6), strict=True)),
        coverage=dict(zip(NAMES, (0.95, 1.0), strict=True)) if sure else None,
    )


def energy_reproduction() -> EnergyReproduction:
    return EnergyReproduction(
        title="A part",
        setting="With <surrogate> values.",
        values={"truth": {"coulomb_friction": (0.15, "N")}},
        figures=(energy_figure(), energy_figure("6.3", columns=2)),
        five_runs=tuple(
            FiveRuns(
                loop=loop,
                case="without noise",
                values={name: np.array([0.1, -0.2]) for name in NAMES},
                itse=np.array([1.0, 12345.6]),
            )
            for loop in ("feedforward", "feedback")
        ),
        variants=tuple(
            variant_score(loop, noise, sure=sure)
            for loop in ("feedforward", "feedback")
            for noise in (0.5, 1.0)
            for sure in (False, True)
        ),
        claims=(energy_claim(agrees=True), energy_claim(agrees=False), energy_claim(agrees=False)),
        options={"runs": 20, "seed": 1},
        stickslip_version="1.2.3",
    )


def pulse_claim(**verdicts: bool) -> Claim:
    return Claim(
        name="below",
        place="4, Fig. 6",
        statement=f"b̂ and Â_2 are below t_p,max: {len(verdicts)}.",
        measures=tuple(
            Measure(case=f"<{case}>", quantity="pulses", unit="1", value=float(agrees), low=1.0)
            for case, agrees in verdicts.items()
        ),
        why="As f_c is.",
    )


def pulse_panel(*, staircase: bool = False, lines: int = 2) -> Panel:
    x = np.arange(5.0)
    roles = ("first", "second")
    return Panel(
        title="a panel",
        x_label="time [s]",
        y_label="f_p [N]",
        curves=tuple(
            Curve(label=role, role=role, x=x, y=(-1.0) ** x * (k + 1), staircase=staircase)
            for k, role in enumerate(roles[:lines])
        ),
    )


def pulse_figure(number: str, *panels: Panel, columns: int = 2) -> ReproducedFigure:
    return ReproducedFigure(
        number=number, title="b̂ at t_p,max", caption="Of f̂_c.", columns=columns, panels=panels
    )


def sketch() -> ReproducedFigure:
    return ReproducedFigure(
        number="2",
        title="Model",
        caption="A mass.",
        columns=1,
        panels=(),
        sketch="mass with friction",
    )


def pulse_reproduction() -> PulseReproduction:
    return PulseReproduction(
        title="Part B",
        setting="With Table 1.",
        values={
            "table_1": {
                "mass": (150.0, "kg"),
                "viscous_friction": (700.0, "N s/m"),
                "pulse_effort": (300.0, "N"),
            },
            "runs": {"duration": (2.0, "s")},
        },
        figures=(pulse_figure("1", pulse_panel()), sketch()),
        claims=(
            pulse_claim(one=True, other=True),
            pulse_claim(one=True, other=False, third=False),
            pulse_claim(one=False),
        ),
        printed_numbers=tuple(
            PrintedNumber(
                place="3.1", quantity="t_p", printed=shown, value=0.07071, unit=unit, how="Eq. 4"
            )
            for shown, unit in (("0.071", "s"), ("0.070", "1"))
        ),
        carried_runs=tuple(
            CarriedRuns(
                controller=controller,
                reading="u_p as printed",
                longest_pulse=longest,
                final_error=np.array([2.5e-6, -1.234567e-3]),
                reached=np.array([True, False]),
                time=np.array([0.41, np.nan]),
                pulses=np.array([4, 84]),
                reversed_pulses=np.array([0, 41]),
                estimates={
                    "pulse_gain": np.array([1.909, 1.301]),
                    **(
                        {"coulomb_friction": np.array([103.1, 130.4])}
                        if controller == "PAPWC"
                        else {}
                    ),
                },
            )
            for controller in ("PWC", "PAPWC")
            for longest in (None, 0.03)
        ),
        controller_scores=(
            ControllerScore(
                controller="PWC, t_p ≤ 1",
                axes=30,
                within_tolerance=0.8333,
                hunting=0.1667,
                median_error=1.27e-5,
                error_95=4.2e-4,
                worst_error=7.5181e-3,
                median_time=None,
                median_pulses=None,
                peak_effort=1.0,
            ),
        ),
        how_compared="By <hand>.",
        resolution_scores=(
            ResolutionScore(
                encoder_step=1e-8,
                static_ratio=1.3,
                friction_change=0.01,
                sampling_time=1e-3,
                axes=40,
                smallest_step=1.3e-7,
                median_error=5.8e-9,
                error_95=1.6e-8,
                within_a_step=0.82,
                median_pulses=7.0,
                still_moving=0,
            ),
        ),
        options={"axes": 30, "seed": 1},
        stickslip_version="1.2.3",
    )


def landing_score(controller: str, case: str, *, lands: bool) -> LandingScore:
    spread = Spread(median=2e-7, upper_95=4e-7, worst=5e-7)
    return LandingScore(
        controller=controller,
        case=case,
        arms=3,
        moves=6,
        landed=1.0 if lands else 0.0,
        landed_in_four=1.0 if lands else None,
        error_1=spread,
        error_2=spread,
        swing=spread,
        time_ratio=Spread(median=6.0, upper_95=7.5, worst=8.0) if lands else None,
        series=Spread(median=2.0, upper_95=3.0, worst=3.0) if lands else None,
        misjudged=0.0 if lands else None,
        farthest=0.3,
        peak_effort=0.987,
    )


def conjunction_reproduction() -> ConjunctionReproduction:
    return ConjunctionReproduction(
        title="The arm <lands>",
        setting="Surrogate values.",
        values={},
        figures=(),
        claims=(
            Claim(
                name="landing",
                place="Concluding remarks",
                statement="It lands.",
                measures=(Measure(case="", quantity="error", unit="m", value=0.0, high=1.0),),
                why="learning",
            ),
        ),
        reference_series=(
            ReferenceSeries(
                pulse_width=0.5,
                pulses=10,
                expected_duration=5.0,
                duration=5.5,
                impulse=1.25,
                peak_effort=0.75,
                residual=2e-15,
            ),
        ),
        friction_errors=(
            FrictionErrorEffect(
                friction_error=-0.01,
                expected_error=0.0049,
                expected_swing=0.002,
                error=0.00487,
                swing=0.00199,
            ),
        ),
        successive_series=(
            SuccessiveSeries(
                friction_error=0.05,
                learning=True,
                error=np.array([0.025, -2e-6, 1e-9]),
                swing=np.array([0.01, 1e-6, 3e-9]),
            ),
            SuccessiveSeries(
                friction_error=-0.05, learning=False, error=np.array([0.5]), swing=np.array([0.6])
            ),
        ),
        landing_scores=(
            landing_score("landing", "no noise", lands=True),
            landing_score("PID <fast>", "no noise", lands=False),
        ),
        how_compared="All know the same parameters.",
        options={"arms": 3, "seed": 1},
        stickslip_version="0.1.0",
    )


def check_files(reproduced: Reproduced, figures: list[str]) -> None:
    """Check that page, numbers and one picture a figure are in the folder, and nothing else."""
    names = {f"figure-{number}.png" for number in figures}
    names |= {reproduced.page.name, reproduced.numbers.name}
    assert {path.name for path in reproduced.page.parent.iterdir()} == names
    for path in reproduced.pictures:
        data = path.read_bytes()
        assert data[:8] == b"\x89PNG\r\n\x1a\n"
        width, height = struct.unpack(">II", data[16:24])
        assert width > 1000
        assert height > 400


def check_numbers(reproduced: Reproduced, figures: list[str], options: dict[str, int]) -> None:
    """Check what every document of numbers says, and that its legend is about its own keys."""
    found = json.loads(reproduced.numbers.read_text())
    assert found["schema"] == 2
    assert found["provenance"]["options"] == options
    assert [each["number"] for each in found["figures"]] == figures
    claims = reproduced.reproduction.claims
    assert [each["verdict"] for each in found["claims"]] == [each.verdict for each in claims]
    for path in set(found["legend"]) - {"loop"}:
        place = found
        for key in path.split("."):
            place = (place[0] if isinstance(place, list) else place)[key]
