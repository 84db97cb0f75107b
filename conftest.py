"""Fixtures of all tests, and run-time checks of array shapes while they run."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import jaxtyping
import pooch
import pytest
from hypothesis import settings
from shape_checks import check_shapes, next_test

_ROOT = Path(__file__).parent
_PLACES = "STICKSLIP_DATA, then ../shared/data beside the checkout, then the user's cache"

# No deadline: a first call may compile. `make test` takes a few examples, the same in every run,
# `make test-all` new ones; the blob printed with a failure reproduces it.
settings.register_profile("brief", derandomize=True, deadline=None, max_examples=25)
settings.register_profile("repeat", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None, print_blob=True)
settings.load_profile("brief")


def _modules_without_kernels() -> list[str]:
    """Name every module whose annotations can be checked at run time.

    A kernel is handed to the compiler as it stands, so modules that hold kernels are left out, and
    so are packages, whose names would take in all the modules below them.
    """
    source = _ROOT / "src"
    return [
        ".".join(path.relative_to(source).with_suffix("").parts)
        for path in sorted(source.rglob("*.py"))
        if path.name != "__init__.py" and "compiled(" not in path.read_text()
    ]


check_shapes(_modules_without_kernels())


def pytest_runtest_setup() -> None:
    """Check the first calls of every function in every test."""
    next_test()


@pytest.fixture
def without_shape_checks() -> Iterator[None]:
    """Let wrongly shaped arrays through to the code's own validation, as they are for a user."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@pytest.fixture(scope="session")
def benchmark_data() -> Callable[[str], Path]:
    """Return a function that finds a benchmark file or folder, or skips the test with a reason."""
    cache = Path(pooch.os_cache("stickslip"))  # where `stickslip data` puts what it fetches
    roots = [_ROOT.parent / "shared" / "data", cache]
    if "STICKSLIP_DATA" in os.environ:
        roots.insert(0, Path(os.environ["STICKSLIP_DATA"]))

    def find(name: str) -> Path:
        for root in roots:
            if (root / name).exists():
                return root / name
        pytest.skip(f"benchmark data {name!r} not found (looked in {_PLACES})")

    return find
