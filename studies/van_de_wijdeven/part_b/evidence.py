"""Everything that the claims of part B are judged by."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from stickslip.planning import PulseLaw
from studies.van_de_wijdeven.part_b.cases import (
    BOUNDED,
    CASES,
    COVARIANCE,
    PAPWC,
    READINGS,
    SMALL,
    UNBOUNDED,
    Key,
    papwc,
)
from studies.van_de_wijdeven.part_b.runs import Series, series_of
from studies.van_de_wijdeven.part_b.setting import (
    GUESS,
    PULSE_EFFORT,
    SAMPLING_TIME,
    START_ERROR,
    source_law,
)

FINER = (SAMPLING_TIME / 2.0, SAMPLING_TIME / 10.0)
"""Shorter sampling times [s]."""
GUESSES = (GUESS, 1.0, 1.5)
"""First guesses of the Coulomb friction, over the true one, that nothing is learned from [-]."""

_UNLEARNED = 1e-30  # P(0), so small that no pulse changes the estimates
_TIGHT = 1e-9  # a tolerance below every displacement [m]
PIECES = 2 * len(CASES) + len(READINGS[PAPWC]) * (len(FINER) + 4) + 1 + len(GUESSES)
"""Pieces of work of `gather`."""


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Measurements of part B."""

    law: PulseLaw  #: Of a pulse on the mass of Table 1.
    series: Mapping[Key, Series]  #: Ten runs of each case.
    #: The same, but with F(0) or P(0) laid anew before each run; only the estimates are carried.
    anew: Mapping[Key, Series]
    #: Ten runs of PAPWC without a bound, by reading and sampling time [s].
    finer: Mapping[tuple[str, float], Series]
    nearer: Series  #: Ten runs of PAPWC without a bound from half the distance, with P(0) = 1e-5 I.
    #: A run of PAPWC with a bound that learns nothing, by first guess.
    unlearned: Mapping[float, Series]
    #: A run of PAPWC with a bound and a tolerance below every displacement, by reading.
    tight: Mapping[str, Series]
    #: A run of PAPWC without a bound that learns as Eq. 22 is printed, by reading.
    printed: Mapping[str, Series]
    #: The same with the sign of Eq. 16, but still the nominal effort and width.
    nominal: Mapping[str, Series]
    #: Runs of PAPWC without a bound whose estimate is not kept in its range, until it leaves it, by
    #: reading.
    free: Mapping[str, Series]

    @property
    def gain(self) -> float:
        """The true b at full effort [m/s^2]."""
        return self.law.gain(PULSE_EFFORT)

    def by_bound(self, controller: str, reading: str) -> tuple[Series, Series]:
        """Return a controller's runs without a bound and with it."""
        return (
            self.series[controller, reading, UNBOUNDED],
            self.series[controller, reading, BOUNDED],
        )


def gather(advance: Callable[[], None]) -> Evidence:
    """Run everything; ``advance`` is called `PIECES` times."""

    def done(series: Series) -> Series:
        advance()
        return series

    unbounded = {
        reading: papwc(longest_width=UNBOUNDED, covariance=COVARIANCE[reading])
        for reading in READINGS[PAPWC]
    }
    bounded = {reading: replace(each, longest_width=BOUNDED) for reading, each in unbounded.items()}
    return Evidence(
        law=source_law(),
        series={case.key: done(series_of(case.first())) for case in CASES},
        anew={case.key: done(series_of(case.first(), keep_covariance=False)) for case in CASES},
        finer={
            (reading, T): done(series_of(replace(each, sampling_time=T)))
            for reading, each in unbounded.items()
            for T in FINER
        },
        nearer=done(series_of(replace(unbounded[SMALL], target=0.5 * START_ERROR))),
        unlearned={
            guess: done(
                series_of(papwc(longest_width=BOUNDED, covariance=_UNLEARNED, guess=guess), runs=1)
            )
            for guess in GUESSES
        },
        tight={
            reading: done(series_of(replace(each, tolerance=_TIGHT), runs=1))
            for reading, each in bounded.items()
        },
        printed={
            reading: done(
                series_of(replace(each, regressor="printed", friction_margin=None), runs=1)
            )
            for reading, each in unbounded.items()
        },
        nominal={
            reading: done(series_of(replace(each, regressor="nominal"), runs=1))
            for reading, each in unbounded.items()
        },
        free={
            reading: done(series_of(replace(each, friction_margin=None), last=_impossible))
            for reading, each in unbounded.items()
        },
    )


def _impossible(estimates: Mapping[str, float]) -> bool:
    """Return whether the estimated Coulomb friction is out of its range."""
    return not 0.0 < estimates["coulomb_friction"] < PULSE_EFFORT
