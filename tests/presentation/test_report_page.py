"""The page holds everything it shows, fetches nothing, and lets no text out of its place."""

import base64
import gzip
import hashlib
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pages import MOST_BYTES, Page, browsed, page_of

from stickslip.presentation import write_report
from stickslip.presentation.page import packed_plotly
from stickslip.records import Identification, Status

FIGURES = (
    "curve-plot",
    "energy-plot",
    "evolution-mass",
    "evolution-coulomb-friction",
    "evolution-viscous-friction",
    "evolution-offset",
    "residual-plot",
    "correlation-plot",
    "motion-plot",
)
MOST_POINTS = 6100  # a closed band of 2 x 2000 points, or a cloud of 3000, with room


def changed(found: Identification, **changes: Any) -> Identification:
    """Return an identification whose estimate, or the diagnostics of which, are others."""
    own = {key: changes[key] for key in changes if hasattr(found.estimate, key)}
    rest = {key: changes[key] for key in changes if key not in own}
    diagnostics = replace(found.estimate.diagnostics, **rest)
    return replace(found, estimate=replace(found.estimate, diagnostics=diagnostics, **own))


def test_axes_are_labelled_with_the_units_of_the_axis_kind(identification: Identification) -> None:
    plots = page_of(identification).plots()
    assert tuple(plots) == FIGURES
    assert plots["curve-plot"]["layout"]["xaxis"]["title"]["text"] == "velocity <i>v</i> [m/s]"
    log = replace(identification.log, kind="rotary")
    rotary = replace(changed(identification, kind="rotary"), log=log)
    plots = page_of(rotary).plots()
    for plot in plots.values():
        for key, axis in plot["layout"].items():
            if key.startswith(("xaxis", "yaxis")):
                assert re.search(
                    r"\[(rad|rad/s|N m|N m s/rad|kg m²|J|s|-)\]$", axis["title"]["text"]
                )


def test_names_cannot_become_part_of_the_page(make: Callable[..., Identification]) -> None:
    nasty = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&"
    good = make(name=nasty)
    provenance = replace(
        good.estimate.provenance, files=(nasty,), assumptions=(nasty,), options={nasty: nasty}
    )
    page = page_of(changed(good, notes=(nasty,), provenance=provenance))
    assert page.text.count(nasty) == 7  # title, heading, note, file, assumption, option and value
    assert not [tag for tag, _ in page.tags if tag == "img"]
    assert sum(tag == "script" for tag, _ in page.tags) == 3


def test_the_table_shows_values_intervals_truth_and_verdicts(
    identification: Identification,
) -> None:
    text = page_of(identification).text
    for words in ("Mass m", "2.005", "1.981 to 2.028", "kg", "+0.24%", "✓ identified"):
        assert words in text
    assert "−0.1984" in text


def test_without_truth_no_true_value_is_claimed(make: Callable[..., Identification]) -> None:
    page = page_of(make(with_truth=False))
    assert "true value" not in page.text.lower()
    assert all(
        trace["name"] != "true value" for plot in page.plots().values() for trace in plot["data"]
    )


def test_an_estimate_that_failed_says_so_first_and_draws_what_was_recorded(
    doubtful: Identification,
) -> None:
    page = page_of(doubtful)
    (recorded,) = page.plots().values()
    log = doubtful.log
    assert log.measured_velocity is not None
    signals = (log.measured_position, log.measured_velocity, log.effort)
    for trace, values in zip(recorded["data"], signals, strict=True):
        np.testing.assert_allclose(trace["x"], log.time, rtol=1e-6)
        np.testing.assert_allclose(trace["y"], values, rtol=1e-6)
    units = ("[m]", "[m/s]", "[N]")
    for key, unit in zip(("yaxis", "yaxis2", "yaxis3"), units, strict=True):
        assert recorded["layout"][key]["title"]["text"].endswith(unit)
    assert page.text.index("Not enough motion") < page.text.index("Parameters")
    assert page.text.count("✗ not identified: the axis does not move <at all>") == 4
    assert "Not drawn" in page.text


def test_reasons_and_notes_are_said_in_words(doubtful: Identification) -> None:
    verdicts = tuple(
        replace(each, reason="it looks like coulomb_friction_negative")
        for each in doubtful.estimate.diagnostics.verdicts
    )
    noted = changed(doubtful, verdicts=verdicts, notes=("viscous_friction was hard",))
    text = page_of(noted).text
    assert "not identified: it looks like Coulomb friction (backward)" in text
    assert "viscous friction was hard" in text
    assert "coulomb_friction" not in text


def test_a_value_that_cannot_be_is_not_called_identified(identification: Identification) -> None:
    parameters = dict(identification.estimate.parameters)
    parameters["mass"] = replace(parameters["mass"], value=-2.0, ci95=(-2.1, -1.9))
    negative = changed(identification, parameters=parameters, status=Status.UNPHYSICAL)
    text = page_of(negative).text
    assert "✓ identified" not in text
    assert text.count("not to be used") == 3
    assert text.count("unphysical: it cannot be negative") == 1


@pytest.mark.parametrize("status", list(Status))
def test_a_page_of_every_status_is_headed_by_its_word(
    status: Status, identification: Identification
) -> None:
    text = page_of(changed(identification, status=status)).text
    assert status.word in text
    assert status.text in text


def test_without_an_offset_none_is_spoken_of(identification: Identification) -> None:
    parameters = dict(identification.estimate.parameters)
    curve = "curve-plot"
    with_it = page_of(identification).plots()[curve]
    assert with_it["data"][-1]["name"] == "fitted law with offset"
    del parameters["offset"]
    evolution = replace(
        identification.evolution,
        values={key: identification.evolution.values[key] for key in parameters},
        stds={key: identification.evolution.stds[key] for key in parameters},
    )
    without = replace(changed(identification, parameters=parameters), evolution=evolution)
    plot = page_of(without).plots()[curve]
    assert plot["data"][-1]["name"] == "fitted law"
    assert plot["layout"]["yaxis"]["title"]["text"] == "friction [N]"


def test_the_evolution_ends_at_the_interval_of_the_table(identification: Identification) -> None:
    wide = 2.5  # standard deviations, as of Student's t with few degrees of freedom
    parameters = {
        key: replace(each, ci95=(each.value - wide * each.std, each.value + wide * each.std))
        for key, each in identification.estimate.parameters.items()
        if each.value is not None and each.std is not None
    }
    stds = {
        key: np.full_like(each, parameters[key].std)
        for key, each in identification.evolution.stds.items()
    }
    evolution = replace(identification.evolution, stds=stds)
    found = replace(changed(identification, parameters=parameters), evolution=evolution)
    plots = page_of(found).plots()
    for key, parameter in parameters.items():
        band = plots[f"evolution-{key.replace('_', '-')}"]["data"][0]
        last = max(band["x"])
        ends = [y for x, y in zip(band["x"], band["y"], strict=True) if x == last]
        width = parameter.ci95[1] - parameter.ci95[0]
        assert max(ends) - min(ends) == pytest.approx(width, rel=1e-4)


def test_small_jitter_keeps_its_digits(identification: Identification) -> None:
    time = identification.log.time.copy()
    time[5] += 2.4e-5 * identification.log.sampling_time
    log = replace(identification.log, time=time)
    text = page_of(replace(identification, log=log)).text
    assert "jitter at most 0.0024 % of it" in text


def test_figures_of_merit_that_do_not_exist_are_said_in_words(doubtful: Identification) -> None:
    bare = changed(doubtful, relative_residual=float("nan"), condition_number=float("inf"))
    text = page_of(bare).text
    assert "Unexplainednot available" in text
    assert "Condition numberinfinite" in text


def test_large_logs_are_thinned_for_drawing_and_keep_their_extremes(
    make: Callable[..., Identification], tmp_path: Path
) -> None:
    large = make(samples=300_000)
    path = write_report(large, tmp_path / "large.html")
    assert path.stat().st_size < MOST_BYTES
    page = Page(path)
    plots = page.plots()
    for plot in plots.values():
        assert all(len(trace["x"]) <= MOST_POINTS for trace in plot["data"])
    drawn = plots["residual-plot"]["data"][0]["y"]
    assert max(drawn) == pytest.approx(large.residuals.residual.max(), rel=1e-6)
    assert min(drawn) == pytest.approx(large.residuals.residual.min(), rel=1e-6)
    assert "of 300000 points is drawn" in page.text


def test_nan_in_a_figure_becomes_a_gap(identification: Identification) -> None:
    values = {key: each.copy() for key, each in identification.evolution.values.items()}
    values["mass"][:100] = np.nan
    evolution = replace(identification.evolution, values=values)
    plots = page_of(replace(identification, evolution=evolution)).plots()
    estimate = next(t for t in plots["evolution-mass"]["data"] if t["name"] == "estimate")
    assert estimate["y"][:100] == [None] * 100
    assert None not in estimate["y"][100:]


def test_plotly_is_the_bundle_whose_version_is_stated() -> None:
    """The hash is that of the file in the npm package."""
    text = gzip.decompress(base64.b64decode(packed_plotly()))
    assert text.startswith(b"/**\n* plotly.js (basic - minified) v4.1.1")
    digest = "99784e3abfb07b142a15e521a439e6d9addceadb3f79553fd24c72774f0649ba"
    assert hashlib.sha256(text).hexdigest() == digest


def test_a_browser_draws_every_figure_without_a_complaint(
    identification: Identification, tmp_path: Path
) -> None:
    page = write_report(identification, tmp_path / "report.html")
    document = browsed(page, "--virtual-time-budget=5000")
    drawn = re.findall(r'class="plot js-plotly-plot" id="([\w-]+)"', document)
    assert sorted(drawn) == sorted(FIGURES)
    assert document.count('class="main-svg"') >= len(FIGURES)
