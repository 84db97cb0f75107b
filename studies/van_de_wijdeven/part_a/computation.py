"""Part A of the source, whole: computed, judged, and put together."""

from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from stickslip import __version__
from stickslip.records import whole
from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.loops import LOOPS_SETTING, setting_values
from studies.van_de_wijdeven.records import EnergyReproduction
from studies.van_de_wijdeven.writing import Progress, Reproduced, counted, write_reproduction

_FEWEST_RUNS = 5
_STREAM = 2  # of the seeds; sequences and the Monte Carlo study have their own


def reproduce_part_a(
    folder: Path | str,
    *,
    runs: int = 20,
    seed: int = 1,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Reproduced:
    """Reproduce part A of the source: its figures, its tables, and its claims beside measurements.

    Writes ``part-a.html``, ``part-a.json`` and a PNG file for each of Figures 5.1-5.3 and 6.1-6.10
    into the folder, all of them or none. ``runs`` is the number of sequences of five runs of each
    case in each loop, and of runs of the Monte Carlo study for each loop and noise. The results
    depend on it and on the seed alone, not on ``workers``, one a processor by default. ``progress``
    is called with the number of pieces of work that are done, and of all. Bad arguments, and a
    folder in which nothing can be written, are an InputError.
    """
    whole("runs", runs, least=_FEWEST_RUNS)
    return write_reproduction(
        folder, "part-a", partial(_computed, runs), seed=seed, workers=workers, progress=progress
    )


def _computed(runs: int, seed: int, workers: int, progress: Progress) -> EnergyReproduction:
    # Imported here, as the compiler behind them takes a second to load.
    from stickslip.tasks.parallel import in_parallel
    from studies.van_de_wijdeven.judging import judged
    from studies.van_de_wijdeven.part_a.cases import CASES
    from studies.van_de_wijdeven.part_a.evidence import (
        Evidence,
        interaction_of_terms,
        rest_of_the_arm,
        sampling_errors,
    )
    from studies.van_de_wijdeven.part_a.expectations import absolute_value, expectation_figures
    from studies.van_de_wijdeven.part_a.loop_claims import LOOP_CLAIMS
    from studies.van_de_wijdeven.part_a.monte_carlo import NOISES, monte_carlo
    from studies.van_de_wijdeven.part_a.noise_claims import NOISE_CLAIMS
    from studies.van_de_wijdeven.part_a.run_figures import five_run_table, run_figures
    from studies.van_de_wijdeven.part_a.runs import LOOPS, Loop, Trace, five_runs
    from studies.van_de_wijdeven.part_a.sequences import (
        Sequences,
        digest,
        sequence_seeds,
        sequences_of,
    )
    from studies.van_de_wijdeven.part_a.simulation_claims import SIMULATION_CLAIMS

    pieces = runs + len(LOOPS) * len(NOISES) * runs
    advance = counted(progress, pieces)

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
    return EnergyReproduction(
        title="Energy-based estimation of Coulomb and viscous friction",
        setting=f"Simulated with surrogate values, as Table 6.1 is lost: {surrogate.SETTING}. "
        f"{LOOPS_SETTING}.",
        values=setting_values(),
        figures=(
            *expectation_figures(),
            *(figure for loop in LOOPS for figure in run_figures(loop, drawn)),
        ),
        five_runs=five_run_table(drawn),
        variants=evidence.study.scores,
        claims=tuple(
            judged(row, evidence) for row in (*NOISE_CLAIMS, *SIMULATION_CLAIMS, *LOOP_CLAIMS)
        ),
        options={"runs": runs, "seed": seed},
        stickslip_version=__version__,
    )
