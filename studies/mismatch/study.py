"""Run the study: record, identify, judge, and save."""

import os
import signal
import sys
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from stickslip.outputs import write_whole
from stickslip.tasks import write_json
from studies.mismatch.cases import CASES
from studies.mismatch.summary import markdown, summarize

SCHEMA_VERSION = 1

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True, kw_only=True)
class Study:
    """Cases and options of a study."""

    cases: tuple[str, ...] = tuple(CASES)  #: Names of cases.
    #: Recordings a case [-]; their seeds are ``first_seed``, ``first_seed + 1``, ...
    runs: int = 100
    first_seed: int = 0  #: Seed of the first recording [-].
    processes: int = 2  #: Number of processes [-]; 1 runs in this one.
    options: Mapping[str, Any]  #: Keyword arguments for ``identify`` in every run.

    @property
    def tasks(self) -> list[tuple[str, int]]:
        """Case and seed of every run."""
        seeds = range(self.first_seed, self.first_seed + self.runs)
        return [(case, seed) for case in self.cases for seed in seeds]


def run_study(study: Study) -> tuple[list[dict[str, Any]], bool]:
    """Run a study with a progress bar.

    Return the runs that ended, in the order of the tasks, and whether these are all.
    """
    runs: list[dict[str, Any]] = []
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    complete = False
    with Progress(*columns, disable=not sys.stderr.isatty()) as progress:
        bar = progress.add_task("identifying", total=len(study.tasks))
        try:
            for run in _outcomes(study):
                runs.append(run)
                critical = sum(bool(r.get("critical")) for r in runs)
                progress.update(bar, advance=1, description=f"{run['case']} ({critical} critical)")
            complete = True
        except KeyboardInterrupt:
            progress.console.print("stopped; what has ended is saved")
        except BrokenProcessPool as error:
            progress.console.print(f"a process ended: {error}; what has ended is saved")
    order = {task: k for k, task in enumerate(study.tasks)}
    runs.sort(key=lambda run: order[run["case"], run["seed"]])
    return runs, complete


def _outcomes(study: Study) -> Iterator[dict[str, Any]]:
    """Yield the runs as they end."""
    from studies.mismatch.judgement import judge_run

    if study.processes == 1:
        for case, seed in study.tasks:
            yield judge_run(case, seed, study.options)
        return
    with _single_threads(), _pool(study.processes) as pool:
        futures = [pool.submit(judge_run, *task, study.options) for task in study.tasks]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


@contextmanager
def _single_threads() -> Generator[None]:
    """Let each new process compute in one thread."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _pool(processes: int) -> ProcessPoolExecutor:
    # Only the parent handles Ctrl-C; the workers end with it.
    return ProcessPoolExecutor(
        processes,
        mp_context=get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )


def save(
    folder: Path, study: Study, runs: Sequence[Mapping[str, Any]], *, complete: bool, command: str
) -> tuple[Path, Path]:
    """Write ``results.json`` and ``table.md``, with the command line, and return both files."""
    import stickslip

    summary = summarize(runs)
    document = {
        "schema": SCHEMA_VERSION,
        "study": "mismatch",
        "command": command,
        "complete": complete,
        "stickslip_version": stickslip.__version__,
        "seeds": [study.first_seed, study.first_seed + study.runs - 1],
        "options": dict(study.options),
        "summary": summary,
        "runs": list(runs),
    }
    folder.mkdir(parents=True, exist_ok=True)
    results, table = folder / "results.json", folder / "table.md"
    write_json(document, results)
    title = "Model mismatch" if complete else "Model mismatch (incomplete)"
    write_whole(table, markdown(summary, title).encode())
    return results, table
