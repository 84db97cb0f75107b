"""A logged effort that was clipped before noise was added to it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import ndimage

from stickslip.estimation.selection.model import Model
from stickslip.estimation.signals.kinematics import noise_level
from stickslip.estimation.weak_form.motion import SlipMotion, SlipMotions
from stickslip.records import AxisLog, share_text


@dataclass(frozen=True, kw_only=True)
class ClippingTuning:
    """Thresholds of the test whether a logged effort is clipped within its noise."""

    band: float = 8.0
    """Width of a plateau over the standard deviation of the effort's noise [-]: white noise of a
    constant effort exceeds four standard deviations once in 16 000 samples."""
    fewest_samples: int = 5  #: Consecutive samples [-] of a plateau.
    pile: float = 1.5
    """Samples of a plateau over those of the next band of the same width [-]. A smooth peak has 2.4
    times as many, as its width grows with the square root of the depth: most logs have a peak to
    test, and the motion decides. With 4, a fifth of the clipped logs are not found."""
    other_pile: float = 1.0  #: The same [-] of the other extreme, beside such a plateau.
    smallest_share: float = 2e-3  #: Share of the samples [-]: shorter plateaus change no estimate.
    fewest_others: float = 0.4
    """Share of the windows without the plateaus [-]: a plateau in most of them is friction."""
    smallest_excess: float = 0.02
    """Effort beyond the plateau that the motion needs there, relative to the level [-]."""
    deviations: float = 5.0
    """The same over the standard deviation of the effort that is left elsewhere [-]: with 2, logs
    whose gain changes have a plateau too."""
    agreeing: float = 0.8  #: Share of the windows on a plateau that need more effort [-].


@dataclass(frozen=True, kw_only=True)
class Plateaus:
    """Stretches at the largest and the smallest effort, wider than the peaks of a smooth one."""

    #: Lower end of the plateau of the largest efforts [N or N m]; infinite without one.
    lowest: float = np.inf
    #: Upper end of the plateau of the smallest efforts [N or N m]; minus infinite without one.
    highest: float = -np.inf

    @property
    def ends(self) -> list[float]:
        """Return the finite ends [N or N m]."""
        return [end for end in (self.highest, self.lowest) if np.isfinite(end)]

    def side(self, motion: SlipMotion) -> Float[np.ndarray, " n"]:
        """Return 1 and -1 for samples on the plateaus, 0 elsewhere."""
        upper, lower = motion.effort > self.lowest, motion.effort < self.highest
        return upper.astype(float) - lower.astype(float)


def plateaus(motions: SlipMotions, tuning: ClippingTuning) -> Plateaus:
    """Return the plateaus of a logged effort with noise.

    Without noise, samples at the extreme are equal, and the preparation of the log excludes them.
    """
    efforts = [m.effort[m.usable] for m in motions.stretches]
    width = tuning.band * noise_level(max(efforts, key=len, default=np.zeros(0)))
    tops = [max((float(np.max(s * e, initial=0.0)) for e in efforts), default=0.0) for s in (1, -1)]
    piles = [
        _pile([sign * e for e in efforts], top, width, tuning)
        for sign, top in zip((1, -1), tops, strict=True)
    ]
    if not max(piles) > tuning.pile:
        return Plateaus()
    ends = [
        t - width if p > tuning.other_pile else np.inf for t, p in zip(tops, piles, strict=True)
    ]
    return Plateaus(lowest=ends[0], highest=-ends[1])


def _pile(
    efforts: list[Float[np.ndarray, " _"]], top: float, width: float, tuning: ClippingTuning
) -> float:
    """Return the samples within a width of the top over those of the next such band [-].

    Zero if the width is no small part of the top, or these samples are few.
    """
    if not 0.0 < width < 0.5 * top:
        return 0.0
    structure = np.ones(tuning.fewest_samples, dtype=np.int64)
    count = sum(int(np.sum(ndimage.binary_opening(e > top - width, structure))) for e in efforts)
    below = sum(int(np.sum((e <= top - width) & (e > top - 2.0 * width))) for e in efforts)
    size = sum(e.size for e in efforts)
    return count / max(below, 1) if count > tuning.smallest_share * size else 0.0


def without_plateaus(
    motions: SlipMotions, found: Plateaus, log: AxisLog
) -> tuple[SlipMotions, str]:
    """Return the motions without the samples on the plateaus, and a note."""
    inside, share = motions.without(lambda m: found.side(m) != 0.0)
    return inside, (
        f"effort clipped at about {' and '.join(f'{end:.3g}' for end in found.ends)} "
        f"{log.unit('effort')}, within its noise, in {share_text(share)} of samples; "
        "samples excluded"
    )


def clipped(
    model: Model, motions: SlipMotions, found: Plateaus, tuning: ClippingTuning
) -> Plateaus:
    """Return the plateaus on which the motion needs more effort than is logged.

    The model is fitted to the windows without the plateaus. An effort that is constant at its
    extremes, as in an acceleration of constant size, needs no more.
    """
    every = model.over(motions)
    if model.rows.size <= tuning.fewest_others * every.rows.size:
        return Plateaus()
    rest = float(np.std(model.residual()))
    excess = every.columns() @ model.solution - every.target()
    side = every.rows.mean(found.side)

    def proven(sign: float, end: float) -> bool:
        needed = sign * excess[sign * side > 0.5]
        least = max(tuning.smallest_excess * abs(end), tuning.deviations * rest)
        return bool(
            needed.size and np.mean(needed) > least and np.mean(needed > 0.0) > tuning.agreeing
        )

    return Plateaus(
        lowest=found.lowest if proven(1.0, found.lowest) else np.inf,
        highest=found.highest if proven(-1.0, found.highest) else -np.inf,
    )
