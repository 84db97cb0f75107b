"""The page: figures, tables and words put together into one file that needs nothing else."""

from collections.abc import Iterable
from pathlib import Path

from stickslip.records import Identification
from stickslip.report import tables
from stickslip.report.drawing import Plot, key
from stickslip.report.figures import (
    balance_plot,
    curve_plot,
    evolution_plots,
    residual_plots,
    resimulation_plot,
)
from stickslip.report.interactive import SCRIPT_POLICY, ending_with, figure, write_page
from stickslip.report.sheet import contents, head, section

__all__ = ["write_report"]

_OF_ONE_LOG = ("evolution", "motion")
_NOT_DRAWN = "Not drawn, as the estimate is not good enough for it: "


def write_report(identification: Identification, path: Path | str) -> Path:
    """Write an identification as one HTML page that works offline, on paper and on a small screen.

    The page holds everything it needs (about 5 MB, nearly all of it the drawing library) and
    fetches nothing. It appears under its name only once it is complete.

    Parameters
    ----------
    identification
        What to show; nothing is computed from it but the drawing.
    path
        The HTML file to write; an existing one is replaced.

    Returns
    -------
    The path written.

    Raises
    ------
    InputError
        If nothing can be written there.
    """
    return write_page(_page(identification), path)


def _page(identification: Identification) -> Iterable[str]:
    every = _sections(identification)
    sections = [(anchor, name, lead, drawn) for anchor, name, lead, drawn in every if drawn]
    missing = [
        name
        for anchor, name, _, drawn in every
        if not drawn and not (identification.further and anchor in _OF_ONE_LOG)
    ]
    plots = [plot for _, _, _, drawn in sections for plot in drawn]
    yield head(f"Friction of {identification.name}", policy=SCRIPT_POLICY)
    yield tables.header(identification)
    named = [(anchor, name) for anchor, name, _, _ in sections]
    chosen = tables.selection(identification)
    model = [("model", "Model selection")] if chosen else []
    logs = tables.joint(identification)
    if logs:
        model.insert(0, ("logs", "Logs"))
    yield contents([("parameters", "Parameters"), *model, *named, ("provenance", "Provenance")])
    yield "<main>\n"
    yield section("parameters", "Parameters", tables.parameters(identification))
    if logs:
        yield section("logs", "Logs", logs)
    if chosen:
        yield section("model", "Model selection", chosen)
    for anchor, name, lead, drawn in sections:
        yield section(anchor, name, _figures(anchor, lead, drawn))
    if missing:
        yield f'<p class="missing">{_NOT_DRAWN}{", ".join(missing).lower()}.</p>\n'
    yield section("provenance", "Notes and provenance", tables.provenance(identification))
    yield "</main>\n"
    yield tables.footer(identification)
    yield from ending_with(plots)


_Section = tuple[str, str, str, list[Plot] | None]


def _sections(identification: Identification) -> list[_Section]:
    """Return the sections with figures: anchor, heading, lead and drawings, None if not drawn."""
    found = identification
    return [
        (
            "friction",
            "Friction curve",
            "",
            None if found.curve is None else [curve_plot(found.curve, found)],
        ),
        (
            "energy",
            "Energy balance",
            "",
            None if found.energy is None else [balance_plot(found.energy, found)],
        ),
        (
            "evolution",
            "Evolution",
            "How each estimate settles as the log goes on, with its 95 % interval. A level that "
            "is reached and kept speaks for a law that fits the whole log; one that keeps "
            "drifting means that friction changes, or that the law lacks something. The axis is "
            "scaled to the settled part, the first guesses may lie outside.",
            None
            if found.evolution is None
            else evolution_plots(found.evolution, found.estimate, found.truth),
        ),
        (
            "residuals",
            "Residuals",
            "",
            None if found.residuals is None else residual_plots(found.residuals, found),
        ),
        (
            "motion",
            "Motion, measured and re-simulated",
            "",
            None if found.resimulation is None else [resimulation_plot(found.resimulation, found)],
        ),
    ]


def _figures(anchor: str, lead: str, drawn: list[Plot]) -> str:
    opening = f'<p class="lead">{lead}</p>\n' if lead else ""
    if anchor != "evolution":
        return opening + "".join(figure(plot, key(plot.traces)) for plot in drawn)
    shared = key([trace for plot in drawn for trace in plot.traces])
    body = "".join(figure(plot, "") for plot in drawn)
    return f'{opening}{shared}<div class="grid">\n{body}</div>\n'
