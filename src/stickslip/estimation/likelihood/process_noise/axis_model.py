"""Discrete model of a slipping axis with a disturbance force, and its derivatives.

While the axis slips in the direction s = +1 or -1,

    m v' = u - c v - s f_c - f_0 + d,    x' = v,

with u held over each sample and d a first-order autoregression, d(k+1) = r d(k) + w(k). Over a
sample of length T, with h = c T/m, p1 = (1 - exp(-h))/h and p2 = (1 - p1)/h,

    v(k+1) = exp(-h) v(k) + b_v F(k),               b_v = p1 T/m,
    x(k+1) = x(k) + p1 T v(k) + b_x F(k),           b_x = p2 T^2/m,

where F = u - s f_c - f_0 + d. An effort that acts by a fraction q of a sample later has its
previous value in the first part of the sample. The derivative by the delay is that of the smoothed
effort: that of the logged one is mostly its noise, which the innovations contain too.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

__all__ = ["STATES", "AxisModel", "Noise", "ParameterLayout"]

STATES = 3
"""Position, velocity and disturbance force."""

_SERIES_TERMS = 16  # of the exponential integrals; h < 1 leaves 1e-15


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Noise levels of a log.

    Attributes
    ----------
    force
        Standard deviation of the white force over a sample, that of the logged effort included
        [N or N m].
    disturbance
        Standard deviation of the autoregressive disturbance force [N or N m].
    time_constant
        Its correlation time: the autocorrelation falls to 1/e after it [s].
    position, velocity
        Standard deviations of the sensors' noise [m or rad, m/s or rad/s].
    """

    force: float
    disturbance: float
    time_constant: float
    position: float
    velocity: float


@dataclass(frozen=True, kw_only=True)
class ParameterLayout:
    """Places of the sought and known parameters.

    Attributes
    ----------
    sought
        Names of the parameters that are estimated, in the order of the columns; ``effort_delay`` is
        one of them if the delay is estimated.
    known
        Values of the others by name [SI].
    """

    sought: tuple[str, ...]
    known: dict[str, float]

    def value(self, base: str, direction: int, values: Float[np.ndarray, " p"]) -> float:
        """Return the value of a parameter in a direction of travel [SI]."""
        name = self.source(base, direction)
        if name is None:
            return 0.0
        return float(values[self.sought.index(name)]) if name in self.sought else self.known[name]

    def source(self, base: str, direction: int) -> str | None:
        """Return the name that holds a parameter in a direction of travel."""
        side = "_positive" if direction > 0 else "_negative"
        for name in (base, base + side):
            if name in self.sought or name in self.known:
                return name
        return None

    def column(self, base: str, direction: int) -> int | None:
        """Return the column of a parameter in a direction of travel, None if it is not sought."""
        name = self.source(base, direction)
        return self.sought.index(name) if name in self.sought else None


@dataclass(frozen=True, kw_only=True)
class AxisModel:
    """The model over a sample for each direction of travel: index 0 positive, 1 negative.

    Attributes
    ----------
    transition
        Shape (2, 3, 3).
    inputs
        Response of the states to the previous effort, the effort, 1 and the rate of change of the
        smoothed effort; row 0 of the second axis is the motion itself, the others are its
        derivatives by the parameters [SI], shape (2, 1 + p, 3, 4).
    transition_change
        Derivatives of the transition by the parameters [SI], shape (2, p, 3, 3).
    shift
        Whole samples that the effort acts late.
    force_response
        Response of the states to a force held over the sample, shape (2, 3).
    """

    transition: Float[np.ndarray, "2 s s"]
    inputs: Float[np.ndarray, "2 q s 4"]
    transition_change: Float[np.ndarray, "2 p s s"]
    shift: int
    force_response: Float[np.ndarray, "2 s"]

    @classmethod
    def of(
        cls,
        layout: ParameterLayout,
        values: Float[np.ndarray, " p"],
        *,
        mass_name: str,
        sampling_time: float,
        correlation: float,
    ) -> "AxisModel":
        """Return the model for values of the parameters.

        Parameters
        ----------
        layout
            Which parameters the values are.
        values
            [SI].
        mass_name
            ``"mass"`` or ``"inertia"``.
        sampling_time
            [s].
        correlation
            r, of the disturbance from sample to sample [-].
        """
        T, p = sampling_time, len(layout.sought)
        delay = layout.value("effort_delay", 1, values) / T
        shift = int(np.floor(delay))
        q = delay - shift
        transition = np.zeros((2, STATES, STATES))
        inputs = np.zeros((2, 1 + p, STATES, 4))
        response = np.zeros((2, STATES))
        change = np.zeros((2, p, STATES, STATES))
        for side, s in enumerate((1, -1)):
            m = layout.value(mass_name, s, values)
            c = layout.value("viscous_friction", s, values)
            load = s * layout.value("coulomb_friction", s, values)
            load += layout.value("offset", s, values)
            h = c * T / m
            p1, p2, p1_h, p2_h = _exponential_integrals(h)
            bv, bx = p1 * T / m, p2 * T * T / m
            transition[side] = [[1.0, p1 * T, bx], [0.0, 1.0 - h * p1, bv], [0.0, 0.0, correlation]]
            early, late = _split(q)
            scale = np.array([bx, bv, 0.0])
            response[side] = scale
            inputs[side, 0, :, :3] = np.column_stack([scale * early, scale * late, -scale * load])
            for base, h_by, inverse_by in (
                (mass_name, -h / m, -1.0 / m),
                ("viscous_friction", T / m, 0.0),
            ):
                j = layout.column(base, s)
                if j is None:
                    continue
                # Of the factor 1/m and of h in the integrals
                bv_by = bv * inverse_by + p1_h * h_by * T / m
                bx_by = bx * inverse_by + p2_h * h_by * T * T / m
                change[side, j] = [
                    [0.0, p1_h * h_by * T, bx_by],
                    [0.0, -(p1 + h * p1_h) * h_by, bv_by],
                    [0.0, 0.0, 0.0],
                ]
                by = np.array([bx_by, bv_by, 0.0])
                inputs[side, 1 + j, :, :3] = np.column_stack([by * early, by * late, -by * load])
            for base, sign in (("coulomb_friction", s), ("offset", 1)):
                j = layout.column(base, s)
                if j is not None:
                    inputs[side, 1 + j, :, 2] = -sign * scale
            j = layout.column("effort_delay", s)
            if j is not None:
                inputs[side, 1 + j, :, 3] = -scale
        return cls(
            transition=transition,
            inputs=inputs,
            transition_change=change,
            shift=shift,
            force_response=response,
        )


def _split(q: float) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, " s"]]:
    """Return the shares of a force in the first q of a sample, and in the rest of it.

    Of its effect on position, velocity and disturbance; without viscous friction.
    """
    early = np.array([2.0 * q - q * q, q, 0.0])
    return early, np.array([1.0, 1.0, 0.0]) - early


def _exponential_integrals(h: float) -> tuple[float, float, float, float]:
    """Return p1(h), p2(h) of the module, and their derivatives by h."""
    if abs(h) > 1.0:
        p1 = -np.expm1(-h) / h
        p2 = (1.0 - p1) / h
        p1_h = (np.exp(-h) - p1) / h
        return float(p1), float(p2), float(p1_h), float((-p1_h - p2) / h)
    # p1 = sum (-h)^k/(k+1)!,  p2 = sum (-h)^k/(k+2)!
    p1 = p2 = p1_h = p2_h = 0.0
    power, last, factorial = 1.0, 0.0, 1.0
    for k in range(_SERIES_TERMS):
        factorial *= k + 1
        p1 += power / factorial
        p2 += power / (factorial * (k + 2))
        p1_h -= k * last / factorial
        p2_h -= k * last / (factorial * (k + 2))
        last, power = power, -power * h
    return p1, p2, p1_h, p2_h
