"""Run the benchmarks: ``python -m benchmarks [TOPIC ...] [--json FILE]``."""

import platform
from collections.abc import Callable
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Parameter
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from benchmarks import exported, fits, logs, loop, planning, pulses, recursion, simulator
from benchmarks.measuring import Comparison, print_comparison
from stickslip.tasks import write_json

TOPICS: dict[str, Callable[[Progress], list[Comparison]]] = {
    "simulator": simulator.compare,
    "recursion": recursion.compare,
    "pulses": pulses.compare,
    "loop": loop.compare,
    "logs": logs.compare,
    "planning": planning.compare,
    "fits": fits.compare,
    "exported": exported.compare,
}
"""To add one: a file with ``compare(progress) -> list[Comparison]``, and its name here."""

_COMPARED = (
    "numpy",
    "numba",
    "scipy",
    "mujoco",
    "padasip",
    "filterpy",
    "statsmodels",
    "pandas",
    "polars",
)

app = App(name="python -m benchmarks", help="Speed and accuracy beside other tools.")


@app.default
def run(
    *topics: Literal[
        "simulator", "recursion", "pulses", "loop", "logs", "planning", "fits", "exported"
    ],
    json_file: Annotated[Path | None, Parameter(name="--json")] = None,
    messages: int = logs.MESSAGES,
) -> None:
    """Run topics, all if none is named, and print a table of each.

    Parameters
    ----------
    topics
        What to compare.
    json_file
        Also write the results to this file.
    messages
        Joint states of the bag in topic logs; 2900000 make a file of 1 GB.
    """
    console = Console()
    versions = {name: metadata.version(name) for name in ("stickslip", *_COMPARED)}
    console.print(
        f"Python {platform.python_version()}, "
        + ", ".join(f"{name} {version}" for name, version in versions.items()),
        style="dim",
    )
    results: dict[str, list[Comparison]] = {}
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    run_topic = {**TOPICS, "logs": partial(logs.compare, messages=messages)}
    for topic in topics or TOPICS:
        with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
            results[topic] = run_topic[topic](progress)
        for comparison in results[topic]:
            print_comparison(comparison, console)
    if json_file is not None:
        record = {
            "schema": 1,
            "python": platform.python_version(),
            "machine": f"{platform.machine()} {platform.system()}",
            "versions": versions,
            "topics": {
                topic: [comparison.to_dict() for comparison in comparisons]
                for topic, comparisons in results.items()
            },
        }
        write_json(record, json_file)


if __name__ == "__main__":
    app()
