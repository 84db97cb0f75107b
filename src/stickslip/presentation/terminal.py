"""Results as words and tables for a terminal."""

import re
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from stickslip.presentation import comparison, inspection
from stickslip.presentation.axes import axes_table, outcome
from stickslip.presentation.identification import parameter_table, validation_text
from stickslip.presentation.positioning import page as positioning
from stickslip.presentation.table import Column, Table, print_table
from stickslip.presentation.words import (
    assumed_units,
    missing_parameters,
    or_none,
    prefixed,
    printed_unit,
    reasons_of_status,
    side_text,
)
from stickslip.records import (
    AxesIdentification,
    AxisLog,
    EstimatorComparison,
    EstimatorStudy,
    Excitation,
    Identification,
    Inspection,
    Positioning,
    in_words,
    parameter_label,
    share_text,
    unit_of,
)

if TYPE_CHECKING:
    from rich.console import Console


def print_identification(console: "Console", identification: Identification) -> None:
    """Print assumptions, the parameters, the verdict with its remedy, and the notes."""
    estimate = identification.estimate
    diagnostics, status = estimate.diagnostics, estimate.status
    for log in identification.logs:
        console.print(f"{log.name}: {_sampling(log)}, {log.kind} axis")
    _listed(console, "Assumed in reading it:", estimate.provenance.assumptions)
    console.print()
    print_table(console, parameter_table(identification))
    console.print()
    assumed = assumed_units(identification.logs)
    for words in (assumed, side_text(estimate)):
        if words:
            console.print(words)
    _verdict(console, f"{status.value}: {status.text}", good=status.trusted, wrapped=False)
    if any(parameter.identified for parameter in estimate.parameters.values()):
        crossed = diagnostics.cross_validation_residual
        crossed = "" if crossed is None else f", {crossed:.2%} in cross-validation"
        effort = identification.residuals
        unexplained = "" if effort is None else f"{effort.share:.2%} of the effort; of its rows "
        console.print(
            f"Unexplained by estimator {estimate.estimator}: {unexplained}"
            f"{diagnostics.relative_residual:.2%}{crossed}. Effective sample size: "
            f"{diagnostics.effective_samples:.0f} of {diagnostics.samples}."
        )
    if identification.validation is not None:
        _say(console, validation_text(identification.validation))
    if estimate.joint is not None:
        console.print(estimate.joint.text)
    if estimate.selection is not None:
        _listed(console, "Model selection:", [estimate.selection.summary])
    _listed(console, "Not identified:", missing_parameters(estimate))
    _listed(console, "Notes:", [in_words(note) for note in diagnostics.notes])


def print_axes(console: "Console", found: AxesIdentification) -> None:
    """Print one row for each axis, the assumptions, and the reasons against trust in an axis."""
    logs = {axis: each.log for axis, each in found.axes.items()}
    first = next(iter(logs.values()))
    alike = all(
        log.duration == first.duration and log.sampling_time == first.sampling_time
        for log in logs.values()
    )
    sampling = f", {_sampling(first)}" if alike else ""
    console.print(f"{found.name}: {len(logs)} axes{sampling}")
    assumed = {axis: log.source.assumptions if log.source else () for axis, log in logs.items()}
    _listed(console, "Assumed in reading it:", _once(assumed))
    console.print()
    print_table(console, axes_table(found))
    sides = {side_text(each.estimate) for each in found.axes.values()}
    if len(sides) == 1:
        _listed(console, "", sides, bullet="")
    reasons: list[str] = []
    for axis, each in found.axes.items():
        estimate = each.estimate
        if not estimate.status.trusted:
            causes = reasons_of_status(estimate)
            reasons.append(f"{axis}: {'; '.join(causes) or estimate.status.text}")
    reasons += [f"{axis}: {why}" for axis, why in found.unread.items()]
    _listed(console, "Not to be trusted:", reasons)
    _listed(
        console,
        "",
        [
            f"{axis}: {validation_text(each.validation)}"
            for axis, each in found.axes.items()
            if each.validation is not None and each.validation.error is None
        ],
    )
    _verdict(console, f"{outcome(found)}.", good=found.trusted)


def print_inspection(console: "Console", found: Inspection) -> None:
    """Print columns, rates, the proposed axes with reasons, missing columns, and the check."""
    rates = [
        f"{name or 'all columns'}: {rate:.4g} Hz" if rate else f"{name or 'all columns'}: no rate"
        for name, rate in found.rates.items()
    ]
    console.print(f"{found.name}: {len(found.columns)} columns; {'; '.join(rates)}")
    _listed(console, "Assumed in reading the file:", found.notes)
    console.print()
    print_table(console, inspection.column_table(found))
    readable = [each for each in found.axes if not each.problem]
    console.print(f"Proposed axes: {len(readable)}")
    print_table(console, inspection.axis_table(found))
    _listed(
        console, "Reasons:", _once({each.name: each.reasons for each in found.axes if each.reasons})
    )
    _listed(console, "Missing:", [f"{a.name}: {a.problem}" for a in found.axes if a.problem])
    if found.limit is None:
        _verdict(
            console,
            f"{len(readable)} of {len(found.axes)} axes can be read.",
            good=found.trusted,
        )
        return
    console.print()
    print_table(console, inspection.check_table(found))
    advice = {
        f"{axis.name}, {in_words(each.parameter)}: {each.advice}"
        for axis in found.axes
        for each in axis.expected
        if each.advice
    }
    _listed(console, "What to record instead:", sorted(advice))
    words = f"half width of at most {100 * found.limit:.3g} % of the value"
    _verdict(
        console,
        f"Every parameter can be expected with a {words}."
        if found.trusted
        else f"Not every parameter can be expected with a {words}.",
        good=found.trusted,
    )


def _once(sentences: Mapping[str, Sequence[str]]) -> list[str]:
    """Return sentences by axis; those that differ only in the quoted name of the axis once."""

    def general(axis: str, line: str) -> str:
        name = re.compile(rf"(?<![^\W_]){re.escape(axis)}(?![^\W_])")
        return re.sub(r"'[^']*'", lambda quoted: name.sub("{axis}", quoted[0]), line)

    if not sentences:
        return []
    every = [{general(axis, line) for line in lines} for axis, lines in sentences.items()]
    shared = set[str].intersection(*every)
    first = next(iter(sentences))
    listed = [line for each in sentences[first] if (line := general(first, each)) in shared]
    return listed + [
        f"{axis}: {line}"
        for axis, lines in sentences.items()
        for line in lines
        if general(axis, line) not in shared
    ]


def _sampling(log: AxisLog) -> str:
    return (
        f"{len(log)} samples over {log.duration:.4g} s, one every {1e3 * log.sampling_time:.4g} ms"
    )


def print_comparison(console: "Console", found: EstimatorComparison | EstimatorStudy) -> None:
    """Print what was compared, a row for each estimator, and why others do not apply."""
    if isinstance(found, EstimatorComparison):
        log = found.log
        samples = f"{len(log)} samples over {log.duration:.4g} s"
        console.print(f"{log.name}: {samples}, {log.kind} axis", soft_wrap=True)
        _listed(console, "Assumed in reading it:", log.source.assumptions if log.source else ())
        console.print()
        if found.applied:
            print_table(console, comparison.estimate_table(found))
        _listed(console, "", [comparison.assumed_inertia(found), assumed_units([log])], bullet="")
        _listed(console, "Not to be trusted:", _doubts(found))
        differences = comparison.contradictions(found)
        if differences:
            words = "Contradictory results: at least one method is wrong."
            console.print(words, style="bold red")
            _listed(console, "", differences)
    else:
        runs = f"{found.runs} runs of {found.samples} samples"
        console.print(f"{found.name}: {runs}, {found.kind} axis", soft_wrap=True)
        console.print()
        for table in comparison.score_tables(found):
            print_table(console, table)
        if any(each.assumes_inertia for each in found.applied):
            _listed(console, "", [comparison.assumed_inertia(found)], bullet="")
        _listed(console, "", found.notes)
    _listed(console, "Does not apply:", comparison.reasons_against(found))
    if not found.trusted:
        _verdict(console, "None of the estimates can be trusted.", good=False)


def _doubts(found: EstimatorComparison) -> list[str]:
    """Return why each estimate that is not to be trusted is not."""
    doubts: dict[str, list[str]] = {}
    for each in found.applied:
        if each.estimate is not None and not each.estimate.status.trusted:
            reasons = reasons_of_status(each.estimate, found.log.kind)
            doubts.setdefault("; ".join(reasons) or each.estimate.status.text, []).append(each.name)
    return [f"{', '.join(names)}: {why}" for why, names in doubts.items()]


def print_positioning(console: "Console", result: Positioning) -> None:
    """Print the end of each move, the phases and series of a landing, and the estimates."""
    unit, run = unit_of("position", result.kind), result.runs[-1]
    console.print(
        f"{result.name}: {result.controller}, {positioning.what_moves(result)}", soft_wrap=True
    )
    console.print()
    print_table(console, positioning.move_table(result))
    if run.phases:
        console.print(positioning.phase_table(run).to_rich())
        if run.arm is not None and run.arm.series:
            print_table(console, positioning.series_table(run, run.arm, result))
    if result.runs[0].estimates:
        print_table(console, positioning.estimate_table(result))
        if result.counts_offset:
            words = "Friction of each direction has the constant offset in it, also the truth's."
            _say(console, words, "dim")
            console.print()
    words = f"{result.ending.value}: {result.ending_text}"
    if result.ending.reached:
        words = (
            f"reached: {prefixed(result.last.final_error, unit)} from the target, tolerance "
            f"{prefixed(result.tolerance, unit)}."
        )
    _verdict(console, words, good=result.ending.reached)
    for note in result.notes:
        _say(console, note, "dim")


def print_landing(console: "Console", landing: Positioning) -> None:
    """Print the landing of the demonstration's arm in a sentence."""
    run, move = landing.runs[-1], landing.last
    _say(
        console,
        f"Then the same arm is sent {prefixed(move.target, 'm')} away, with this estimate for "
        "its first guess and the same noisy sensors: feedback, then series of pulses.",
    )
    if not landing.ending.reached:
        _verdict(console, f"{landing.ending.value}: {landing.ending_text}", good=False)
        return
    fired = "" if run.arm is None else f", by {len(run.arm.series)} series"
    swing = "" if move.swing is None else f", mass 2 swings by {prefixed(move.swing, 'm')}"
    settled = "" if move.settling_time is None else f" after {prefixed(move.settling_time, 's')}"
    words = (
        f"landed{settled}{fired}: mass 1 rests {prefixed(abs(move.final_error), 'm')} from the "
        f"target{swing}; asked for were {prefixed(landing.tolerance, 'm')}."
    )
    _verdict(console, words, good=True)


def print_excitation(console: "Console", designed: Excitation) -> None:
    """Print the motion under a designed effort, and the intervals to expect at best."""
    kind = designed.kind
    travel, speed = designed.largest_travel, designed.largest_speed
    console.print(
        f"{designed.effort.size} samples over {prefixed(designed.duration, 's')}; as assumed, the "
        f"axis moves up to {prefixed(travel, unit_of('position', kind))} away from where it "
        f"begins, at up to {prefixed(speed, unit_of('velocity', kind))}.",
        soft_wrap=True,
    )
    heads = ("Assumed", "± at best (95 %)", "Of it")
    table = Table(
        columns=[Column("Parameter", "left"), *map(Column, heads), Column("Unit", "left")],
        rows=[
            [
                parameter_label(name),
                f"{each.first_guess:.5g}",
                f"{each.half_width:.2g}",
                or_none(
                    each.half_width / abs(each.first_guess) if each.first_guess else None,
                    share_text,
                ),
                printed_unit(name, kind),
            ]
            for name, each in designed.expected.items()
        ],
    )
    print_table(console, table)
    words = (
        "The smallest intervals, of an axis as assumed and a known effort: changes of friction and "
        "disturbance forces widen them."
    )
    _say(console, words, "dim")
    if designed.undetermined:
        names = " and ".join(parameter_label(name, kind).lower() for name in designed.undetermined)
        _say(
            console,
            f"Not to be trusted: such an effort does not determine {names}, whose interval reaches "
            "0 even at best. Give a longer duration, or allow more effort, speed or travel.",
        )


def _say(console: "Console", words: str, style: str = "") -> None:
    console.print(textwrap.fill(words, console.width), style=style, soft_wrap=True)


def _verdict(console: "Console", words: str, *, good: bool, wrapped: bool = True) -> None:
    """Print how it went, with a mark."""
    words = f"{'✓' if good else '✗'} {words}"
    style = "green" if good else "bold red"
    if wrapped:
        _say(console, words, style)
    else:
        console.print(words, style=style)


def _listed(console: "Console", heading: str, sentences: Iterable[str], bullet: str = "- ") -> None:
    """Print sentences below each other under their heading; nothing if there are none."""
    every: Sequence[str] = [each for each in sentences if each]
    if heading and every:
        console.print(heading)
    for each in every:
        first = f"  {bullet}"
        text = textwrap.fill(each, console.width, initial_indent=first, subsequent_indent="    ")
        console.print(text, soft_wrap=True)
