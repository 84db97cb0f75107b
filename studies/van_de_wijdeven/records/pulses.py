"""Part B of the source, reproduced: its numbers, its runs, and controllers on random axes."""

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
from jaxtyping import Bool, Float, Int

from stickslip.records.record import Record
from studies.van_de_wijdeven.records.reproduction import Reproduction, form_with

_LEGEND = {
    "printed_numbers.printed": "the number as the source prints it",
    "printed_numbers.same_digits": "whether ours, rounded to the digits that the source prints, "
    "is the source's",
    "carried_runs": "consecutive runs, each beginning with the estimates and the covariance that "
    "the run before ended with",
    "carried_runs.longest_pulse": "t_p,max [s]; null: not bounded",
    "carried_runs.reading": "how the source is read where it can be read in two ways",
    "carried_runs.final_error": "the largest error of each run's last half second, with its sign "
    "[m]",
    "carried_runs.reached": "whether the axis was at rest within the tolerance at the end of it",
    "carried_runs.time": "from the start of each run to rest within the tolerance [s]; null: never",
    "carried_runs.pulses": "that ended within each run",
    "carried_runs.reversed": "of these, how many pushed back, as the axis had overshot",
    "carried_runs.estimates": "at the end of each run, SI units: pulse_gain b [m/s^2], "
    "coulomb_friction f_c [N]",
    "controller_scores.within_tolerance": "share of the axes that were within the tolerance all "
    "the time in which they were watched at the end [1]",
    "controller_scores.hunting": "share of the axes that were still moved to and fro at the end "
    "[1]",
    "controller_scores.median_error": "of the axes' final errors, absolute [m]; likewise error_95, "
    "that 95 % of them do not exceed, and worst_error",
    "controller_scores.median_time": "until the error stayed within the tolerance [s], of the axes "
    "on which it did; null: of none",
    "controller_scores.median_pulses": "until then; null: the controller gives no pulses, or "
    "reached the tolerance on none of the axes",
    "controller_scores.peak_effort": "largest effort over the axis's limit [1]",
    "how_compared": "how those controllers were tuned that needed it",
    "resolution_scores": "the controller of exact pulses on the mass of Table 1, asked for the "
    "step of its encoder [m]: friction_change is the standard deviation by which friction changes "
    "from pulse to pulse, over itself; smallest_step what a single pulse can do (Eq. 24) [m]; "
    "median_error and error_95 of the final errors [m]; within_a_step the share that ended within "
    "a step of the encoder; still_moving the number that had not ended",
}


@dataclass(frozen=True, kw_only=True)
class PrintedNumber(Record):
    """A number of the source beside the same number computed."""

    json_form = ("place quantity printed value unit same_digits how",)

    place: str  #: Where the source prints it, such as ``"3.1"``.
    quantity: str  #: What it is.
    printed: str  #: As printed, with all its digits, such as ``"0.092"`` or ``"1.9e-4"``.
    value: float  #: The same, computed [unit].
    unit: str  #: Of both; ``"1"`` for a ratio.
    how: str  #: What it was computed from.

    @property
    def difference(self) -> float:
        """Difference of the source's number from ours, over ours [1]."""
        return float(self.printed) / self.value - 1.0

    @property
    def same_digits(self) -> bool:
        """Whether ours, rounded to the digits that the source prints, is the source's."""
        printed = Decimal(self.printed)
        step = Decimal(1).scaleb(int(printed.as_tuple().exponent))
        return Decimal(self.value).quantize(step) == printed


@dataclass(frozen=True, kw_only=True)
class CarriedRuns(Record):
    """Consecutive runs of one controller, each beginning with what the one before had learned."""

    json_form = (
        "controller reading longest_pulse final_error reached time pulses",
        "reversed=reversed_pulses estimates",
    )

    controller: str  #: Which one.
    reading: str  #: How the source is read, where it can be read in two ways.
    longest_pulse: float | None  #: The bound t_p,max of its pulse widths [s]; None for none.
    #: The largest error of each run's last half second, with its sign, shape (runs,) [m].
    final_error: Float[np.ndarray, " runs"]
    #: Whether the axis rested within the tolerance at the end of it, shape (runs,).
    reached: Bool[np.ndarray, " runs"]
    #: From the start of each run to that rest, NaN where it never came, shape (runs,) [s].
    time: Float[np.ndarray, " runs"]
    #: Pulses that ended within each run, and how many of them pushed back, shape (runs,).
    pulses: Int[np.ndarray, " runs"]
    reversed_pulses: Int[np.ndarray, " runs"]
    #: At the end of each run by name, shape (runs,) each [SI].
    estimates: Mapping[str, Float[np.ndarray, " runs"]]


@dataclass(frozen=True, kw_only=True)
class ControllerScore(Record):
    """How one controller does on many random axes."""

    controller: str  #: Its name, and its tuning if nothing else states it.
    axes: int  #: How many it was tried on.
    #: Share of them that were within it all the time while watched at the end [1].
    within_tolerance: float
    hunting: float  #: Share of them that were still moved to and fro at the end [1].
    #: Of the absolute final errors: the median, what 95 % do not exceed, and the largest [m].
    median_error: float
    error_95: float
    worst_error: float
    #: Until the error stayed within the tolerance, of the axes on which it did [s]; None if there
    #: was none.
    median_time: float | None
    #: Until then, of these axes [1]; None if there was none, or the controller gives no pulses.
    median_pulses: float | None
    peak_effort: float  #: Largest effort over the axis's limit [1].


@dataclass(frozen=True, kw_only=True)
class ResolutionScore(Record):
    """How near the target an axis is brought that is asked for the step of its encoder."""

    encoder_step: float  #: Of the encoder, which is also the tolerance [m].
    static_ratio: float  #: Static over Coulomb friction [1].
    #: Standard deviation by which the friction changes from pulse to pulse, relative to it [1].
    friction_change: float
    sampling_time: float  #: Shortest pulse [s].
    axes: int  #: How many runs there were, from starts of their own.
    smallest_step: float  #: That a single pulse can cause (Eq. 24) [m].
    #: Of the absolute final errors: the median, and what 95 % do not exceed [m].
    median_error: float
    error_95: float
    within_a_step: float  #: Share of runs that ended within a step of the encoder [1].
    median_pulses: float  #: Until they ended [1].
    still_moving: int  #: Runs that had not ended.


@dataclass(frozen=True, kw_only=True)
class PulseReproduction(Reproduction):
    """Part B of the source, reproduced."""

    part, own_legend = "B", _LEGEND
    json_form = form_with(
        "printed_numbers carried_runs controller_scores how_compared resolution_scores"
    )

    printed_numbers: tuple[PrintedNumber, ...]  #: The source's numbers beside ours.
    carried_runs: tuple[CarriedRuns, ...]  #: Every case that was simulated, ten runs each.
    controller_scores: tuple[ControllerScore, ...]  #: Controllers on random axes.
    how_compared: str  #: How those were tuned that needed it, in words.
    resolution_scores: tuple[ResolutionScore, ...]  #: How near the target pulses bring an axis.
