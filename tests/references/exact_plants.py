"""Exact motion of both plants between events, in high precision: sums of exponentials in time.

Part of the independent reference; see `event_driven`.
"""

from dataclasses import dataclass, field
from typing import Protocol

from mpmath import mp, mpc, mpf

Number = float | mpf
State = tuple[mpf, ...]
"""(x, v), or (x1, v1, x2, v2)."""


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Magnitudes for the positive and the negative direction, and a constant offset force."""

    coulomb: tuple[Number, Number]
    static: tuple[Number, Number]
    viscous: tuple[Number, Number]
    offset: Number = 0.0

    def of(self, values: tuple[Number, Number], s: int) -> mpf:
        """Pick the value of direction ``s``."""
        return mpf(values[0] if s > 0 else values[1])


@dataclass(frozen=True)
class Curve:
    """p0 + p1 t + p2 t^2 + sum_i c_i exp(l_i t) with real part of l_i <= 0; its real part."""

    polynomial: tuple[mpf, ...]
    amplitudes: tuple[mpc, ...] = ()
    exponents: tuple[mpc, ...] = ()

    def at(self, t: mpf, order: int = 0) -> mpf:
        """Value of the derivative of the given order."""
        value = mpf(0)
        for power in range(order, len(self.polynomial)):
            value += mp.ff(power, order) * self.polynomial[power] * t ** (power - order)
        for c, rate in zip(self.amplitudes, self.exponents, strict=True):
            value += mp.re(c * rate**order * mp.exp(rate * t))
        return value

    def bound(self, duration: mpf, order: int) -> mpf:
        """Bound of the magnitude of that derivative over 0 <= t <= duration."""
        value = mpf(0)
        for power in range(order, len(self.polynomial)):
            value += mp.ff(power, order) * abs(self.polynomial[power]) * duration ** (power - order)
        for c, rate in zip(self.amplitudes, self.exponents, strict=True):
            value += abs(c) * abs(rate) ** order
        return value

    def derivative(self) -> "Curve":
        """Derivative as a curve."""
        return Curve(
            tuple(k * p for k, p in enumerate(self.polynomial))[1:] or (mpf(0),),
            tuple(c * rate for c, rate in zip(self.amplitudes, self.exponents, strict=True)),
            self.exponents,
        )

    def affine(self, constant: mpf, factor: Number) -> "Curve":
        """Return constant + factor * curve."""
        first, *rest = (factor * p for p in self.polynomial)
        return Curve(
            (constant + first, *rest), tuple(factor * c for c in self.amplitudes), self.exponents
        )


class Plant(Protocol):
    """Properties of a plant for the event loop: curves of its positions."""

    friction: Friction

    def slip(self, state: State, effort: mpf, s: int) -> tuple[Curve, ...]:
        """Positions while slipping the way of ``s``."""
        ...

    def stick(self, state: State) -> tuple[Curve, ...]:
        """Positions while sticking."""
        ...

    def drive(self, state: State, effort: mpf) -> Curve:
        """Force w while sticking: effort - offset - spring force."""
        ...


@dataclass(kw_only=True)
class SingleMass:
    """Mass on a rough plane."""

    mass: Number
    friction: Friction

    def slip(self, state: State, effort: mpf, s: int) -> tuple[Curve, ...]:
        x, v = state
        m, law = mpf(self.mass), self.friction
        c = law.of(law.viscous, s)
        force = effort - mpf(law.offset) - s * law.of(law.coulomb, s)
        if c == 0:
            return (Curve((x, v, force / m / 2)),)
        final = force / c
        lag = (v - final) * m / c
        return (Curve((x + lag, final), (mpc(-lag),), (mpc(-c / m),)),)

    def stick(self, state: State) -> tuple[Curve, ...]:
        return (Curve((state[0],)),)

    def drive(self, state: State, effort: mpf) -> Curve:  # noqa: ARG002  (the arm needs it)
        return Curve((effort - mpf(self.friction.offset),))


@dataclass(kw_only=True)
class FlexibleArm:
    """Two masses and a spring, friction on the first."""

    mass_1: Number
    mass_2: Number
    stiffness: Number
    friction: Friction
    _modes: dict[tuple[int, int], tuple[list[mpc], list[mpc], object]] = field(default_factory=dict)

    def slip(self, state: State, effort: mpf, s: int) -> tuple[Curve, ...]:
        law = self.friction
        force = effort - mpf(law.offset) - s * law.of(law.coulomb, s)
        if law.of(law.viscous, s) == 0:
            return self._undamped(state, force)
        return self._damped(state, force, s)

    def _undamped(self, state: State, force: mpf) -> tuple[Curve, ...]:
        """Centre of mass X on a parabola, spring length d = x1 - x2 on a sine."""
        x1, v1, x2, v2 = state
        m1, m2, k = mpf(self.mass_1), mpf(self.mass_2), mpf(self.stiffness)
        total = m1 + m2
        centre = ((m1 * x1 + m2 * x2) / total, (m1 * v1 + m2 * v2) / total, force / total / 2)
        omega = mp.sqrt(k * total / (m1 * m2))
        rest = force / m1 / omega**2  # d'' = force/m1 - omega^2 d
        wave = (x1 - x2 - rest) - mpc(0, 1) * (v1 - v2) / omega
        rates = (mpc(0, omega),)

        def mass(share: mpf) -> Curve:  # x = X + share * d
            return Curve((centre[0] + share * rest, *centre[1:]), (share * wave,), rates)

        return mass(m2 / total), mass(-m1 / total)

    def _damped(self, state: State, force: mpf, s: int) -> tuple[Curve, ...]:
        """Both masses: p + (force/c) t + sum of three decaying modes.

        The rates solve m1 m2 l^3 + c m2 l^2 + k (m1 + m2) l + c k = 0; in a mode of amplitude b on
        mass 2, mass 1 has (m2 l^2 + k)/k b.
        """
        c = self.friction.of(self.friction.viscous, s)
        rates, shape, inverse = self._modes_of(c, s)
        final = force / c
        x1, v1, x2, v2 = state
        p, *b = inverse * mp.matrix([x2, v2 - final, x1, v1 - final])
        load = Curve((mp.re(p), final), tuple(b), tuple(rates))
        motor = Curve(
            (mp.re(p), final), tuple(q * y for q, y in zip(shape, b, strict=True)), tuple(rates)
        )
        return motor, load

    def _modes_of(self, c: mpf, s: int) -> tuple[list[mpc], list[mpc], object]:
        key = (s, mp.prec)
        if key not in self._modes:
            m1, m2, k = mpf(self.mass_1), mpf(self.mass_2), mpf(self.stiffness)
            cubic = [c * k, k * (m1 + m2), c * m2, m1 * m2]
            rates = [
                mpc(min(mp.re(rate), mpf(0)), mp.im(rate))
                for rate in mp.polyroots(cubic, asc=True, maxsteps=2000, extraprec=2 * mp.prec)
            ]
            shape = [(m2 * rate**2 + k) / k for rate in rates]
            at_start = mp.matrix(
                [
                    [1, *(1 for _ in rates)],
                    [0, *rates],
                    [1, *shape],
                    [0, *(rate * q for rate, q in zip(rates, shape, strict=True))],
                ]
            )
            self._modes[key] = (rates, shape, at_start**-1)
        return self._modes[key]

    def stick(self, state: State) -> tuple[Curve, ...]:
        x1, _, x2, v2 = state
        omega = mp.sqrt(mpf(self.stiffness) / mpf(self.mass_2))
        wave = (x2 - x1) - mpc(0, 1) * v2 / omega
        return Curve((x1,)), Curve((x1,), (wave,), (mpc(0, omega),))

    def drive(self, state: State, effort: mpf) -> Curve:
        motor, load = self.stick(state)
        k = mpf(self.stiffness)
        return load.affine(effort - mpf(self.friction.offset) - k * motor.polynomial[0], k)
