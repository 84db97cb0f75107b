"""Every kind of result has a page with the same properties."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from pages import MOST_BYTES, Page
from results import make, study

from stickslip.presentation import figures_of, write_report
from stickslip.presentation.results import PAGES, Result
from stickslip.records import (
    ComparedEstimator,
    EstimatorComparison,
    EstimatorStudy,
    Identification,
    Positioning,
)


def compared(identification: Identification) -> EstimatorComparison:
    found = ComparedEstimator(name="energy", estimate=identification.estimate)
    left_out = ComparedEstimator(name="ekf", why_not="the log is too short")
    return EstimatorComparison(
        log=identification.log, compared=(found, left_out), stickslip_version="1"
    )


MADE: dict[type, Callable[[Identification], Result]] = {
    Identification: lambda identification: identification,
    EstimatorComparison: compared,
    EstimatorStudy: lambda _: study(),
    Positioning: lambda _: make(),
}


@pytest.mark.parametrize("kind", PAGES)
def test_a_page_stands_alone_and_draws_all_its_figures(
    kind: type, identification: Identification, tmp_path: Path
) -> None:
    result = MADE[kind](identification)
    path = write_report(result, tmp_path / "page.html")
    assert path.stat().st_size < MOST_BYTES
    page = Page(path)
    names = page.identifiers()
    assert len(names) == len(set(names))
    links = [given["href"] for tag, given in page.tags if tag == "a"]
    assert links
    assert {link.removeprefix("#") for link in links} <= set(names)
    assert not re.search(r"(?:src|href)=.(?:https?:)?//", page.source.split("<script")[0])
    figures = figures_of(result)
    assert set(figures) == set(page.plots()) <= set(names)
    for plot in figures.values():
        plot.to_matplotlib().canvas.draw()
