"""Make the figures of the conjunction: ``python -m studies.documentation.conjunction_figures``.

They are figures C.1, C.3 and C.5 of ``python -m studies.van_de_wijdeven conjunction``.
"""

from rich.progress import Progress

from studies.documentation.style import FIGURES, no_arguments
from studies.van_de_wijdeven.conjunction.figures import conjunction_figures
from studies.van_de_wijdeven.conjunction.landings import LANDING_PIECES, gather_landings
from studies.van_de_wijdeven.conjunction.series import SERIES_PIECES, gather_series
from studies.van_de_wijdeven.page import picture

SEED = 1
SHOWN = {
    "C.1": "conjunction-landing.png",
    "C.3": "conjunction-series.png",
    "C.5": "conjunction-learning.png",
}


def main() -> None:
    """Make every figure."""
    with Progress() as bar:
        task = bar.add_task("series and landings", total=SERIES_PIECES + LANDING_PIECES)
        series = gather_series(lambda: bar.advance(task))
        landings = gather_landings(SEED, lambda: bar.advance(task))
    folder = FIGURES
    for figure in conjunction_figures(landings, series):
        if figure.number in SHOWN:
            (folder / SHOWN[figure.number]).write_bytes(picture(figure))


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
