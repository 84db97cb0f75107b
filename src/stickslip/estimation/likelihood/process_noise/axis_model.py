"""Discrete model of a slipping axis, its disturbance and its effort, and its derivatives.

While the axis slips in the direction s = +1 or -1,

    m v' = u + j - c v - s f_c - f_0 + d + w,    x' = v,

with the effort u + j, the disturbance force d and the white force w held over each sample. The
disturbance is a first-order autoregression, d(k+1) = r d(k) + w_d(k). Of the effort, j is the known
answer of the controller to the noise of the encoder, and u an integrated random walk,
u(k+1) = u(k) + T p(k), p(k+1) = p(k) + w_p(k). Over a sample of length T, with h = c T/m,
p1 = (1 - exp(-h))/h and p2 = (1 - p1)/h,

    v(k+1) = exp(-h) v(k) + b_v F(k),               b_v = p1 T/m,
    x(k+1) = x(k) + p1 T v(k) + b_x F(k),           b_x = p2 T^2/m,

where F = u + j - s f_c - f_0 + d + w. The logged effort acts later by a delay of whole samples, by
which it is shifted, and a fraction q of one: less j it is u + q T p and noise.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

__all__ = ["DISTURBANCE_STATE", "EFFORT_STATE", "STATES", "AxisModel", "ParameterLayout"]

STATES = 5
"""Position, velocity, disturbance force, effort, rate of change of the effort."""

DISTURBANCE_STATE, EFFORT_STATE = 2, 3

_SERIES_TERMS = 16  # of the exponential integrals; h < 1 leaves 1e-15


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
        Shape (2, 5, 5).
    constant
        What friction and offset add to the states; row 0 of the second axis is the motion itself,
        the others are its derivatives by the parameters [SI], shape (2, 1 + p, 5).
    transition_change
        Derivatives of the transition by the parameters [SI], shape (2, p, 5, 5).
    force_response
        Response of the states to a force held over the sample, and its derivatives, in the order of
        ``constant``, shape (2, 1 + p, 5).
    fraction
        Time by which the logged effort acts later than its shift by whole samples [s].
    shift
        Whole samples that the effort acts late.
    """

    transition: Float[np.ndarray, "2 s s"]
    constant: Float[np.ndarray, "2 q s"]
    transition_change: Float[np.ndarray, "2 p s s"]
    force_response: Float[np.ndarray, "2 q s"]
    fraction: float
    shift: int

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
        delay = layout.value("effort_delay", 1, values)
        shift = round(delay / T)
        transition = np.zeros((2, STATES, STATES))
        constant = np.zeros((2, 1 + p, STATES))
        response = np.zeros((2, 1 + p, STATES))
        change = np.zeros((2, p, STATES, STATES))
        for side, s in enumerate((1, -1)):
            m = layout.value(mass_name, s, values)
            c = layout.value("viscous_friction", s, values)
            load = s * layout.value("coulomb_friction", s, values)
            load += layout.value("offset", s, values)
            h = c * T / m
            p1, p2, p1_h, p2_h = _exponential_integrals(h)
            b = np.array([p2 * T * T / m, p1 * T / m, 0.0, 0.0, 0.0])
            response[side, 0], constant[side, 0] = b, -b * load
            A = np.diag([1.0, 1.0 - h * p1, correlation, 1.0, 1.0])
            A[0, 1], A[EFFORT_STATE, EFFORT_STATE + 1] = p1 * T, T
            A[:, DISTURBANCE_STATE] += b
            A[:, EFFORT_STATE] += b
            transition[side] = A
            for base, h_by, inverse_by in (
                (mass_name, -h / m, -1.0 / m),
                ("viscous_friction", T / m, 0.0),
            ):
                j = layout.column(base, s)
                if j is None:
                    continue
                # Of the factor 1/m and of h in the integrals
                by = b * inverse_by
                by[:2] += np.array([p2_h * T, p1_h]) * h_by * T / m
                change[side, j, 0, 1] = p1_h * h_by * T
                change[side, j, 1, 1] = -(p1 + h * p1_h) * h_by
                change[side, j, :, DISTURBANCE_STATE] = by
                change[side, j, :, EFFORT_STATE] = by
                response[side, 1 + j], constant[side, 1 + j] = by, -by * load
            for base, sign in (("coulomb_friction", s), ("offset", 1)):
                j = layout.column(base, s)
                if j is not None:
                    constant[side, 1 + j] = -sign * b
        return cls(
            transition=transition,
            constant=constant,
            transition_change=change,
            force_response=response,
            fraction=delay - shift * T,
            shift=shift,
        )


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
