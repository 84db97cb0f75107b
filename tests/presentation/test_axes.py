"""The axes of a log in one table and on one page."""

from dataclasses import replace

import pytest
from terminals import printed_on

from stickslip.presentation.axes import axes_page, axes_table
from stickslip.presentation.page import Listed, rendered
from stickslip.presentation.terminal import print_axes
from stickslip.records import AxesIdentification, Identification, Status

CAUSE = "25 % of the effort is explained by no term; check the columns"


def mismatched(found: Identification) -> Identification:
    """Return an identification with parameters that are missing and a known cause."""
    diagnostics = replace(found.estimate.diagnostics, notes=(CAUSE, "a note"))
    status = Status.MODEL_MISMATCH
    return replace(found, estimate=replace(found.estimate, status=status, diagnostics=diagnostics))


def test_the_reason_for_a_mismatch_is_its_cause(doubtful: Identification) -> None:
    found = AxesIdentification(name="robot", axes={"a": mismatched(doubtful), "b": doubtful})
    reasons = printed_on(120, print_axes, found).split("Not to be trusted:")[1]
    assert f"a: {CAUSE}\n" in reasons
    assert "b: Mass" in reasons
    page = axes_page(found)
    first = [next(b for b in each.blocks if isinstance(b, Listed)) for each in page.sections[1:]]
    assert first[0].sentences == [CAUSE]
    assert CAUSE not in " ".join(first[1].sentences)
    assert CAUSE in rendered(page)


@pytest.mark.parametrize(
    ("read", "unread", "expected"),
    [
        (["1", "3", "10"], ["2", "4"], ["1", "2", "3", "4", "10"]),
        (["base", "elbow"], ["arm"], ["base", "elbow", "arm"]),
        (["j1", "c 1", "j3"], ["c 2", "j2"], ["j1", "c 1", "j2", "c 2", "j3"]),
    ],
)
def test_numbered_axes_are_in_their_order(
    read: list[str], unread: list[str], expected: list[str], identification: Identification
) -> None:
    found = AxesIdentification(
        name="robot",
        axes=dict.fromkeys(read, identification),
        unread=dict.fromkeys(unread, "it does not move"),
    )
    assert [row[0] for row in axes_table(found).rows] == expected
