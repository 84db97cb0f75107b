"""Make the documentation's figures of the conjunction: ``python docs/make_conjunction_figures.py``.

They are figures C.1, C.3 and C.5 of ``stickslip reproduce conjunction``.
"""

from pathlib import Path

from rich.progress import Progress

from stickslip.jobs.reproduce.conjunction.figures import conjunction_figures
from stickslip.jobs.reproduce.conjunction.landings import LANDING_PIECES, gather_landings
from stickslip.jobs.reproduce.conjunction.series import SERIES_PIECES, gather_series
from stickslip.report import picture

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
    folder = Path(__file__).parent / "figures"
    for figure in conjunction_figures(landings, series):
        if figure.number in SHOWN:
            (folder / SHOWN[figure.number]).write_bytes(picture(figure))


if __name__ == "__main__":
    main()
