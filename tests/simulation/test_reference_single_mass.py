"""The single mass against the 30-digit event-driven reference, in every stored case."""

import pytest
from against_reference import REFERENCE_TOLERANCE, largest_error, motion_of
from reference_cases import StoredRun, read

RUNS = read("single_mass")


@pytest.mark.parametrize("stored", RUNS, ids=lambda run: run.case.name)
def test_run_agrees_with_the_reference(stored: StoredRun) -> None:
    motion = motion_of(stored.case)
    assert largest_error(stored, motion) <= REFERENCE_TOLERANCE
    assert {k: bool(motion.stuck[k]) for k in stored.at_rest} == stored.at_rest
    assert motion.event_count == sum(stored.events.values())
