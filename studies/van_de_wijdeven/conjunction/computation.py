"""The conjunction of the source, whole: computed, judged, and put together."""

from functools import partial
from pathlib import Path

from stickslip import __version__
from stickslip.records import whole
from studies.van_de_wijdeven.records import ConjunctionReproduction
from studies.van_de_wijdeven.writing import Progress, Reproduced, counted, write_reproduction


def reproduce_conjunction(
    folder: Path | str,
    *,
    arms: int = 2,
    seed: int = 1,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reproduced:
    """Work out what the source's concluding remarks sketch, and judge what they say.

    A flexible arm is landed at rest with friction that it learns on the way; series of pulses are
    planned and put beside known durations; and the landing controller is compared with others on
    random arms. Writes ``conjunction.html``, ``conjunction.json`` and a PNG file for each of five
    figures into the folder, all of them or none.

    ``arms`` is on how many random arms each controller is tried, and ``seed`` of these arms and of
    all noise; the figures and claims do not depend on ``arms``. All else as `reproduce_part_a`.
    """
    whole("arms", arms, least=1)
    return write_reproduction(
        folder,
        "conjunction",
        partial(_computed, arms),
        seed=seed,
        workers=workers,
        progress=progress,
    )


def _computed(arms: int, seed: int, workers: int, progress: Progress) -> ConjunctionReproduction:
    # Imported here, as the compiler behind them takes a second to load.
    from studies.van_de_wijdeven.conjunction.cases import EXACT, NOISY
    from studies.van_de_wijdeven.conjunction.claims import CONJUNCTION_CLAIMS, Evidence
    from studies.van_de_wijdeven.conjunction.contenders import HOW_COMPARED
    from studies.van_de_wijdeven.conjunction.figures import conjunction_figures
    from studies.van_de_wijdeven.conjunction.landings import LANDING_PIECES, gather_landings
    from studies.van_de_wijdeven.conjunction.series import SERIES_PIECES, gather_series
    from studies.van_de_wijdeven.conjunction.setting import SETTING, setting_values
    from studies.van_de_wijdeven.conjunction.study import landing_scores
    from studies.van_de_wijdeven.judging import judged

    cases = (EXACT, NOISY)
    every = SERIES_PIECES + LANDING_PIECES + arms
    advance = counted(progress, every)

    series = gather_series(advance)
    landings = gather_landings(seed, advance)
    return ConjunctionReproduction(
        title="A flexible arm lands at rest, with friction learned on the way",
        setting=f"{SETTING}.",
        values=setting_values(),
        figures=conjunction_figures(landings, series),
        claims=tuple(judged(row, Evidence(landings, series)) for row in CONJUNCTION_CLAIMS),
        reference_series=tuple(each.numbers for each in series.planned),
        friction_errors=series.effects,
        successive_series=series.successive,
        landing_scores=landing_scores(arms, seed, cases=cases, workers=workers, advance=advance),
        how_compared=HOW_COMPARED,
        options={"arms": arms, "seed": seed},
        stickslip_version=__version__,
    )
