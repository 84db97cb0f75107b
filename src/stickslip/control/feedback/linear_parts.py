"""The linear parts of a feedback loop: proportional and derivative action, and a notch."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from stickslip.compiled import compiled
from stickslip.control.checks import check_fields
from stickslip.records import InputError, non_negative, positive


@compiled(inline=True)
def pd_effort(K_p: float, K_d: float, r: float, x: float, r_dot: float, x_dot: float) -> float:
    """Return u = K_p (r - x) + K_d (r' - x') (van de Wijdeven 2002 A section 6.2)."""
    return K_p * (r - x) + K_d * (r_dot - x_dot)


@dataclass(frozen=True, kw_only=True)
class PD:
    """Proportional and derivative action on the errors of position and velocity.

    Both act on the driven mass: ``u = position_gain (r - x) + velocity_gain (r' - x')``. The
    velocity is the one that the sensors show, so nothing is differentiated here.

    Attributes
    ----------
    position_gain
        [N/m or N m/rad], positive.
    velocity_gain
        [N s/m or N m s/rad], not negative.

    Raises
    ------
    InputError
        If a gain is not finite or out of its range.

    Examples
    --------
    >>> PD(position_gain=2.0, velocity_gain=3.0).velocity_gain
    3.0
    """

    position_gain: float
    velocity_gain: float

    def __post_init__(self) -> None:
        check_fields(self, positive, {"position_gain": "N/m or N m/rad"})
        check_fields(self, non_negative, {"velocity_gain": "N s/m or N m s/rad"})


@compiled(inline=True)
def notch_step(n: Any, z1: float, z2: float, e: float) -> tuple[float, float, float]:
    """Return output and memory of a second-order filter (transposed direct form II).

    ``n`` has the coefficients by name, as `NotchCoefficients`.

    y(k) = b0 e(k) + z1(k), z1(k+1) = b1 e(k) - a1 y(k) + z2(k), z2(k+1) = b2 e(k) - a2 y(k).
    """
    y = n.b0 * e + z1
    return y, n.b1 * e - n.a1 * y + z2, n.b2 * e - n.a2 * y


class NotchCoefficients(NamedTuple):
    """Of ``(b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2)``; no unit.

    Attributes
    ----------
    b0, b1, b2
        Of the numerator [-].
    a1, a2
        Of the denominator [-].
    """

    b0: float
    b1: float
    b2: float
    a1: float
    a2: float


@dataclass(frozen=True, kw_only=True)
class Notch:
    """A second-order notch, sampled.

    ``H(s) = (s^2 + 2 depth damping w s + w^2) / (s^2 + 2 damping w s + w^2)``: the gain is
    ``depth`` at the angular frequency ``w``, where the phase is 0, and 1 far from it. It is sampled
    by Tustin's substitution, pre-warped at ``w``: gain and phase are exact there, and at all other
    frequencies they are those of ``H`` at ``(w / tan(w T / 2)) tan(W T / 2)`` in place of ``W``.

    Attributes
    ----------
    angular_frequency
        Centre [rad/s]; must be below pi over the sampling time it is used with.
    depth
        Gain at the centre [-], 0 to below 1.
    damping
        Damping ratio of the poles [-]; the notch is about ``2 damping`` centre frequencies wide.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> notch = Notch.at_resonance(
    ...     mass_1=1.0, mass_2=1.0, stiffness=1.0, depth=0.1, damping=0.5)
    >>> round(notch.angular_frequency, 6)
    1.414214
    """

    angular_frequency: float
    depth: float
    damping: float

    def __post_init__(self) -> None:
        check_fields(self, positive, {"angular_frequency": "rad/s", "damping": "(no unit)"})
        check_fields(self, non_negative, {"depth": "(no unit)"})
        if self.depth >= 1:
            raise InputError("not_below", name="depth", value=self.depth, limit=1.0, unit="-")

    @classmethod
    def at_resonance(
        cls, *, mass_1: float, mass_2: float, stiffness: float, depth: float, damping: float
    ) -> "Notch":
        """Return the notch at the resonance of an arm, ``sqrt(k (1/m1 + 1/m2))``.

        Parameters
        ----------
        mass_1, mass_2
            Driven mass and load [kg or kg m^2].
        stiffness
            Of the spring [N/m or N m/rad].
        depth, damping
            As of the class [-].
        """
        m1 = positive("mass_1", mass_1, "kg or kg m^2")
        m2 = positive("mass_2", mass_2, "kg or kg m^2")
        k = positive("stiffness", stiffness, "N/m or N m/rad")
        resonance = float(np.sqrt(k * (1.0 / m1 + 1.0 / m2)))
        return cls(angular_frequency=resonance, depth=depth, damping=damping)

    def coefficients(self, sampling_time: float) -> NotchCoefficients:
        """Return the filter sampled with a sampling time [s], which must suit its frequency.

        With ``K = w / tan(w T / 2)``, ``s = K (1 - 1/z) / (1 + 1/z)`` is put into ``H(s)``.
        """
        T = positive("sampling_time", sampling_time, "s")
        w = self.angular_frequency
        if w * T >= np.pi:
            raise InputError(
                "frequency_above_nyquist",
                part="notch",
                value=w,
                limit=np.pi / T,
                unit="rad/s",
                sampling_time=T,
            )
        # Over w^2: no overflow, whatever the unit of time
        K = 1.0 / np.tan(0.5 * w * T)
        poles = 2.0 * self.damping * K
        zeros = self.depth * poles
        scale = 1.0 / (K * K + poles + 1.0)
        middle = 2.0 * (1.0 - K * K) * scale
        return NotchCoefficients(
            b0=float((K * K + zeros + 1.0) * scale),
            b1=float(middle),
            b2=float((K * K - zeros + 1.0) * scale),
            a1=float(middle),
            a2=float((K * K - poles + 1.0) * scale),
        )
