"""Part A of the report, whole: computed, drawn, judged and written."""

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from stickslip import __version__
from stickslip.jobs import surrogate
from stickslip.jobs.json_file import json_text
from stickslip.outputs import check_output, files_at_once
from stickslip.records import InputError, Reproduction
from stickslip.report import picture, reproduction_page

__all__ = ["Reproduced", "reproduce_part_a"]

_FEWEST_RUNS = 5
_PAGE, _NUMBERS = "part-a.html", "part-a.json"
_STREAM = 2  # of the seeds; sequences and the Monte Carlo study have their own


@dataclass(frozen=True, kw_only=True)
class Reproduced:
    """A reproduction and where it was written.

    Attributes
    ----------
    reproduction
        What was reproduced.
    page, numbers
        The page and its numbers as JSON.
    pictures
        One PNG file a figure.
    """

    reproduction: Reproduction
    page: Path
    numbers: Path
    pictures: tuple[Path, ...]


def reproduce_part_a(
    folder: Path | str,
    *,
    runs: int = 20,
    seed: int = 1,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Reproduced:
    """Reproduce part A of the report: its figures, its tables, and its claims beside measurements.

    Writes ``part-a.html``, ``part-a.json`` and a PNG file for each of Figures 5.1-5.3 and 6.1-6.10
    into the folder, all of them or none.

    Parameters
    ----------
    folder
        Where the files go; made if it is missing.
    runs
        How often everything with noise is repeated: sequences of five runs of each case in each
        loop, and runs of the Monte Carlo study for each loop and noise.
    seed
        Of all noise. The results depend on it and on ``runs`` alone.
    workers
        How many runs are worked on at once; None takes one for each processor.
    progress
        Called with the number of pieces of work that are done, and of all.

    Returns
    -------
    What was reproduced, and the files.

    Raises
    ------
    InputError
        If no folder is named, there are too few runs, the seed is negative, there is no worker, or
        nothing can be written in the folder.
    """
    if not str(folder):
        raise InputError(
            "the folder for the reproduction has no name",
            remedy="name one, or give . for the current folder",
        )
    if runs < _FEWEST_RUNS:
        raise InputError(
            f"runs is {runs}, from fewer than {_FEWEST_RUNS} nothing can be concluded",
            remedy=f"give {_FEWEST_RUNS} or more",
        )
    if seed < 0:
        raise InputError(f"seed is {seed}, it must not be negative", remedy="give 0 or more")
    if workers is None:
        workers = os.cpu_count() or 1
    if workers < 1:
        raise InputError(f"workers is {workers}, there must be one", remedy="give 1 or more")
    place = Path(folder)
    with files_at_once(place, what="the reproduction") as scratch:
        for name in (_PAGE, _NUMBERS):
            check_output(place / name, what="the reproduction")
        reproduction = _computed(runs, seed, workers, progress or (lambda _done, _all: None))
        drawn = {each.number: picture(each) for each in reproduction.figures}
        for figure in reproduction.figures:
            (scratch / figure.file_name).write_bytes(drawn[figure.number])
        (scratch / _NUMBERS).write_text(_numbers(reproduction), encoding="utf-8")
        (scratch / _PAGE).write_text(reproduction_page(reproduction, drawn), encoding="utf-8")
    return Reproduced(
        reproduction=reproduction,
        page=place / _PAGE,
        numbers=place / _NUMBERS,
        pictures=tuple(place / each.file_name for each in reproduction.figures),
    )


_LIST_OF_NUMBERS = re.compile(r"\[[-+.\de,\snul]+\]")


def _numbers(reproduction: Reproduction) -> str:
    """Return a reproduction as JSON, each list of numbers on one line."""
    text = json_text(reproduction.to_dict())
    return _LIST_OF_NUMBERS.sub(lambda found: " ".join(found[0].split()), text)


def _computed(
    runs: int, seed: int, workers: int, progress: Callable[[int, int], None]
) -> Reproduction:
    # Imported here, as the compiler behind them takes a second to load.
    from stickslip.jobs.reproduce.cases import CASES
    from stickslip.jobs.reproduce.evidence import (
        Evidence,
        interaction_of_terms,
        rest_of_the_arm,
        sampling_errors,
    )
    from stickslip.jobs.reproduce.expectations import absolute_value, expectation_figures
    from stickslip.jobs.reproduce.loop_claims import loop_claims
    from stickslip.jobs.reproduce.monte_carlo import NOISES, monte_carlo
    from stickslip.jobs.reproduce.noise_claims import noise_claims
    from stickslip.jobs.reproduce.parallel import in_parallel
    from stickslip.jobs.reproduce.run_figures import five_run_table, run_figures
    from stickslip.jobs.reproduce.runs import LOOPS, Loop, Trace, five_runs
    from stickslip.jobs.reproduce.sequences import (
        Sequences,
        digest,
        sequence_seeds,
        sequences_of,
    )
    from stickslip.jobs.reproduce.simulation_claims import simulation_claims

    pieces = runs + len(LOOPS) * len(NOISES) * runs
    done = 0

    def advance() -> None:
        nonlocal done
        done += 1
        progress(done, pieces)

    def sequence(number: int) -> dict[tuple[Loop, str], Trace]:
        seeds = sequence_seeds(seed, number)
        return {
            (loop, case.key): five_runs(loop, case, seeds) for loop, case in product(LOOPS, CASES)
        }

    def digested(number: int) -> dict[tuple[Loop, str], Sequences]:
        return digest(sequence(number))

    # The first sequence is drawn. It is made alone, so that its kernels are compiled once only.
    drawn = sequence(0)
    advance()
    others = in_parallel(
        [partial(digested, number) for number in range(1, runs)], workers=workers, advance=advance
    )
    generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_STREAM,)))
    evidence = Evidence(
        absolute_value=absolute_value(generator),
        interaction=interaction_of_terms(generator),
        rest=rest_of_the_arm(),
        sampling=sampling_errors(),
        sequences=sequences_of([digest(drawn), *others]),
        study=monte_carlo(runs, seed, workers=workers, advance=advance),
    )
    return Reproduction(
        title="Energy-based estimation of Coulomb and viscous friction",
        setting=f"Simulated with surrogate values, as Table 6.1 is lost: {surrogate.SETTING}. "
        f"{surrogate.LOOPS_SETTING}.",
        values=surrogate.setting_values(),
        figures=(
            *expectation_figures(),
            *(figure for loop in LOOPS for figure in run_figures(loop, drawn)),
        ),
        five_runs=five_run_table(drawn),
        variants=evidence.study.scores,
        claims=(
            *noise_claims(evidence),
            *simulation_claims(evidence),
            *loop_claims(evidence),
        ),
        options={"runs": runs, "seed": seed},
        stickslip_version=__version__,
    )
