"""An identification as words and a table for a terminal."""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from stickslip.records import Identification

__all__ = ["print_identification"]


def print_identification(console: "Console", identification: "Identification") -> None:
    """Print what was assumed, the parameters, the verdict with its remedy, and the notes."""
    from stickslip.records import in_words, missing_parameters

    estimate = identification.estimate
    diagnostics = estimate.diagnostics
    for log in identification.logs:
        duration = float(log.time[-1] - log.time[0])
        console.print(
            f"{log.name}: {len(log)} samples over {duration:.4g} s, one every "
            f"{1e3 * log.sampling_time:.4g} ms, {log.kind} axis"
        )
    if estimate.provenance.assumptions:
        console.print("Assumed in reading it:")
        _listed(console, estimate.provenance.assumptions)
    console.print()
    console.print(_table(identification))
    console.print()
    mark = "✓" if estimate.status.trusted else "✗"
    console.print(
        f"{mark} {estimate.status.value}: {estimate.status.text}",
        style="green" if estimate.status.trusted else "bold red",
    )
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
    if estimate.joint is not None:
        console.print(estimate.joint.text)
    if estimate.selection is not None:
        console.print("Model selection:")
        _listed(console, [estimate.selection.summary])
    missing = missing_parameters(estimate)
    if missing:
        console.print("Not identified:")
        _listed(console, missing)
    if diagnostics.notes:
        console.print("Notes:")
        _listed(console, [in_words(note) for note in diagnostics.notes])


def _listed(console: "Console", sentences: Sequence[str]) -> None:
    for sentence in sentences:
        console.print(
            textwrap.fill(sentence, console.width, initial_indent="  - ", subsequent_indent="    "),
            soft_wrap=True,
        )


def _table(identification: "Identification") -> "Table":
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from stickslip.records import Judgement, judged, parameter_label, unit_text, value_texts

    styles = {Judgement.IDENTIFIED: "green", Judgement.NOT_IDENTIFIED: "red"}

    truth, estimate = identification.truth, identification.estimate
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("parameter", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("95 % interval", justify="center", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    if truth is not None:
        table.add_column("true value", justify="right", no_wrap=True)
        table.add_column("error", justify="right", no_wrap=True)
    table.add_column("verdict")
    for name, parameter in estimate.parameters.items():
        value = parameter.value
        cells = [*value_texts(parameter)]
        cells.append(unit_text(parameter.unit))
        if truth is not None:
            true_value = truth.get(name)
            cells.append("-" if true_value is None else f"{true_value:.6g}")
            cells.append(f"{value / true_value - 1:+.2%}" if value and true_value else "-")
        judgement = judged(estimate, name).judgement
        word = Text(judgement.value, style=styles.get(judgement, ""))
        table.add_row(parameter_label(name), *cells, word)
    return table
