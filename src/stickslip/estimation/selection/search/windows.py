"""Windows that are wide enough for the noise of the positions."""

import numpy as np

from stickslip.estimation.fit.diagnostics import LEAST_SIGNAL_TO_NOISE
from stickslip.estimation.prepare import PreparedLog
from stickslip.estimation.selection.model import Model
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.selection.significance import Basis
from stickslip.estimation.weak_form.motion import SlipMotions
from stickslip.estimation.weak_form.rows import WindowRows, window_rows
from stickslip.estimation.weak_form.windows import Weight

_WIDER = 1.3  # ratio of one half-width to the one before [-]


def window_weight(log: PreparedLog, motions: SlipMotions, tuning: SearchTuning) -> Weight:
    """Return the weight of the windows of a log, for its kind of effort."""
    return Weight(
        half_width=half_width(motions, log.sampling_time, tuning),
        sampling_time=log.sampling_time,
        lead=log.effort_lead,
        averaged=log.averaged_effort,
    )


def half_width(motions: SlipMotions, sampling_time: float, tuning: SearchTuning) -> int:
    """Return half of the width of windows that is wide enough for the noise of the positions.

    Noise of the position is noise of a regressor, worst at high frequencies. It attenuates the
    inertia by its share of the acceleration beyond the other columns and the position. If it also
    makes most of the residual, wider windows have smaller errors, as long as they cover the moves.
    """
    # No window is wider than a stretch: a unit of time that is wrong would need any number of taps
    longest = max((motion.position.size for motion in motions.stretches), default=0)
    shortest = min(round(tuning.shortest_window / sampling_time), longest)
    half = max(tuning.fewest_samples, shortest)
    quiet = 0.0  # time that the narrowest windows without attenuation cover
    kept = 0  # half of the widest of those that cover as much
    while True:
        weight = Weight(half_width=half, sampling_time=sampling_time)
        model = Model(rows=window_rows(motions.stretches, weight), inertia=None)
        wider = int(_WIDER * half) + 1
        if model.rows.size < tuning.fewest_rows:
            return kept or half
        # With a spring: in a sinusoidal motion its column is that of the inertia
        beside = np.column_stack([model.base()[:, 1:], model.rows.position])
        content = float(np.sum(Basis.of(beside, model.rows.acceleration).residual ** 2))
        noise = motions.noise_of(weight.second())
        if model.rows.size * noise**2 <= tuning.largest_attenuation * content:
            covered = model.rows.size * weight.duration
            quiet = quiet or covered
            if covered < tuning.least_coverage * quiet:
                return kept
            if not _encoder_bound(model, noise, tuning):
                return half
            kept = half
        widest = tuning.widest_encoder_window if quiet else tuning.widest_window
        if wider * sampling_time > widest:
            return half
        half = wider


def noisy_elasticity(rows: WindowRows, motions: SlipMotions) -> bool:
    """Return whether the fourth derivative of the position is mostly noise."""
    noise = motions.noise_of(rows.weight.fourth())
    return float(np.sqrt(np.mean(rows.snap**2))) < LEAST_SIGNAL_TO_NOISE * noise


def _encoder_bound(model: Model, noise: float, tuning: SearchTuning) -> bool:
    """Return whether noise of the positions makes most of the residual of the plain model.

    ``model`` has no terms; ``noise`` is that of an acceleration [m/s^2 or rad/s^2].
    """
    left = float(np.sum(model.residual() ** 2))
    return bool(model.rows.size * (model.solution[0] * noise) ** 2 > tuning.encoder_share * left)
