"""Effect of noise on an absolute value: Figures 5.1 to 5.3 of the source, and their basis."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven.part_a.noise_compensation import (
    absolute_bias,
    absolute_bias_polynomial,
    absolute_density,
    absolute_mean,
    absolute_mean_polynomial,
    double_absolute_mean,
    double_absolute_mean_polynomial,
)
from studies.van_de_wijdeven.records import Curve, Panel, ReproducedFigure

_RANGE = 3.0  # standard deviations up to which the source's polynomials hold
_POINTS = 601
_DRAWS = 200_000  # enough to resolve 0.002 standard deviations
_MEANS = (0.0, 2.0)  # of Figure 5.1 [standard deviations]
_SPEEDS = (0.0, 0.5, 1.0, 2.0, 3.0)  # where Eq. 5.20 is checked [standard deviations]
_KOLMOGOROV_95 = 1.358  # limit of the distance of n draws, times the root of n (n large)

_VELOCITY = "velocity, in σ"
_ABSOLUTE = "absolute velocity, in σ"


@dataclass(frozen=True, kw_only=True)
class AbsoluteValue:
    """Numbers on which claims about chapter 5 rest; velocities in standard deviations."""

    #: Largest distance of the distribution of draws from that of Eq. 5.16, over what random draws
    #: show in 95 % of all cases, for both means of Figure 5.1 [-].
    density_distance: float
    #: Largest deviation of the mean of draws from Eq. 5.20, over its standard error [-].
    mean_deviation: float
    sixth_order_error: float  #: Largest error of the polynomial of Eq. 5.21 within 3 sigma [sigma].
    #: Largest error of Eq. 5.24 against the exact double expectation, within 3 sigma [sigma].
    double_mean_error: float
    #: Largest error of the polynomial of order four against what it approximates [sigma].
    fourth_order_error: float
    #: Expected addition of noise to the absolute velocity, and what the source's compensation
    #: takes off in expectation, at rest and at 2 sigma [sigma].
    added_at_rest: float
    removed_at_rest: float
    added_in_motion: float
    removed_in_motion: float


def absolute_value(generator: np.random.Generator) -> AbsoluteValue:
    """Check the source's expectations against draws, and its polynomials against closed forms."""
    draws = generator.standard_normal(_DRAWS)
    s = np.linspace(0.0, _RANGE, _POINTS)
    polynomial = double_absolute_mean_polynomial(s, 1.0)
    quartic = absolute_bias_polynomial(s, 1.0, of="polynomial")
    deviations = [
        abs(float(np.mean(np.abs(speed + draws)) - absolute_mean(speed, 1.0)))
        / float(np.std(np.abs(speed + draws)) / np.sqrt(_DRAWS))
        for speed in _SPEEDS
    ]
    return AbsoluteValue(
        density_distance=max(_distance(np.abs(mean + draws), mean) for mean in _MEANS),
        mean_deviation=max(deviations),
        sixth_order_error=_largest(absolute_mean_polynomial(s, 1.0) - absolute_mean(s, 1.0)),
        double_mean_error=_largest(polynomial - double_absolute_mean(s, 1.0)),
        fourth_order_error=_largest(quartic - (polynomial - s)),
        added_at_rest=float(absolute_mean(0.0, 1.0)),
        removed_at_rest=_removed(0.0),
        added_in_motion=float(absolute_mean(2.0, 1.0)) - 2.0,
        removed_in_motion=_removed(2.0),
    )


def _largest(error: Float[np.ndarray, " n"]) -> float:
    return float(np.max(np.abs(error)))


def _distance(values: Float[np.ndarray, " n"], mean: float) -> float:
    """Return the Kolmogorov distance from Eq. 5.16, over its 95 % limit for random draws."""
    ordered = np.sort(values)
    grid = np.linspace(0.0, abs(mean) + 8.0, 8001)
    density = absolute_density(grid, mean, 1.0)
    steps = np.diff(grid) * (density[1:] + density[:-1]) / 2.0
    expected = np.interp(ordered, grid, np.concatenate(([0.0], np.cumsum(steps))))
    there = np.arange(1, ordered.size + 1) / ordered.size
    distance = max(np.max(there - expected), np.max(expected - there + 1.0 / ordered.size))
    return float(distance * np.sqrt(ordered.size) / _KOLMOGOROV_95)


def _removed(velocity: float) -> float:
    """Return what the printed compensation takes off on average [sigma]."""
    v = np.linspace(-8.0, 8.0, 4001)
    density = np.exp(-0.5 * v**2) / np.sqrt(2.0 * np.pi)
    taken = absolute_bias_polynomial(velocity + v, 1.0, of="polynomial")
    return float(np.trapezoid(density * taken, v))


def expectation_figures() -> tuple[ReproducedFigure, ...]:
    """Return Figures 5.1, 5.2 and 5.3, in standard deviations of the noise."""
    return _densities(), _expected_value(), _double_expectation()


def _densities() -> ReproducedFigure:
    x = np.linspace(-4.0, 6.0, _POINTS)
    return ReproducedFigure(
        number="5.1",
        title="Probability density of y = |v| beside that of y = v",
        caption=(
            "A normal velocity of mean 0 (left) and 2 (right) and standard deviation 1, and its "
            "absolute value: the part below zero is folded over (Eq. 5.16). The source does not "
            "say whether the two means share a plot."
        ),
        columns=2,
        panels=tuple(
            Panel(
                title=f"mean {mean:g}, standard deviation 1",
                x_label="y, in σ",
                y_label="density, in 1/σ",
                curves=(
                    Curve(
                        label="y = v",
                        role="second",
                        x=x,
                        y=np.exp(-0.5 * (x - mean) ** 2) / _ROOT_TWO_PI,
                    ),
                    Curve(label="y = |v|", role="first", x=x, y=absolute_density(x, mean, 1.0)),
                ),
            )
            for mean in _MEANS
        ),
    )


_ROOT_TWO_PI = float(np.sqrt(2.0 * np.pi))


def _expected_value() -> ReproducedFigure:
    x = np.linspace(-4.0, 4.0, _POINTS)
    return ReproducedFigure(
        number="5.2",
        title="Expected absolute value of a noisy velocity",
        caption=(
            "What is expected of the measured absolute velocity (Eq. 5.20) against the true one, "
            "and the source's polynomial of order six, which stands for it within 3 σ (Eq. 5.21)."
        ),
        columns=1,
        panels=(
            Panel(
                title="expectation over the noise",
                x_label=f"true {_VELOCITY}",
                y_label=_ABSOLUTE,
                curves=(
                    Curve(label="true |v|", role="truth", x=x, y=np.abs(x)),
                    Curve(
                        label="expected of the measured |v|",
                        role="first",
                        x=x,
                        y=absolute_mean(x, 1.0),
                    ),
                    Curve(
                        label="polynomial of order six",
                        role="third",
                        x=x,
                        y=absolute_mean_polynomial(x, 1.0),
                    ),
                ),
            ),
        ),
    )


def _double_expectation() -> ReproducedFigure:
    x = np.linspace(-4.0, 4.0, _POINTS)
    s = np.linspace(0.0, 4.0, _POINTS)
    return ReproducedFigure(
        number="5.3",
        title="Double expectation against the measured absolute velocity, and the final bias",
        caption=(
            "Left: the double expectation of Eq. 5.24, as the source has it from its polynomial of "
            "order six, and exactly. Right: what is subtracted from a measured absolute velocity: "
            "Eq. 5.24 less |v|, the source's polynomial of order four through it (it needs odd "
            "powers), and the exact form h(|v|) − |v|; beside them what noise really adds, as a "
            "function of the true velocity, which no function of the measured velocity can be."
        ),
        columns=2,
        panels=(
            Panel(
                title="double expectation",
                x_label=f"measured {_VELOCITY}",
                y_label=_ABSOLUTE,
                curves=(
                    Curve(label="measured |v|", role="truth", x=x, y=np.abs(x)),
                    Curve(label="exact h(|v|)", role="first", x=x, y=double_absolute_mean(x, 1.0)),
                    Curve(
                        label="Eq. 5.24, from order six",
                        role="third",
                        x=x,
                        y=double_absolute_mean_polynomial(x, 1.0),
                    ),
                ),
            ),
            Panel(
                title="final bias",
                x_label=f"measured {_ABSOLUTE} (dashed: true)",
                y_label="bias, in σ",
                curves=(
                    Curve(label="what noise adds", role="truth", x=s, y=absolute_mean(s, 1.0) - s),
                    Curve(label="exact h(|v|) − |v|", role="first", x=s, y=absolute_bias(s, 1.0)),
                    Curve(
                        label="Eq. 5.24 − |v|",
                        role="third",
                        x=s,
                        y=double_absolute_mean_polynomial(s, 1.0) - s,
                    ),
                    Curve(
                        label="polynomial of order four",
                        role="fourth",
                        x=s,
                        y=absolute_bias_polynomial(s, 1.0, of="polynomial"),
                    ),
                ),
            ),
        ),
    )
