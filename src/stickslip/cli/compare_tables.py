"""Estimators side by side as tables for a terminal."""

import textwrap
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from stickslip.records import EstimatorComparison, EstimatorStudy

__all__ = ["print_comparison"]


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
        console.print(_of_log(found))
        assumed = [each for each in found.compared if each.assumed_inertia is not None]
        if assumed:
            notes = [
                f"* with the {'mass' if found.log.kind == 'linear' else 'inertia'} of the energy "
                f"estimator, {assumed[0].assumed_inertia:.6g} {unit_text(found.log.unit('mass'))}"
            ]
            _listed(console, notes, bullet="")
    else:
        for name in found.parameters:
            console.print(_of_parameter(found, name))
        console.print(_of_study(found))
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


def _of_log(found: "EstimatorComparison") -> "Table":
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from stickslip.records import parameter_label, prefixed, rounded, share_text, unit_of, unit_text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("estimator", no_wrap=True)
    for name in found.parameters:
        unit = unit_text(unit_of(name, found.log.kind))
        words = parameter_label(name).replace(" ", "\n")
        table.add_column(f"{words}\n[{unit}]", justify="right", no_wrap=True)
    table.add_column("effort\nleft", justify="right")
    table.add_column("a\nsample", justify="right", no_wrap=True)
    table.add_column("status")
    for each in found.applied:
        estimate = each.estimate
        if estimate is None:
            continue
        cells: list[str] = []
        for name in found.parameters:
            parameter = estimate.parameters.get(name)
            if parameter is None or parameter.value is None:
                given = name in {"mass", "inertia"} and each.assumed_inertia is not None
                cells.append("*" if given else "-")
            elif parameter.std is None or parameter.ci95 is None:
                cells.append(f"{parameter.value:.4g}")
            else:
                half = 0.5 * (parameter.ci95[1] - parameter.ci95[0])
                cells.append(f"{rounded(parameter.value, half)} ± {half:.2g}")
        left, seconds = each.unexplained_effort, each.seconds_per_sample
        cells.append("-" if left is None else share_text(left))
        cells.append("-" if seconds is None else prefixed(seconds, "s"))
        status = estimate.status
        word = Text(status.value.replace("_", " "), style="green" if status.trusted else "red")
        table.add_row(each.name, *cells, word)
    return table


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
        title=f"{parameter_label(name)}: {truth:.6g} {unit}{least}",
        title_justify="left",
    )
    table.add_column("estimator", no_wrap=True, min_width=22)
    for head in (f"bias [{in_unit}]", f"RMSE [{in_unit}]", "over the bound", "covered", "runs"):
        table.add_column(head, justify="right", no_wrap=True, min_width=10)
    for each in found.applied:
        score = each.scores.get(name)
        if score is None:
            continue
        table.add_row(
            each.name,
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
