"""Forces that ripple along the way: which period stands out."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.regression.law_selection.friction_form import FrictionForm
from stickslip.estimation.regression.law_selection.linear_fit import fit_rows
from stickslip.estimation.regression.law_selection.smooth_motion import RowSettings
from stickslip.records import AxisLog, quantity_field

__all__ = ["ForceRipple", "force_ripple"]

_FEWEST_PERIODS = 8.0
"""Periods in the range of positions: fewer are not told apart from a law that bends."""

_PER_RESOLVED = 4
"""Wave numbers for each that the range of positions resolves."""

_REFINED = 41


@dataclass(frozen=True, kw_only=True)
class ForceRipple:
    """How much of the force that a law leaves over varies with each period of the way.

    Attributes
    ----------
    wave_number
        Periods a unit of way [1/m or 1/rad], shape (n,).
    amplitude
        Of the force that keeps its phase over all of the motion [N or N m], shape (n,).
    period
        Of the strongest [m or rad].
    """

    wave_number: Float[np.ndarray, " n"]
    amplitude: Float[np.ndarray, " n"] = quantity_field("effort")
    period: float = quantity_field("position")


def force_ripple(
    log: AxisLog, form: FrictionForm | None = None, rows: RowSettings | None = None
) -> ForceRipple:
    """Find the period of the force that ripples along the way of a moving axis.

    The amplitude at a wave number is that of the residual's projection on it, weighted by the way.

    Parameters
    ----------
    log
        Without gaps.
    form
        The law whose residual is looked at; per direction if None.
    rows
        How its motion is smoothed; what ripples faster than the cutoff is not seen.
    """
    rows = rows or RowSettings()
    form = form or FrictionForm(coulomb_per_direction=True, viscous_per_direction=True)
    motion = rows.motion(log)
    columns = form.columns(motion.position, motion.velocity)
    moving = np.abs(motion.velocity) > motion.slow
    moving[: motion.settling] = False
    table = np.column_stack([motion.acceleration, columns])[moving]
    fit = fit_rows(("inertia", *form.names), table, motion.effort[moving])
    residual = motion.effort[moving] - table @ list(fit.values.values())
    way = np.abs(motion.velocity[moving])
    x = motion.position[moving]
    weighted = residual * way / float(np.sum(way))
    resolved = 1.0 / float(np.ptp(x))
    fastest = 1.0 / (2.0 * log.sampling_time * motion.factor * float(np.median(way)))

    def amplitude(waves: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        return np.array(
            [2.0 * abs(np.sum(weighted * np.exp(-2j * np.pi * wave * x))) for wave in waves]
        )

    waves = np.arange(_FEWEST_PERIODS * resolved, fastest, resolved / _PER_RESOLVED)
    found = amplitude(waves)
    best = float(waves[int(np.argmax(found))])
    around = best + np.linspace(-1.0, 1.0, _REFINED) * resolved / _PER_RESOLVED
    return ForceRipple(
        wave_number=waves,
        amplitude=found,
        period=1.0 / float(around[int(np.argmax(amplitude(around)))]),
    )
