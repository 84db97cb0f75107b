"""Fixtures shared by all tests."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

_PLACES = "STICKSLIP_DATA, then ../shared/data beside the checkout"


@pytest.fixture(scope="session")
def benchmark_data() -> Callable[[str], Path]:
    """Return a function that finds a benchmark file or folder, or skips the test with a reason."""
    roots = [Path(__file__).parents[2] / "shared" / "data"]
    if "STICKSLIP_DATA" in os.environ:
        roots.insert(0, Path(os.environ["STICKSLIP_DATA"]))

    def find(name: str) -> Path:
        for root in roots:
            if (root / name).exists():
                return root / name
        pytest.skip(f"benchmark data {name!r} not found (looked in {_PLACES})")

    return find
