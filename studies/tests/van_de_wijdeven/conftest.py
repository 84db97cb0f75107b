"""Run-time checks of array shapes in the studied code, and the evidence that several tests read."""

from pathlib import Path

import pytest
from shape_checks import check_shapes

_ROOT = Path(__file__).parents[3]


def _modules_without_kernels() -> list[str]:
    """Name the modules of the study whose annotations can be checked at run time."""
    return [
        ".".join(path.relative_to(_ROOT).with_suffix("").parts)
        for path in sorted((_ROOT / "studies" / "van_de_wijdeven").rglob("*.py"))
        if not path.name.startswith("__") and "compiled(" not in path.read_text()
    ]


check_shapes(_modules_without_kernels())

from studies.van_de_wijdeven.part_b.evidence import PIECES, Evidence, gather  # noqa: E402 - hooked


@pytest.fixture(scope="session")
def evidence() -> Evidence:
    """Return all that part B was measured to be, gathered once."""
    calls: list[None] = []
    gathered = gather(lambda: calls.append(None))
    assert len(calls) == PIECES
    return gathered
