"""Estimators side by side as tables for a terminal."""

import textwrap
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from stickslip.records import ComparedEstimator, EstimatorComparison, EstimatorStudy

__all__ = ["print_comparison"]

_WIDEST_NUMBER = 9  # characters of such as -0.000616, so that the tables stand in line
_NO_LIMIT = 10_000  # characters; wider than any table


def print_comparison(console: "Console", found: "EstimatorComparison | EstimatorStudy") -> None:
    """Print what was compared, a row for each estimator, and why others do not apply."""
    from stickslip.records import EstimatorComparison, in_words, unit_text

    if isinstance(found, EstimatorComparison):
        log = found.log
        duration = float(log.time[-1] - log.time[0])
        console.print(
            f"{log.name}: {len(log)} samples over {duration:.4g} s, {log.kind} axis", soft_wrap=True
        )
        if log.source is not None and log.source.assumptions:
            console.print("Assumed in reading it:")
            _listed(console, log.source.assumptions)
        left_out = {each.name: each.why_not for each in found.compared if each.why_not}
    else:
        console.print(
            f"{found.name}: {found.runs} runs of {found.samples} samples, {found.kind} axis",
            soft_wrap=True,
        )
        left_out = {each.name: each.why_not for each in found.scores if each.why_not}
    console.print()
    if isinstance(found, EstimatorComparison):
        for table in _of_log(found, console) if found.applied else []:
            console.print(table)
        assumed = [each for each in found.compared if each.assumed_inertia is not None]
        if assumed:
            notes = [
                f"* with the {'mass' if found.log.kind == 'linear' else 'inertia'} of the energy "
                f"estimator, {assumed[0].assumed_inertia:.6g} {unit_text(found.log.unit('mass'))}"
            ]
            _listed(console, notes, bullet="")
        doubts = _doubts(found)
        if doubts:
            console.print("Not to be trusted:")
            _listed(console, doubts)
        contradictions = _contradictions(found)
        if contradictions:
            console.print("Contradictory results: at least one method is wrong.", style="bold red")
            _listed(console, contradictions)
    else:
        for name in found.parameters:
            console.print(_of_parameter(found, name))
        console.print(_of_study(found))
        if any(each.assumes_inertia for each in found.applied):
            body = "mass" if found.kind == "linear" else "inertia"
            _listed(console, [f"* with the {body} that the energy estimator found in each run"], "")
        _listed(console, found.notes)
    if left_out:
        console.print("Does not apply:")
        _listed(console, [f"{name}: {in_words(why)}" for name, why in left_out.items()])
    if not found.trusted:
        console.print("✗ None of the estimates can be trusted.", style="bold red")


def _listed(console: "Console", sentences: tuple[str, ...] | list[str], bullet: str = "- ") -> None:
    for sentence in sentences:
        console.print(
            textwrap.fill(
                sentence,
                console.width,
                initial_indent=f"  {bullet}",
                subsequent_indent="    ",
            ),
            soft_wrap=True,
        )


def _of_log(found: "EstimatorComparison", console: "Console") -> "list[Table]":
    from rich.text import Text

    from stickslip.records import parameter_label, prefixed, share_text, unit_of, unit_text

    applied = [(each, each.estimate) for each in found.applied if each.estimate is not None]
    columns: dict[str, list[Text]] = {}
    for name in found.parameters:
        words = parameter_label(name, found.log.kind).replace(" ", "\n")
        unit = unit_text(unit_of(name, found.log.kind))
        columns[f"{words}\n[{unit}]"] = [Text(_value(each, name)) for each, _ in applied]
    lefts = [each.unexplained_effort for each, _ in applied]
    if any(left is not None for left in lefts):
        columns["effort\nleft"] = [
            Text("-" if left is None else share_text(left)) for left in lefts
        ]
    columns["a\nsample"] = [
        Text("-" if each.seconds_per_sample is None else prefixed(each.seconds_per_sample, "s"))
        for each, _ in applied
    ]
    alone = found.alone
    columns["status"] = [
        Text(
            estimate.status.value.replace("_", " ") + (", alone" if each.name in alone else ""),
            style="green" if estimate.status.trusted and each.name not in alone else "red",
        )
        for each, estimate in applied
    ]
    return _fitting(console, [each.name for each, _ in applied], columns)


def _value(each: "ComparedEstimator", name: str) -> str:
    """Return the cell of a parameter: its value with half of its 95 % interval."""
    from stickslip.records import rounded

    parameter = None if each.estimate is None else each.estimate.parameters.get(name)
    if parameter is None or parameter.value is None:
        given = name in {"mass", "inertia"} and each.assumed_inertia is not None
        return "*" if given else "-"
    if parameter.ci95 is None:
        return f"{parameter.value:.4g}"
    half = 0.5 * (parameter.ci95[1] - parameter.ci95[0])
    return f"{rounded(parameter.value, half)} ± {half:.2g}"


def _fitting(
    console: "Console", names: list[str], columns: "Mapping[str, list[Text]]"
) -> "list[Table]":
    """Return the columns in as many tables as it takes that the console cuts none of them."""
    from rich.measure import Measurement

    tables: list[Table] = []
    taken: dict[str, list[Text]] = {}
    unbounded = console.options.update(max_width=_NO_LIMIT)
    for head, cells in columns.items():
        wider = _columns(names, {**taken, head: cells})
        if taken and Measurement.get(console, unbounded, wider).maximum > console.width:
            tables.append(_columns(names, taken))
            taken = {}
        taken[head] = cells
    return [*tables, _columns(names, taken)]


def _columns(names: list[str], columns: "Mapping[str, list[Text]]") -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("estimator", no_wrap=True)
    for head in columns:
        table.add_column(head, justify="left" if head == "status" else "right", no_wrap=True)
    for index, name in enumerate(names):
        table.add_row(name, *(cells[index] for cells in columns.values()))
    return table


def _doubts(found: "EstimatorComparison") -> list[str]:
    """Return why each estimate that is not to be trusted is not."""
    from stickslip.records import missing_parameters

    doubts: dict[str, list[str]] = {}
    for each in found.applied:
        if each.estimate is None or each.estimate.status.trusted:
            continue
        reasons = missing_parameters(each.estimate, found.log.kind)
        doubts.setdefault("; ".join(reasons) or each.estimate.status.text, []).append(each.name)
    return [f"{', '.join(names)}: {why}" for why, names in doubts.items()]


def _contradictions(found: "EstimatorComparison") -> list[str]:
    """Return a sentence for each parameter of which trusted intervals do not overlap."""
    from stickslip.records import parameter_label, unit_of, unit_text

    sentences: list[str] = []
    for each in found.contradictions:
        unit = unit_text(unit_of(each.parameter, found.log.kind))
        values = [_value_of(found, name, each.parameter) for name in each.intervals]
        shown = ", ".join(
            f"{name} {value}" for name, value in zip(each.intervals, values, strict=True)
        )
        label = parameter_label(each.parameter, found.log.kind)
        stands = f"; {each.alone} stands alone, the others agree" if each.alone else ""
        sentences.append(f"{label} [{unit}]: {shown}{stands}")
    return sentences


def _value_of(found: "EstimatorComparison", estimator: str, parameter: str) -> str:
    return next(_value(each, parameter) for each in found.compared if each.name == estimator)


def _of_parameter(found: "EstimatorStudy", name: str) -> "Table":
    from rich import box
    from rich.table import Table

    from stickslip.records import parameter_label, ratio_text, unit_of, unit_text

    truth = found.truth.get(name, 0.0)
    unit = unit_text(unit_of(name, found.kind))
    size, in_unit = (100.0 / abs(truth), "%") if truth else (1.0, unit)
    bound = found.bound.get(name)
    least = "" if bound is None else f", bound {bound * size:.3g} {in_unit}"
    table = Table(
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        title=f"{parameter_label(name, found.kind)}: {truth:.6g} {unit}{least}",
        title_justify="left",
    )
    table.add_column("estimator", no_wrap=True, min_width=22)
    for head in (f"bias\n[{in_unit}]", f"RMSE\n[{in_unit}]", "over the\nbound"):
        table.add_column(head, justify="right", no_wrap=True, min_width=_WIDEST_NUMBER)
    for head in ("covered", "runs"):
        table.add_column(head, justify="right", no_wrap=True)
    for each in found.applied:
        score = each.scores.get(name)
        if score is None:
            continue
        table.add_row(
            f"{each.name} *" if each.assumes_inertia else each.name,
            f"{score.bias * size:+.3g}",
            f"{score.rmse * size:.3g}",
            "-" if score.bound_ratio is None else ratio_text(score.bound_ratio),
            _share(score.coverage),
            str(score.runs),
        )
    return table


def _of_study(found: "EstimatorStudy") -> "Table":
    from rich import box
    from rich.table import Table

    from stickslip.records import prefixed

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("estimator", no_wrap=True, min_width=22)
    table.add_column("status ok", justify="right")
    table.add_column("a sample", justify="right")
    delays = any(each.delay_found is not None for each in found.applied)
    if delays:
        table.add_column("delay found", justify="right")
    for each in found.applied:
        seconds = each.seconds_per_sample
        table.add_row(
            each.name,
            f"{each.trusted:.0%}",
            "-" if seconds is None else prefixed(seconds, "s"),
            *([_share(each.delay_found)] if delays else []),
        )
    return table


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.1%}"
