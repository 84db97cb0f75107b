"""Tuning constants of the search for pulse series."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class SeriesTuning:
    """Tuning of the search for pulse series.

    The plans are those of linear programmes whose bounds are proven, so that a value changes how
    much work a search takes and how near to its bound it ends, not whether a plan is right.
    Sensitivities are those of 40 random moves of arms, 11 of them impossible, at half and at twice
    the value (at 0.99 for shares above one half): the work, in entries of the matrices, over that
    with the values here. No move gained or lost its plan, and a plan changed by at most 0.2 % in
    its number of pulses and 0.6 % in its impulse in the mean. Values without an effect bound the
    work in cases that did not occur.
    """

    blocks: int = 64  #: Blocks of equal effort in the first programme [-]. Work 1.00, 1.08.
    rough_blocks: int = 40  #: Blocks in the search for the number of pulses [-]. Work 0.97, 1.18.
    rest_gap: float = 2.0
    """Largest distance of instants that belong to one rest of mass 1 [first blocks]. Work 1.11,
    1.00."""
    farthest_reach: float = 100.0
    """Bound of the travel in the search for the number of pulses [travel to the target]. Work
    1.00, 1.00."""
    accepted_share: float = 0.1
    """Velocity accepted between the instants that are constrained [least velocity]. Work 0.99,
    1.08."""
    max_rounds: int = 25  #: Programmes of one search at most [-]. Work 1.00, 1.00.
    max_blocks: int = 450
    """Blocks of a programme at most [-]: one with more takes seconds. Work 1.02, 1.00."""
    extra_work: float = 1e5
    """Work added where a solution lacks only velocity at some instants [matrix entries]. Work
    1.00, 1.00."""
    single_share: float = 0.35
    """Blocks over pulses beyond which single pulses take less work than further rounds [-]. Work
    1.00, 1.01."""
    divided_share: float = 0.8
    """Share of the possible gain that the blocks to be divided account for [-]. Work 1.10, 0.92."""
    max_turns: int = 2
    """Turns at which a block is cut at most [-]: with more, its pulses are nearly alike. Work
    1.03, 1.00."""
    cut_part: int = 6
    """A block is cut this part of its length before and after a turn, too [-]. Work 1.00, 1.00."""
    violation: float = 1e-8
    """Violation of the constraints that proves that there is no solution [travel, mean speed].
    Work 1.00, 1.00."""
    rounding: float = 1e-9
    """Largest effect of rounding errors [travel; effort limit]. Work 1.00, 1.00."""
    instants_at_once: int = 24
    """Instants that become constraints in one round, besides the minima, about [-]. Work 0.99,
    1.09."""
    slow_share: float = 0.05
    """Velocity below which the begin of a new block is constrained [highest velocity]. Work
    1.04, 0.93."""

    proof_work: float = 4e5
    """Work of one search that is to prove what can be proven [matrix entries, about 1 us each].
    Work 1.00, 1.00."""
    search_work: float = 4e4
    """Work of one search that is to find some solution [matrix entries]. Work 0.98, 1.02."""
    refusal_work: float = 2e4
    """Work of one trial for the reason of a refusal, which is guessed and not proven [entries].
    Work 1.00, 1.00."""
    clearance: float = 1e-6
    """Distance of an effort from what it must exceed [effort limit]. Work 1.00, 1.00."""
    longest: float = 10.0
    """Longest series tried [rough guess of the shortest time]. Work 1.09, 1.01."""
    rough_trials: int = 8  #: Trials for the rough number of pulses at most [-]. Work 1.09, 1.00.
    rough_accuracy: float = 0.01
    """Relative accuracy of the rough number of pulses [-]. Work 1.02, 1.02."""
    first_stride_part: int = 64
    """The first stride from the rough number of pulses is this part of it [-]. Work 1.05, 1.00."""
    stride_growth: int = 3  #: Growth of a stride without success [-]. Work 0.98, 0.99.
    max_proofs: int = 3
    """Trials that are to prove fewer pulses impossible, at most [-]. Work 1.00, 1.00."""
    freeing_pulses: int = 64
    """First pulses within which mass 1, once freed, may come to rest beyond the target [-]. Work
    1.00, 1.00."""
    max_stronger: float = 128.0
    """Largest effort limit tried for the reason of a refusal [effort limit]. Work 1.00, 1.00."""
    effort_accuracy: float = 1.05
    """Ratio within which the effort is determined that would be enough [-]. Work 1.00, 1.00."""

    creep_share: float = 0.02
    """Velocity below which mass 1 creeps [highest velocity]. Work 1.00, 1.01."""
    min_rest_pulses: int = 4  #: Pulses of the shortest rest on the way [-]. Work 1.00, 1.00.
    min_rest: float = 0.3
    """Swing of mass 2 in the shortest rest on the way [rad]: what creeps less comes to no stop."""
    least_before_rest: float = 0.05  #: Way to a rest at least [travel].
    rest_trials: int = 8  #: Pulses tried as the begin of a rest at most [-]. Work 1.00, 1.00.
    earlier_pulses: int = 3
    """Pulses by which the second part may begin before the end of the creeping [-]. Work 1.00,
    1.00."""
    held_share: float = 0.9
    """Share of static friction that may hold mass 1 [-]: a margin for its error."""


TUNING = SeriesTuning()
