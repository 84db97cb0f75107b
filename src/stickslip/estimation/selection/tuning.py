"""Tuning of the estimator that selects its model, by stage."""

from dataclasses import dataclass, field

from stickslip.estimation.selection.dwell import DwellTuning
from stickslip.estimation.selection.faults.change import ChangeTuning
from stickslip.estimation.selection.faults.clipping import ClippingTuning
from stickslip.estimation.selection.faults.nonlinear_gain import NonlinearGainTuning
from stickslip.estimation.selection.faults.saturation import SaturationTuning
from stickslip.estimation.selection.intervals.rival_law import RivalTuning
from stickslip.estimation.selection.intervals.widening import IntervalTuning
from stickslip.estimation.selection.judgement.plausibility import PlausibilityTuning
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.weak_form.motion import MotionTuning


@dataclass(frozen=True, kw_only=True)
class SelectionTuning:
    """Tuning of `SelectedModelEstimator`, by stage.

    Attributes
    ----------
    motion, search, clipping, saturation, rival, dwell, intervals, change, gain, plausibility
        Tuning of the stages.
    effort_kind_gain
        Relative decrease of the residual for which an effort with uneven time stamps is taken as
        sampled or a mean, and not as held [-]. On public logs it is 11 to 31 % if the kind is
        another one, and below 6 % otherwise.
    fewest_samples
        Samples in half a window [-], below which it matters with even time stamps whether an effort
        is held. At the angular frequency omega a sampled effort differs from it by
        (omega T)^2 / 24, and a mean by (omega T)^2 / 12.
    kind_delay
        Largest difference [samples] of the delay of a held effort from minus half a sample, which a
        sampled one has if it is taken as held, or from minus one, which a mean has.
    """

    motion: MotionTuning = field(default_factory=MotionTuning)
    search: SearchTuning = field(default_factory=SearchTuning)
    clipping: ClippingTuning = field(default_factory=ClippingTuning)
    saturation: SaturationTuning = field(default_factory=SaturationTuning)
    rival: RivalTuning = field(default_factory=RivalTuning)
    dwell: DwellTuning = field(default_factory=DwellTuning)
    intervals: IntervalTuning = field(default_factory=IntervalTuning)
    change: ChangeTuning = field(default_factory=ChangeTuning)
    gain: NonlinearGainTuning = field(default_factory=NonlinearGainTuning)
    plausibility: PlausibilityTuning = field(default_factory=PlausibilityTuning)
    effort_kind_gain: float = 0.1
    fewest_samples: int = 10
    kind_delay: float = 0.25
