"""Time computations, and compare them in one table.

Comparisons show their progress in ``progress``, and take each measurement ``repetitions`` times.
"""

import gc
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from rich import box
from rich.console import Console
from rich.progress import Progress, TaskID
from rich.table import Table


def best_time(function: Callable[[], object], *, repetitions: int) -> float:
    """Return the shortest time [s] of several calls, after one that is not counted.

    The shortest is the one least disturbed by whatever else runs on the machine.
    """
    function()
    shortest = float("inf")
    collecting = gc.isenabled()
    gc.disable()
    try:
        for _ in range(repetitions):
            start = time.perf_counter()
            function()
            shortest = min(shortest, time.perf_counter() - start)
    finally:
        if collecting:
            gc.enable()
    return shortest


@dataclass(frozen=True, kw_only=True)
class Row:
    """One way to do it."""

    name: str  #: What was run.
    nanoseconds: float  #: Time an item.
    #: Largest error, in the comparison's unit, or None if there is nothing to compare with; nan if
    #: what came out is not finite.
    error: float | None
    ours: bool = False  #: Whether it is this package.
    size: int | None = None  #: Memory [B]; None where it does not matter.


class Rows:
    """Collects rows, with a mark on the progress bar for each.

    ``title`` is what the bar says before the first row, ``total`` the number of rows to come.
    """

    def __init__(self, progress: Progress, title: str, total: int) -> None:
        self.rows: list[Row] = []
        self._progress = progress
        self._task: TaskID = progress.add_task(title, total=total)

    def add(
        self,
        name: str,
        function: Callable[[], Any],
        items: int,
        *,
        error: Callable[[Any], float] | None = None,
        repetitions: int,
        ours: bool = False,
        size: int | None = None,
    ) -> Row:
        """Time a function that works through so many items."""
        self._progress.update(self._task, description=name)
        seconds = best_time(function, repetitions=repetitions)
        row = Row(
            name=name,
            nanoseconds=seconds / items * 1e9,
            error=None if error is None else error(function()),
            ours=ours,
            size=size,
        )
        self.rows.append(row)
        self._progress.advance(self._task)
        return row


@dataclass(frozen=True, kw_only=True)
class Target:
    """A number to reach."""

    text: str  #: What is measured, with its unit.
    #: In that unit.
    measured: float
    limit: float
    at_least: bool = False  #: Whether the limit is a lower one.

    @property
    def met(self) -> bool:
        """Whether the measured value is on the right side of the limit."""
        return self.measured >= self.limit if self.at_least else self.measured <= self.limit


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Results of one topic."""

    title: str  #: What was done, in a sentence.
    item: str  #: What the time is counted in, such as "sample".
    error_name: str | None  #: What the error is, with its unit, or None if no row has one.
    rows: tuple[Row, ...]  #: The first is what the others are compared with.
    targets: tuple[Target, ...] = ()  #: Numbers this package has set itself.

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as plain JSON types."""
        record = asdict(self)
        for row in record["rows"]:  # JSON has no nan
            if row["error"] is not None and not math.isfinite(row["error"]):
                row["error"] = str(row["error"])
        record["targets"] = [{**asdict(target), "met": target.met} for target in self.targets]
        return record


def print_comparison(comparison: Comparison, console: Console) -> None:
    """Print a comparison as one table, and its targets below."""
    table = Table(
        title=comparison.title, box=box.SIMPLE_HEAD, title_justify="left", show_edge=False
    )
    table.add_column("", no_wrap=True)
    table.add_column(f"µs a {comparison.item}", justify="right")
    table.add_column("times ours", justify="right")
    if comparison.error_name is not None:
        table.add_column(comparison.error_name, justify="right")
    sizes = any(row.size is not None for row in comparison.rows)
    if sizes:
        table.add_column("bytes", justify="right")
    unit = comparison.rows[0].nanoseconds
    for row in comparison.rows:
        ratio = row.nanoseconds / unit
        digits = 0 if ratio >= 100 else 2
        cells = [row.name, f"{row.nanoseconds / 1e3:.3g}", f"{ratio:,.{digits}f}"]
        if comparison.error_name is not None:
            cells.append("" if row.error is None else f"{row.error:.1e}")
        if sizes:
            cells.append("" if row.size is None else f"{row.size:,}")
        table.add_row(*cells, style="bold" if row.ours else None)
    console.print(table)
    for target in comparison.targets:
        word = "at least" if target.at_least else "at most"
        verdict = "met" if target.met else "NOT MET"
        console.print(
            f"  {target.text}: {target.measured:.3g} ({word} {target.limit:g}: {verdict})",
            style=None if target.met else "bold red",
        )
