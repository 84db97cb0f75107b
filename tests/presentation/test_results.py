"""Every kind of result has a page with the same properties."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from pages import MOST_BYTES, Page
from refusals import refuses
from results import make, make_landing, study

from stickslip.presentation import figures_of, write_report
from stickslip.presentation.results import PAGES, Result
from stickslip.records import (
    AxesIdentification,
    ComparedEstimator,
    EstimatorComparison,
    EstimatorStudy,
    Identification,
    Positioning,
)

ADDRESSES = frozenset(
    ("src", "href", "action", "data", "poster", "srcset", "background", "cite", "formaction")
)


def compared(identification: Identification) -> EstimatorComparison:
    found = ComparedEstimator(name="energy", estimate=identification.estimate)
    left_out = ComparedEstimator(name="ekf", why_not="the log is too short")
    return EstimatorComparison(
        log=identification.log, compared=(found, left_out), stickslip_version="1"
    )


MADE: dict[str, Callable[[Identification], Result]] = {
    "identification": lambda identification: identification,
    "axes": lambda identification: AxesIdentification(
        name="robot",
        axes={"a": identification, "b <1>": identification},
        unread={"c": "no column is obviously the effort"},
    ),
    "comparison": compared,
    "study": lambda _: study(),
    "positioning": lambda _: make(),
    "landing": lambda _: make_landing(),
}
KINDS = {Identification, AxesIdentification, EstimatorComparison, EstimatorStudy, Positioning}


@pytest.fixture(params=MADE)
def result(request: pytest.FixtureRequest, identification: Identification) -> Result:
    return MADE[request.param](identification)


def test_every_kind_of_result_is_tested() -> None:
    assert set(PAGES) == KINDS


def test_a_page_stands_alone(result: Result, tmp_path: Path) -> None:
    path = write_report(result, tmp_path / "page.html")
    assert path.stat().st_size < MOST_BYTES
    page = Page(path)
    names = page.identifiers()
    assert len(names) == len(set(names))
    assert any(tag == "a" for tag, _ in page.tags)
    for tag, given in page.tags:
        assert tag not in {"link", "iframe", "object", "embed", "base", "img", "b"}
        for address in ADDRESSES:
            assert given.get(address, "#").startswith("#"), (tag, given)
        assert "url(" not in given.get("style", "")
        assert not any(name.startswith("on") for name in given), "inline handlers"
        if tag == "a":
            assert given["href"].removeprefix("#") in names
    assert "url(" not in page.styles
    assert "@import" not in page.styles
    policy = next(given["content"] for _, given in page.tags if "http-equiv" in given)
    assert policy.startswith("default-src 'none';")
    assert "http" not in policy
    assert write_report(result, tmp_path / "again.html").read_bytes() == path.read_bytes()


def test_every_figure_is_on_the_page_with_words_and_units(result: Result, tmp_path: Path) -> None:
    page = Page(write_report(result, tmp_path / "page.html"))
    plots, figures = page.plots(), figures_of(result)
    drawn = {given["id"]: given for _, given in page.tags if given.get("class") == "plot"}
    assert set(figures) == set(plots) == set(drawn)
    assert all(len(given["aria-label"]) > 20 for given in drawn.values())
    for plot in plots.values():
        assert all(len(trace["x"]) == len(trace["y"]) for trace in plot["data"])
        for key, axis in plot["layout"].items():
            if key.startswith(("xaxis", "yaxis")) and axis.get("type") != "category":
                assert re.search(r"\[[^\]]+\]$", axis["title"]["text"]), axis["title"]
    for plot in figures.values():
        plot.to_matplotlib().canvas.draw()


def test_a_subclass_of_a_result_has_its_page(identification: Identification) -> None:
    class Annotated(Identification):
        pass

    own = Annotated(**vars(identification))
    assert set(figures_of(own)) == set(figures_of(identification))


@pytest.mark.parametrize("place", ["missing/report.html", ""])
def test_a_page_that_cannot_be_written_leaves_nothing(place: str, tmp_path: Path) -> None:
    with refuses("output_without_folder" if place else "output_is_folder", what="the report"):
        write_report(make(), tmp_path / place)
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_page_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(_: object) -> str:
        raise KeyboardInterrupt

    target = tmp_path / "report.html"
    target.write_text("old")
    monkeypatch.setattr("stickslip.presentation.page.rendered", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_report(make(), target)
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    assert target.read_text() == "old"


@pytest.mark.usefixtures("without_shape_checks")
def test_what_is_no_result_has_no_page(tmp_path: Path) -> None:
    with refuses("wrong_type", name="result", found="NoneType"):
        write_report(None, tmp_path / "report.html")  # pyright: ignore[reportArgumentType]
