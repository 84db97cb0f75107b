"""Estimators side by side, on a log or over a scenario, as tables, figures and a page."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from stickslip.presentation import drawing as draw
from stickslip.presentation.drawing import Look, Plot, Trace, axis, layout, line, quantity_axis
from stickslip.presentation.page import (
    Block,
    Fold,
    Grid,
    Heading,
    Listed,
    Page,
    Section,
    Text,
    Verdict,
    headed_list,
    scenario_blocks,
)
from stickslip.presentation.table import Cell, Column, Table
from stickslip.presentation.words import (
    NONE,
    assumed_units,
    missing_parameters,
    or_none,
    prefixed,
    printed_unit,
    ratio_text,
    value_with_half,
)
from stickslip.records import (
    AxisKind,
    ComparedEstimator,
    EstimatorComparison,
    EstimatorScore,
    EstimatorStudy,
    count_of,
    in_words,
    mass_name,
    parameter_label,
    share_text,
    unit_text,
)

_NO_BREAK = "\N{NO-BREAK SPACE}"
_WIDEST_NAME, _WIDEST_NUMBER = 22, 9  # characters, so that tables on a terminal stand in line

_ROW = 26  # px an estimator
_FRAME = 90  # px around them
_MARGIN = 0.15  # of the range drawn, on either side
_FAR = 4.0  # widths of the middle half of the values beyond which one is stated and not drawn

_LEGEND = (
    "Values with half of their 95 % interval. Effort left: norm of effort "
    "less inertia force and friction over norm of the effort, smoothed and decimated alike for "
    "every estimator. Position explained: 1 less the norm of simulated less measured position "
    "over that of the measured one less its mean, the identified axis being driven by the "
    "logged effort and restarted from the measured motion twenty times. A sample: time of a "
    "whole fit over the samples of the log."
)


def comparison_page(found: EstimatorComparison) -> Page:
    """Return the page of estimators side by side on a log."""
    log, applied = found.log, found.applied
    lead = (
        "Each parameter as every estimator found it, with its 95 % interval where the method "
        "gives one. Intervals that do not overlap show that a method is biased on such a log, or "
        "that its intervals are too narrow."
    )
    sections = [
        Section("estimates", "Estimates", _estimates(found)),
        Section(
            "intervals",
            "Side by side",
            [Text(lead, "lead"), Grid(estimate_plots(found), shared=False)],
        ),
    ]
    motions = motion_plots(found)
    if motions:
        lead = (
            "Each identified axis is driven by the logged effort, and restarts from the measured "
            "motion twenty times. Shown is the simulated position less the measured one, "
            "all at one scale."
        )
        blocks = [Text(lead, "lead"), Grid(motions, shared=False)]
        sections.append(Section("motion", "What each misses of the motion", blocks))
    good = sum(
        each.estimate is not None and each.estimate.status.trusted for each in found.compared
    )
    verdict = (
        f"{count_of(len(applied), 'estimator')} of {len(found.compared)} "
        f"{'applies' if len(applied) == 1 else 'apply'} to this log; {good} "
        f"{'gives' if good == 1 else 'give'} an estimate that can be trusted."
        + " Some of these contradict each other."
        * bool(found.contradictions)
    )
    notes = Section("notes", "Notes and provenance", _log_provenance(found))
    return _page(found, log.name, f"{log.kind} axis", verdict, [*sections, notes])


def study_page(study: EstimatorStudy) -> Page:
    """Return the page of estimators over the runs of a scenario."""
    lead = (
        "Mean error of each estimator over the runs, with their standard deviation on either "
        "side; orange where it is biased by more than three standard errors."
    )
    scores: list[Block] = [*score_tables(study)]
    if any(each.assumes_inertia for each in study.applied):
        scores.append(Text(f"{assumed_inertia(study)}.", "reason"))
    sections = [
        Section("scores", "How near to the truth", scores),
        Section(
            "errors", "Side by side", [Text(lead, "lead"), Grid(score_plots(study), shared=False)]
        ),
    ]
    verdict = (
        f"{count_of(len(study.applied), 'estimator')} of {len(study.scores)} over "
        f"{count_of(study.runs, 'run')} of {study.samples} samples, whose truth is known."
    )
    provenance = scenario_blocks(study.scenario, study.file, study.sha256)
    blocks = [Listed(study.notes), *provenance] if study.notes else provenance
    notes = Section("notes", "Scenario, notes and provenance", blocks)
    kicker = f"Monte Carlo, {study.kind} axis"
    return _page(study, study.name, kicker, verdict, [*sections, notes])


def _page(
    found: EstimatorComparison | EstimatorStudy,
    name: str,
    kicker: str,
    verdict: str,
    sections: Sequence[Section],
) -> Page:
    """Return the page; the reasons of those that do not apply stand before the last section."""
    word = "Compared" if found.trusted else "None of the estimates can be trusted"
    reasons = reasons_against(found)
    left_out = [Section("left-out", "Does not apply", [Listed(reasons)])] if reasons else []
    return Page(
        title=f"Estimators on {name}",
        kicker=f"estimators compared · {kicker}",
        name=name,
        verdict=Verdict(found.trusted, word, verdict),
        sections=[*sections[:-1], *left_out, sections[-1]],
        version=found.stickslip_version,
    )


def estimate_table(found: EstimatorComparison) -> Table:
    """Return the result of each estimator on a log, a row each."""
    kind = found.log.kind
    applied = [(each, each.estimate) for each in found.applied if each.estimate is not None]
    columns = [Column("Estimator", "left"), Column("Status", "left")]
    for name in found.parameters:
        label, unit = parameter_label(name, kind), f"[{unit_text(found.log.unit(name))}]"
        stacked = "\n".join([*label.split(), unit])
        columns.append(Column(f"{label} {unit.replace(' ', _NO_BREAK)}", short=stacked))
    left = any(each.unexplained_effort is not None for each, _ in applied)
    columns += [
        Column("Effort left", short="effort\nleft", only="" if left else "page"),
        Column("Position explained", only="page"),
        Column("A sample", short="a\nsample"),
    ]
    rows: list[list[str | Cell]] = []
    for each, estimate in applied:
        again, alone = each.resimulation, each.name in found.alone
        good = estimate.status.trusted and not alone
        status = estimate.status.value.replace("_", " ") + ", alone" * alone
        rows.append(
            [
                each.name,
                Cell(status, "good" if good else "bad"),
                *(_value(each, name) for name in found.parameters),
                or_none(each.unexplained_effort, share_text),
                NONE if again is None else f"{again.fit:.2%}",
                _seconds(each.seconds_per_sample),
            ]
        )
    return Table(columns=columns, rows=rows, what="estimators")


def _value(each: ComparedEstimator, name: str) -> str:
    """Return the value of a parameter with half of its interval; a star for one that was given."""
    parameter = None if each.estimate is None else each.estimate.parameters.get(name)
    if parameter is None or parameter.value is None:
        given = name in {"mass", "inertia"} and each.assumed_inertia is not None
        return "*" if given else NONE
    return value_with_half(parameter)


def _estimates(found: EstimatorComparison) -> list[Block]:
    blocks: list[Block] = [estimate_table(found)]
    differences = contradictions(found)
    if differences:
        what = "Contradictory results: at least one method is wrong."
        text = "The 95 % intervals of these estimates do not overlap."
        blocks += [Text(text, strong=what), Listed(differences)]
    below = [_LEGEND, assumed_inertia(found), _known(found), assumed_units([found.log])]
    blocks.append(Text(" ".join(filter(None, below)), "reason"))
    return blocks


def assumed_inertia(found: EstimatorComparison | EstimatorStudy) -> str:
    """Return the meaning of a star: an inertia that was given to an estimator."""
    if isinstance(found, EstimatorStudy):
        return f"* with the {mass_name(found.kind)} that the energy estimator returned in each run"
    given = [each.assumed_inertia for each in found.applied if each.assumed_inertia is not None]
    if not given:
        return ""
    body, unit = mass_name(found.log.kind), unit_text(found.log.unit("inertia"))
    return f"* with the {body} of the energy estimator, {given[0]:.6g} {unit}"


def contradictions(found: EstimatorComparison) -> list[str]:
    """Return a sentence for each parameter of which trusted intervals do not overlap."""
    kind = found.log.kind
    compared = {each.name: each for each in found.compared}
    sentences: list[str] = []
    for each in found.contradictions:
        values = (f"{name} {_value(compared[name], each.parameter)}" for name in each.intervals)
        stands = f"; {each.alone} stands alone, the others agree" if each.alone else ""
        terms = found.selected_terms(each.alone) if each.alone else ()
        if terms:
            stands += f" and may lack its terms ({', '.join(terms)})"
        label = parameter_label(each.parameter, kind)
        unit = unit_text(found.log.unit(each.parameter))
        sentences.append(f"{label} [{unit}]: {', '.join(values)}{stands}")
    return sentences


def _known(found: EstimatorComparison) -> str:
    """Return the parameters given to the estimators; empty if none were."""
    kind = found.log.kind
    given: dict[str, float] = {}
    for each in found.applied:
        if each.estimate is None or each.assumed_inertia is not None:
            continue
        for name in ("inertia", "load_inertia", "stiffness"):
            value = each.estimate.provenance.options.get(name)
            if isinstance(value, int | float):
                given[name.replace("inertia", mass_name(kind))] = value
    parts = [
        f"{name.replace('_', ' ')} {value:.6g} {unit_text(found.log.unit(name))}"
        for name, value in given.items()
    ]
    return f"Given: {', '.join(parts)}." if parts else ""


def reasons_against(found: EstimatorComparison | EstimatorStudy) -> list[str]:
    """Return a sentence for each estimator that does not apply."""
    every: Sequence[ComparedEstimator | EstimatorScore] = (
        found.compared if isinstance(found, EstimatorComparison) else found.scores
    )
    return [f"{each.name}: {in_words(each.why_not)}" for each in every if each.why_not]


def score_tables(study: EstimatorStudy) -> list[Table]:
    """Return the errors of estimators: a table a parameter, and one of status and time."""
    name_column = Column("Estimator", "left", width=_WIDEST_NAME)
    tables: list[Table] = []
    for name in study.parameters:
        truth, unit = study.truth.get(name, 0.0), printed_unit(name, study.kind)
        size, in_unit = (100.0 / abs(truth), "%") if truth else (1.0, unit)
        bound = study.bound.get(name)
        least = "" if bound is None else f"; Cramér-Rao bound {bound * size:.3g} {in_unit}"
        columns = [
            name_column,
            Column(f"Bias [{in_unit}]", short=f"bias\n[{in_unit}]", width=_WIDEST_NUMBER),
            Column(f"RMSE [{in_unit}]", short=f"RMSE\n[{in_unit}]", width=_WIDEST_NUMBER),
            Column("RMSE over the bound", short="over the\nbound", width=_WIDEST_NUMBER),
            Column("95 % intervals that hold the truth", short="covered"),
            Column("Runs"),
        ]
        rows = [
            [
                f"{each.name} *" if each.assumes_inertia else each.name,
                f"{score.bias * size:+.3g}",
                f"{score.rmse * size:.3g}",
                or_none(score.bound_ratio, ratio_text),
                or_none(score.coverage, "{:.1%}".format),
                str(score.runs),
            ]
            for each in study.applied
            if (score := each.scores.get(name)) is not None
        ]
        title = f"{parameter_label(name, study.kind)}: {truth:.6g} {unit}{least}"
        tables.append(Table(title=title, columns=columns, rows=rows))
    delays = any(each.delay_found is not None for each in study.applied)
    heads = ("Status ok", "A sample", *(["Delay found"] if delays else []))
    rows = [
        [
            each.name,
            f"{each.trusted:.0%}",
            _seconds(each.seconds_per_sample),
            *([or_none(each.delay_found, "{:.1%}".format)] if delays else []),
        ]
        for each in study.applied
    ]
    columns = [name_column, *map(Column, heads)]
    rest = Table(title="Status and time of a sample", columns=columns, rows=rows)
    return [*tables, rest] if study.applied else []


def _log_provenance(found: EstimatorComparison) -> list[Block]:
    blocks: list[Block] = []
    for each in found.applied:
        if each.estimate is None:
            continue
        notes = [each.estimate.status.text] if not each.estimate.status.trusted else []
        notes += missing_parameters(each.estimate)
        notes += [in_words(note) for note in each.estimate.diagnostics.notes]
        if notes:
            blocks.append(Fold(each.name, [Listed(notes)]))
    log, source = found.log, found.log.source
    facts: list[tuple[str, str | Cell]] = [
        ("Samples", f"{len(log)}, one every {1e3 * log.sampling_time:.4g} ms"),
        ("Files", "made in memory" if source is None else ", ".join(source.files)),
    ]
    if source is not None:
        facts.append(("SHA-256 of the input", Cell(source.sha256, "code")))
        blocks += headed_list("Assumed in reading the log", source.assumptions)
    return [*blocks, Heading("Log"), Table.of_facts(facts)]


def _seconds(value: float | None) -> str:
    return NONE if value is None else prefixed(value, "s")


class _Bar(NamedTuple):
    """A value with its interval."""

    name: str
    value: float
    low: float
    high: float
    good: bool


def estimate_plots(found: EstimatorComparison) -> list[Plot]:
    """Draw each parameter by estimator, with its 95 % interval."""
    plots: list[Plot] = []
    kind = found.log.kind
    for name in found.parameters:
        bars = [
            _Bar(
                each.name,
                parameter.value,
                *(parameter.ci95 or (parameter.value, parameter.value)),
                each.estimate.status.trusted,
            )
            for each in found.applied
            if each.estimate is not None
            and (parameter := each.estimate.parameters.get(name)) is not None
            and parameter.value is not None
        ]
        title = f"{draw.symbol(name)} [{unit_text(found.log.unit(name))}]"
        plots.append(_bars(name, kind, bars, names=("trusted", "not to be trusted"), title=title))
    return plots


def score_plots(study: EstimatorStudy) -> list[Plot]:
    """Draw the mean error of each parameter, and the standard deviation of a run around it."""
    plots: list[Plot] = []
    for name in study.parameters:
        truth = study.truth.get(name, 0.0)
        size = 100.0 / abs(truth) if truth else 1.0
        bars: list[_Bar] = []
        for each in study.applied:
            score = each.scores.get(name)
            if score is None:
                continue
            variance = max(score.rmse**2 - score.bias**2, 0.0)
            bias, reach = score.bias * size, variance**0.5 * size
            # What several standard errors of the mean do not explain is a bias
            good = score.bias**2 <= 9.0 * variance / max(score.runs, 1)
            bars.append(_Bar(each.name, bias, bias - reach, bias + reach, good))
        unit = "% of the truth" if truth else printed_unit(name, study.kind)
        names = ("no bias to be seen", "biased by more than three standard errors")
        title = f"error of {draw.symbol(name)} [{unit}]"
        plots.append(_bars(name, study.kind, bars, names=names, title=title, truth=0.0))
    return plots


def _bars(
    name: str,
    kind: AxisKind,
    bars: Sequence[_Bar],
    *,
    names: tuple[str, str],
    title: str,
    truth: float | None = None,
) -> Plot:
    """Draw values one below the other; values far off are given as text."""
    label = parameter_label(name, kind)
    quarter, middle, three = np.percentile([bar.value for bar in bars], [25, 50, 75])
    widths = [bar.high - bar.low for bar in bars if bar.high > bar.low]
    typical = float(np.median(widths)) if widths else 0.0
    reach = _FAR * max(float(three - quarter), typical, 1e-3 * abs(middle))
    shown = [bar for bar in bars if abs(bar.value - middle) <= reach]
    far = [f"{bar.name} at {bar.value:.3g}" for bar in bars if bar not in shown]
    traces: list[Trace] = []
    for good, words, colour, sign in (
        (True, names[0], draw.BLUE, "circle"),
        (False, names[1], draw.VERMILION, "x"),
    ):
        some = [bar for bar in shown if bar.good is good]
        if some:
            values, low, high = np.array([(bar.value, bar.low, bar.high) for bar in some]).T
            look = {"color": colour, "size": 8, "symbol": sign}
            bars_across = draw.bars_across(values, low, high, colour)
            at = [bar.name for bar in some]
            traces.append(draw.markers(values, at, words, look, error_x=bars_across))
    low = max(min(bar.low for bar in shown), middle - reach)
    high = min(max(bar.high for bar in shown), middle + reach)
    shapes: list[dict[str, object]] = []
    if truth is not None:
        low, high = min(low, truth), max(high, truth)
        shapes.append(draw.vertical(truth, dash="dash", width=1.2, colour=draw.GREY))
    order = [bar.name for bar in bars][::-1]
    values = ", ".join(f"{bar.name} {bar.value:.4g}" for bar in bars)
    return Plot(
        anchor=f"estimates-{name.replace('_', '-')}",
        alternative=f"{label} by estimator: {values}.",
        caption=f"Out of the picture: {', '.join(far)}." if far else "",
        traces=traces,
        layout=layout(
            x=axis(title, **draw.range_of([low, high], room=_MARGIN)),
            y=[axis("", type="category", categoryorder="array", categoryarray=order)],
            hovermode="closest",
            shapes=shapes,
        ),
        height=_FRAME + _ROW * len(bars),
        heading=label,
    )


def motion_plots(found: EstimatorComparison) -> list[Plot]:
    """Draw the simulated less the measured position of each identified axis, at one scale."""
    errors = [
        (each, again, again.simulated_position - again.measured_position)
        for each in found.applied
        if (again := each.resimulation) is not None
    ]
    if not errors:
        return []
    typical = [float(np.percentile(np.abs(error), 99.0)) for *_, error in errors]
    scale = 1.2 * min(max(typical), _FAR * float(np.median(typical))) or 1.0
    across = quantity_axis("position", found.log.kind, range=[-scale, scale])
    return [
        Plot(
            anchor=f"motion-{each.name}",
            alternative=(
                f"Simulated less measured position over time with the law that {each.name} "
                f"found; it explains {again.fit:.2%} of the position."
            ),
            caption=f"explains {again.fit:.2%} of the position",
            traces=[line(again.time, error, "simulated less measured", Look(draw.BLUE))],
            layout=layout(x=axis("time [s]"), y=[across]),
            height=230,
            heading=each.name,
        )
        for each, again, error in errors
    ]
