"""The page of a reproduction: claims beside measurements, tables, and figures as pictures."""

import base64
import html
import re
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import NamedTuple

from stickslip.presentation.page import Markup, Page, Section, rendered
from stickslip.presentation.table import Table
from studies.van_de_wijdeven.page.conjunction_sections import conjunction_sections
from studies.van_de_wijdeven.page.energy_sections import energy_sections
from studies.van_de_wijdeven.page.pulse_sections import pulse_sections
from studies.van_de_wijdeven.records import (
    Claim,
    ConjunctionReproduction,
    EnergyReproduction,
    PulseReproduction,
    ReproducedFigure,
    Reproduction,
)

_SYMBOL = re.compile(r"\b([A-Za-zÂσ]\u0302?)_([a-z]+\d?(?:,max)?|\d)")
_PARTS = {"A": "part A", "B": "part B", "conjunction": "concluding remarks"}


def reproduction_page(reproduction: Reproduction, pictures: Mapping[str, bytes]) -> str:
    """Return a reproduction as one HTML page that works offline and on paper, without a script.

    ``pictures`` are the PNGs of the figures, by their numbers.
    """
    figures = "".join(_figure(each, pictures[each.number]) for each in reproduction.figures)
    return rendered(
        Page(
            title=reproduction.title,
            kicker=f"van de Wijdeven (2002), {_PARTS[reproduction.part]}",
            name=reproduction.title,
            lead=[Markup(_lead(reproduction))],
            sections=[
                Section("claims", "The source's claims", [Markup(_claims(reproduction.claims))]),
                *own_sections(reproduction),
                Section("figures", "Figures", [Markup(figures)]),
                Section("provenance", "Provenance", [_provenance(reproduction)]),
            ],
            version=reproduction.stickslip_version,
        )
    )


def own_sections(reproduction: Reproduction) -> tuple[Section, ...]:
    """Return the sections that only this part of the source has."""
    match reproduction:
        case EnergyReproduction():
            return energy_sections(reproduction)
        case PulseReproduction():
            return pulse_sections(reproduction)
        case ConjunctionReproduction():
            return conjunction_sections(reproduction)
        case _:
            return ()


class _Verdict(NamedTuple):
    """Claims that share a verdict, and how it is called."""

    anchor: str
    words: str
    claims: list[Claim]


def _verdicts(claims: Sequence[Claim]) -> list[_Verdict]:
    """Return the claims by verdict, those that differ first; one that there is none of, if rare."""
    partly = [each for each in claims if each.agrees_partly]
    differ = [each for each in claims if not (each.agrees or each.agrees_partly)]
    verdicts = [
        _Verdict("claims-that-differ", "differ", differ),
        _Verdict("claims-that-agree-partly", "agree in part of the readings", partly),
        _Verdict("claims-that-agree", "agree", [each for each in claims if each.agrees]),
    ]
    return [each for each in verdicts if each.claims is not partly or partly]


def _lead(reproduction: Reproduction) -> str:
    differ, *partly, agree = (
        f'<a href="#{each.anchor}">{len(each.claims)} {each.words}</a>'
        for each in _verdicts(reproduction.claims)
    )
    between = "".join(f", {each}" for each in partly)
    return (
        f"<p>{_prose(reproduction.setting)}</p>\n"
        f"<p>Of {len(reproduction.claims)} claims of the source, {agree} with what was measured"
        f"{between} and {differ}.</p>\n"
    )


def _claims(claims: Sequence[Claim]) -> str:
    """Return the claims in the source's order, those that differ before those that agree."""
    parts = [
        "<p>Every verdict is computed from the values and limits beside it, which are also in "
        "the JSON file.</p>\n"
    ]
    for anchor, words, there in _verdicts(claims):
        table = _claim_table(there) if there else "<p>None.</p>\n"
        parts.append(f'<h3 id="{anchor}">{len(there)} {words}</h3>\n{table}')
    return "".join(parts)


def _claim_table(claims: Sequence[Claim]) -> str:
    rows: list[str] = []
    for claim in claims:
        cells = (
            ("Measured", _measured(claim)),
            ("Verdict", _verdict(claim)),
            ("Why", _prose(claim.why)),
        )
        body = "".join(f'<td data-label="{label}"><div>{text}</div></td>' for label, text in cells)
        rows.append(
            f'<tr><th scope="row">{_prose(claim.statement)}'
            f"<span class='meaning'>{_prose(claim.place)}</span></th>{body}</tr>\n"
        )
    heads = "".join(
        f'<th scope="col">{name}</th>' for name in ("The source says", "Measured", "Verdict", "Why")
    )
    return (
        f'<table class="parameters claims"><thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{''.join(rows)}</tbody></table>\n"
    )


def _measured(claim: Claim) -> str:
    """Return each quantity with its limits, and its values by case."""
    blocks: list[str] = []
    for quantity, measures in groupby(claim.measures, key=lambda each: each.quantity):
        values = list(measures)
        limits = values[0].limits
        meaning = f"<span class='meaning'>{_prose(limits)}</span>" if limits else ""
        lone = len(values) == 1 and not values[0].case
        items = "".join(
            f'<li class="{("yes" if each.agrees else "no") if each.decides else ""}">'
            f"{_prose(f'{quantity if lone else each.case}: {each.value_text}')}"
            f"{meaning if lone else ''}</li>"
            for each in values
        )
        head = "" if lone else f"<div>{_prose(quantity)}{meaning}</div>"
        blocks.append(f'{head}<ul class="readings">{items}</ul>')
    return "".join(blocks)


def _verdict(claim: Claim) -> str:
    if claim.agrees:
        return '<span class="mark-yes">✓ agrees</span>'
    if claim.agrees_partly:
        return '<span class="mark-part">◐ partly</span>'
    return '<span class="mark-no">✗ differs</span>'


def _figure(figure: ReproducedFigure, picture: bytes) -> str:
    data = base64.b64encode(picture).decode("ascii")
    title = html.escape(f"Figure {figure.number}: {figure.title}")
    return (
        f'<figure id="figure-{figure.number}">'
        f'<img alt="{title}" src="data:image/png;base64,{data}">'
        f"<figcaption>{_prose(figure.caption)}</figcaption></figure>\n"
    )


def _provenance(reproduction: Reproduction) -> Table:
    return Table.of_facts(
        [
            ("stickslip", reproduction.stickslip_version),
            *((name, str(value)) for name, value in reproduction.options.items()),
            (
                "Source",
                "J. J. M. van de Wijdeven, Conjunction of “Energy-based approach for estimating "
                "Coulomb and viscous friction” and “Adaptive pulse amplitude pulse width control "
                "of systems subject to Coulomb and viscous friction”, Technische Universiteit "
                "Eindhoven, DCT 2002-29, 2002",
            ),
        ]
    )


def _prose(text: str) -> str:
    """Return plain text as HTML, with the indices of its symbols set low."""
    return _SYMBOL.sub(r"<i>\1</i><sub>\2</sub>", html.escape(text))
