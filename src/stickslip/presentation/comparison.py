"""Estimators side by side, on a log or over the runs of a scenario, as tables and as a page."""

from collections.abc import Sequence

from stickslip.presentation.figures.comparison import estimate_plots, motion_plots, score_plots
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
    share_text,
    value_with_half,
)
from stickslip.records import (
    ComparedEstimator,
    EstimatorComparison,
    EstimatorScore,
    EstimatorStudy,
    count_of,
    in_words,
    parameter_label,
)

__all__ = [
    "assumed_inertia",
    "comparison_page",
    "contradictions",
    "estimate_table",
    "reasons_against",
    "score_tables",
    "study_page",
]

_WIDEST_NAME, _WIDEST_NUMBER = 22, 9  # characters, so that tables on a terminal stand in line

_LEGEND = (
    "Values with half of their 95 % interval. Effort left: norm of effort "
    "less inertia force and friction over norm of the effort, smoothed and decimated alike for "
    "every estimator. Position explained: 1 less the norm of simulated less measured position "
    "over that of the measured one less its mean, the identified axis being driven by the "
    "logged effort and started anew twenty times. A sample: time of a whole fit over the "
    "samples of the log."
)


def comparison_page(found: EstimatorComparison) -> Page:
    """Return the page of estimators side by side on a log."""
    log, applied = found.log, found.applied
    lead = (
        "Each parameter as every estimator found it, with its 95 % interval where the method "
        "gives one. Intervals that do not meet show that a method is biased on such a log, or too "
        "sure of itself."
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
            "Each identified axis is driven by the logged effort, and starts anew from the "
            "measured motion twenty times. Shown is the simulated position less the measured one, "
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
    sections += _left_out(found)
    sections.append(Section("notes", "Notes and provenance", _log_provenance(found)))
    return _page(found, log.name, f"{log.kind} axis", verdict, sections)


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
        *_left_out(study),
        Section("notes", "Scenario, notes and provenance", _study_provenance(study)),
    ]
    verdict = (
        f"{count_of(len(study.applied), 'estimator')} of {len(study.scores)} over "
        f"{count_of(study.runs, 'run')} of {study.samples} samples, whose truth is known."
    )
    return _page(study, study.name, f"Monte Carlo, {study.kind} axis", verdict, sections)


def _page(
    found: EstimatorComparison | EstimatorStudy,
    name: str,
    kicker: str,
    verdict: str,
    sections: Sequence[Section],
) -> Page:
    word = "Compared" if found.trusted else "None of the estimates can be trusted"
    return Page(
        title=f"Estimators on {name}",
        kicker=f"estimators compared · {kicker}",
        name=name,
        verdict=Verdict(found.trusted, word, verdict),
        sections=sections,
        version=found.stickslip_version,
    )


def estimate_table(found: EstimatorComparison) -> Table:
    """Return what each estimator makes of a log, a row each."""
    kind = found.log.kind
    applied = [(each, each.estimate) for each in found.applied if each.estimate is not None]
    columns = [Column("Estimator", "left")]
    for name in found.parameters:
        label, unit = parameter_label(name, kind), f"[{printed_unit(name, kind)}]"
        stacked = "\n".join([*label.split(), unit])
        columns.append(Column(f"{label} {unit}", short=stacked))
    left = any(each.unexplained_effort is not None for each, _ in applied)
    columns += [
        Column("Effort left", short="effort\nleft", only="" if left else "page"),
        Column("Position explained", only="page"),
        Column("A sample", short="a\nsample"),
        Column("Status", "left"),
    ]
    rows: list[list[str | Cell]] = []
    for each, estimate in applied:
        again, alone = each.resimulation, each.name in found.alone
        good = estimate.status.trusted and not alone
        status = estimate.status.value.replace("_", " ") + ", alone" * alone
        rows.append(
            [
                each.name,
                *(_value(each, name) for name in found.parameters),
                or_none(each.unexplained_effort, share_text),
                NONE if again is None else f"{again.fit:.2%}",
                _seconds(each.seconds_per_sample),
                Cell(status, "good" if good else "bad"),
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
    """Return what a star stands for: an inertia that was given to an estimator."""
    if isinstance(found, EstimatorStudy):
        body = "mass" if found.kind == "linear" else "inertia"
        return f"* with the {body} that the energy estimator found in each run"
    given = [each.assumed_inertia for each in found.applied if each.assumed_inertia is not None]
    if not given:
        return ""
    kind = found.log.kind
    body = "mass" if kind == "linear" else "inertia"
    unit = printed_unit(body, kind)
    return f"* with the {body} of the energy estimator, {given[0]:.6g} {unit}"


def contradictions(found: EstimatorComparison) -> list[str]:
    """Return a sentence for each parameter of which trusted intervals do not overlap."""
    kind = found.log.kind
    compared = {each.name: each for each in found.compared}
    sentences: list[str] = []
    for each in found.contradictions:
        values = (f"{name} {_value(compared[name], each.parameter)}" for name in each.intervals)
        stands = f"; {each.alone} stands alone, the others agree" if each.alone else ""
        label, unit = parameter_label(each.parameter, kind), printed_unit(each.parameter, kind)
        sentences.append(f"{label} [{unit}]: {', '.join(values)}{stands}")
    return sentences


def _known(found: EstimatorComparison) -> str:
    """Return the parameters given to the estimators; empty if none were."""
    kind = found.log.kind
    body = "mass" if kind == "linear" else "inertia"
    given: dict[str, float] = {}
    for each in found.applied:
        if each.estimate is None or each.assumed_inertia is not None:
            continue
        for name in ("inertia", "load_inertia", "stiffness"):
            value = each.estimate.provenance.options.get(name)
            if isinstance(value, int | float):
                given[name.replace("inertia", body)] = value
    parts = [
        f"{name.replace('_', ' ')} {value:.6g} {printed_unit(name, kind)}"
        for name, value in given.items()
    ]
    return f"Given: {', '.join(parts)}." if parts else ""


def reasons_against(found: EstimatorComparison | EstimatorStudy) -> dict[str, str]:
    """Return why estimators do not apply, by name."""
    every: Sequence[ComparedEstimator | EstimatorScore] = (
        found.compared if isinstance(found, EstimatorComparison) else found.scores
    )
    return {each.name: in_words(each.why_not) for each in every if each.why_not}


def _left_out(found: EstimatorComparison | EstimatorStudy) -> list[Section]:
    reasons = [f"{name}: {why}" for name, why in reasons_against(found).items()]
    return [Section("left-out", "Does not apply", [Listed(reasons)])] if reasons else []


def score_tables(study: EstimatorStudy) -> list[Table]:
    """Return how near to the truth estimators come: a table a parameter, and one of the rest."""
    name_column = Column("Estimator", "left", width=_WIDEST_NAME)
    tables: list[Table] = []
    for name in study.parameters:
        truth, unit = study.truth.get(name, 0.0), printed_unit(name, study.kind)
        size, in_unit = (100.0 / abs(truth), "%") if truth else (1.0, unit)
        bound = study.bound.get(name)
        least = "" if bound is None else f"; Cramér-Rao bound {bound * size:.3g} {in_unit}"
        tables.append(
            Table(
                title=f"{parameter_label(name, study.kind)}: {truth:.6g} {unit}{least}",
                columns=[
                    name_column,
                    *(
                        Column(
                            f"{what} [{in_unit}]",
                            short=f"{short}\n[{in_unit}]",
                            width=_WIDEST_NUMBER,
                        )
                        for what, short in (("Bias", "bias"), ("RMSE", "RMSE"))
                    ),
                    Column("RMSE over the bound", short="over the\nbound", width=_WIDEST_NUMBER),
                    Column("95 % intervals that hold the truth", short="covered"),
                    Column("Runs"),
                ],
                rows=[
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
                ],
            )
        )
    delays = any(each.delay_found is not None for each in study.applied)
    heads = ("Status ok", "A sample", *(["Delay found"] if delays else []))
    rest = Table(
        title="Status and time of a sample",
        columns=[name_column, *map(Column, heads)],
        rows=[
            [
                each.name,
                f"{each.trusted:.0%}",
                _seconds(each.seconds_per_sample),
                *([or_none(each.delay_found, "{:.1%}".format)] if delays else []),
            ]
            for each in study.applied
        ],
    )
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
        if source.assumptions:
            blocks += [Heading("Assumed in reading the log"), Listed(source.assumptions)]
    return [*blocks, Heading("Log"), Table.of_facts(facts)]


def _study_provenance(study: EstimatorStudy) -> list[Block]:
    notes = [Listed(study.notes)] if study.notes else []
    return [*notes, *scenario_blocks(study.scenario, study.file, study.sha256)]


def _seconds(value: float | None) -> str:
    return NONE if value is None else prefixed(value, "s")
