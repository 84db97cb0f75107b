"""Part B of the source, whole: computed, judged, and put together."""

from functools import partial
from pathlib import Path

from stickslip import __version__
from stickslip.records import whole
from studies.van_de_wijdeven.part_b.setting import SETTING, setting_values
from studies.van_de_wijdeven.records import PulseReproduction
from studies.van_de_wijdeven.writing import Progress, Reproduced, counted, write_reproduction

_FEWEST_AXES = 25
_STARTS = 40  # of each case of the study of resolution


def reproduce_part_b(
    folder: Path | str,
    *,
    axes: int = 400,
    seed: int = 1,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reproduced:
    """Reproduce part B of the source: figures, Table 1, numbers, and claims beside measurements.

    Beyond the source, controllers are put beside each other on random axes. Writes ``part-b.html``,
    ``part-b.json`` and a PNG file for each of Figures 1 to 9 into the folder, all of them or none.

    ``axes`` is on how many random axes each controller is tried, and ``seed`` of these axes and of
    their noise; the figures and claims do not depend on them. All else as `reproduce_part_a`.
    """
    whole("axes", axes, least=_FEWEST_AXES)
    return write_reproduction(
        folder, "part-b", partial(_computed, axes), seed=seed, workers=workers, progress=progress
    )


def _computed(axes: int, seed: int, workers: int, progress: Progress) -> PulseReproduction:
    # Imported here, as the compiler behind them takes a second to load.
    from studies.van_de_wijdeven.part_b.cases import CASES
    from studies.van_de_wijdeven.part_b.claims import part_b_claims
    from studies.van_de_wijdeven.part_b.contenders import HOW_TUNED
    from studies.van_de_wijdeven.part_b.evidence import PIECES, gather
    from studies.van_de_wijdeven.part_b.figures import part_b_figures
    from studies.van_de_wijdeven.part_b.numbers import printed_numbers
    from studies.van_de_wijdeven.part_b.resolution import resolution_pieces, resolution_scores
    from studies.van_de_wijdeven.part_b.runs import carried
    from studies.van_de_wijdeven.part_b.study import controller_scores, pieces

    every = PIECES + pieces(axes) + resolution_pieces()
    advance = counted(progress, every)

    evidence = gather(advance)
    return PulseReproduction(
        title="Adaptive pulse amplitude pulse width control",
        setting=f"{SETTING}.",
        values=setting_values(),
        figures=part_b_figures(evidence),
        claims=part_b_claims(evidence),
        printed_numbers=printed_numbers(evidence.law),
        carried_runs=tuple(
            carried(
                evidence.series[case.key],
                controller=case.controller,
                reading=case.reading,
                longest_pulse=case.longest_width,
            )
            for case in CASES
        ),
        controller_scores=controller_scores(axes, seed, workers=workers, advance=advance),
        how_compared=HOW_TUNED,
        resolution_scores=resolution_scores(_STARTS, seed, workers=workers, advance=advance),
        options={"axes": axes, "seed": seed},
        stickslip_version=__version__,
    )
