"""Cramer-Rao bound of a log with effort noise, disturbance forces and sensor noise."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from stickslip.estimation.likelihood.bound import CramerRaoBound
from stickslip.estimation.likelihood.process_noise.problem import parts_of, problem_of
from stickslip.estimation.likelihood.process_noise.search import evaluate, inverted
from stickslip.estimation.likelihood.process_noise.tuning import Tuning
from stickslip.records import AxisLog, InputError, unit_of

__all__ = ["NoiseLevels", "process_noise_bound"]

_SURELY_SLIPPING = 0.003  # of the largest speed: a log without noise shows the direction
_NEGLIGIBLE = 1e-6  # of the effort's rms: a noise of zero has no logarithm
_DIFFUSE = 100.0  # s^-1, relative rate of change of an effort that nothing is known of


@dataclass(frozen=True, kw_only=True)
class NoiseLevels:
    """Noise of a log and forces on its axis.

    Attributes
    ----------
    effort
        Standard deviation of the white noise of the logged effort [N or N m].
    white_force
        Of a white disturbance force, held over each sample [N or N m].
    correlated_force
        Of an autoregressive disturbance force [N or N m].
    time_constant
        Its correlation time [s].
    position
        Of the measured position; step/sqrt(12) of an encoder [m or rad].
    velocity
        Of the measured velocity [m/s or rad/s]; without effect if none is measured.
    """

    effort: float
    white_force: float = 0.0
    correlated_force: float = 0.0
    time_constant: float = 0.1
    position: float
    velocity: float = 1.0


def process_noise_bound(
    true_log: AxisLog,
    parameters: Mapping[str, float],
    noise: NoiseLevels,
    *,
    known: Mapping[str, float] | None = None,
) -> CramerRaoBound:
    """Return the Cramer-Rao bound of the parameters of a rigid axis under process noise.

    The Fisher information is that of the innovations while the axis slips. Noise levels are known;
    nothing is known beforehand of the true effort, which may come from any controller, nor of the
    first state of each stretch in one direction.

    Parameters
    ----------
    true_log
        True motion and true effort of the axis, without noise.
    parameters
        True values of the parameters that are sought, by name [SI].
    noise
        Noise levels.
    known
        Values of the parameters that are known, by name [SI]; None for none.

    Returns
    -------
    The bound.

    Raises
    ------
    InputError
        If the axis does not slip in the log, or there is neither effort nor position noise.
    """
    tuning = Tuning(min_speed_ratio=_SURELY_SLIPPING, speed_certainty=0.0)
    problem = problem_of(
        parts_of(true_log),
        true_log.kind,
        true_log.sampling_time,
        sought=tuple(parameters),
        known=known or {},
        tuning=tuning,
    )
    if problem is None:
        raise InputError("the axis does not slip in this log", remedy="give a log of a motion")
    if noise.effort <= 0 or noise.position <= 0:
        raise InputError(
            f"the effort noise is {noise.effort:g} and the position noise {noise.position:g}",
            remedy="give positive values: what is measured exactly has no bound",
        )
    segments = [replace(s, feedback=np.zeros_like(s.feedback)) for s in problem.segments]
    size = float(np.sqrt(np.mean(true_log.effort**2)))
    least = _NEGLIGIBLE * size
    variances = [
        noise.position**2,
        noise.effort**2,
        (_DIFFUSE * size) ** 2 / true_log.sampling_time,
        max(noise.white_force, least) ** 2,
        max(noise.correlated_force, least) ** 2,
        noise.time_constant,
    ]
    if true_log.measured_velocity is not None:
        variances.append(noise.velocity**2)
    values = np.array(list(parameters.values()))
    found = evaluate(replace(problem, segments=segments), values, np.log(variances), changes="none")
    information = found.gram[1:, 1:]
    return CramerRaoBound(
        names=tuple(parameters),
        information=information,
        covariance=inverted(information),
        units={name: unit_of(name, true_log.kind) for name in parameters},
    )
