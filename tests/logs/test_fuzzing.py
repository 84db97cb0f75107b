"""Damaged files of every format are read or refused; ``benchmarks.fuzzing`` reads many more."""

import sys

import pytest

from benchmarks.fuzzing import fuzz, written

MUTATIONS = 1000


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")
@pytest.mark.slow
def test_damaged_files_are_refused():
    import multiprocessing

    with multiprocessing.get_context("spawn").Pool(1) as pool:
        samples = pool.apply(written)
    *_, outcome = fuzz(samples, MUTATIONS, seed=3)
    assert outcome.faults == []
    assert outcome.counts.total() == MUTATIONS
    assert outcome.counts["read"] > 0
    assert outcome.largest < 1e9
