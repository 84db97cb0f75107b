"""All claims of part B, in the order of the source."""

import re

from studies.van_de_wijdeven.judging import judged
from studies.van_de_wijdeven.part_b.error_claims import ERROR_CLAIMS
from studies.van_de_wijdeven.part_b.estimate_claims import ESTIMATE_CLAIMS
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.form_claims import FORM_CLAIMS
from studies.van_de_wijdeven.part_b.judging import Row
from studies.van_de_wijdeven.part_b.law_claims import LAW_CLAIMS
from studies.van_de_wijdeven.part_b.pulse_claims import PULSE_CLAIMS
from studies.van_de_wijdeven.part_b.width_claims import WIDTH_CLAIMS
from studies.van_de_wijdeven.records import Claim


def _place(row: Row) -> tuple[float, int]:
    """Return where the source makes a claim: its section and its figure, 0 if it is in none."""
    section = re.match(r"\d(\.\d)?", row.place)
    figure = re.search(r"Figs?\. (\d)", row.place)
    return (
        float(section[0]) if section else 0.0,
        int(figure[1]) if figure else 0,
    )


PART_B_CLAIMS = tuple(
    sorted(
        (
            *LAW_CLAIMS,
            *WIDTH_CLAIMS,
            *FORM_CLAIMS,
            *ERROR_CLAIMS,
            *PULSE_CLAIMS,
            *ESTIMATE_CLAIMS,
        ),
        key=_place,
    )
)


def part_b_claims(evidence: Evidence) -> tuple[Claim, ...]:
    """Return the claims of part B with their verdicts."""
    return tuple(judged(row, evidence) for row in PART_B_CLAIMS)
