"""The extremes of a free decay under Coulomb and viscous friction, by Markho's closed form.

P. H. Markho (1980), "On free vibrations with combined viscous and Coulomb damping", Journal of
Dynamic Systems, Measurement, and Control 102(4), 283-286. A mass on a spring, left alone, obeys
``m x'' + c x' + k x + f_c sign(x') = 0``. Every half-swing lasts h = pi / omega_d, friction of
either kind notwithstanding, and is a damped cosine about a centre that friction shifts against the
motion by x_f = f_c / k. So the amplitudes A_i of successive extremes follow

    A_(i+1) = q A_i - (1 + q) x_f,    q = exp(-delta),    delta = sigma h,    sigma = c / 2m,
    A_i = (A_0 + X) q^i - X,          X = x_f coth(delta / 2),

the second line being the envelope. Both kinds of friction are read from one record of the decay:
viscous friction bends the envelope, Coulomb friction lets it fall straight.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import optimize

from stickslip.records import InputError

__all__ = ["LEAST_EXTREMES", "DecayingExtremes"]

LEAST_EXTREMES = 4
"""As many as there are unknowns: centre, first amplitude, ratio and shift."""


@dataclass(frozen=True, kw_only=True)
class DecayingExtremes:
    """Successive extremes of a free decay, and what Markho's formula makes of them.

    Attributes
    ----------
    position
        Of the extremes, maxima and minima in turn [m or rad], shape (n,).
    deviation
        Standard deviation of each [m or rad], shape (n,).

    Raises
    ------
    InputError
        If there are fewer than four, or they do not alternate.

    Examples
    --------
    >>> swings = [1.0, -0.7, 0.43, -0.187]  # A' = 0.9 A - 0.2: q = 0.9, x_f = 0.2 / 1.9
    >>> ratio, shift = DecayingExtremes(position=np.array(swings), deviation=np.ones(4)).solve()[0]
    >>> round(ratio, 6), round(shift * 1.9, 6)
    (0.9, 0.2)
    """

    position: Float[np.ndarray, " n"]
    deviation: Float[np.ndarray, " n"]

    def __post_init__(self) -> None:
        if self.position.size < LEAST_EXTREMES:
            raise InputError(
                f"there are {self.position.size} extremes, {LEAST_EXTREMES} are needed",
                remedy="record a decay with more swings, such as from a larger amplitude",
            )
        steps = np.diff(self.position)
        if np.any(steps[1:] * steps[:-1] >= 0):
            raise InputError(
                "the extremes are not maxima and minima in turn",
                remedy="leave out what is between them",
            )

    def amplitudes(self, values: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " n"]:
        """Return the extremes by the formula.

        Parameters
        ----------
        values
            Ratio q [-], shift x_f, centre and first amplitude with its sign [m or rad].
        """
        q, shift, centre, first = values
        side = np.sign(self.position[0] - self.position[1])
        swings = np.empty(self.position.size)
        amplitude = side * first
        for i in range(swings.size):
            swings[i] = centre + side * (-1.0) ** i * amplitude
            amplitude = q * amplitude - (1.0 + q) * shift
        return swings

    def solve(
        self,
    ) -> tuple[tuple[float, float], Float[np.ndarray, "2 2"], Float[np.ndarray, " n"]]:
        """Return ratio q [-] and shift x_f [m or rad], their covariance, and what is left over.

        Weighted least squares on the extremes themselves: a regression of each amplitude on the one
        before would be biased by their noise. What is left of the extremes is stated over their
        standard deviations [-]; where it is more than these say, it widens the covariance.
        """
        y = self.position
        steps = np.abs(np.diff(y))
        # Steps shrink by q apart from a constant, as their differences do without it
        bends = np.diff(steps)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = float(np.median(bends[1:] / bends[:-1])) if bends.size > 1 else np.nan
        ratio = ratio if 0.0 < ratio < 1.0 else 0.9
        shift = max(float(-np.mean(bends)) / 4.0, 0.0)
        centre = 0.25 * float(y[0] + 2.0 * y[1] + y[2])
        start = np.array([ratio, shift, centre, y[0] - centre])

        def residual(values: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " n"]:
            return (self.amplitudes(values) - y) / self.deviation

        scale = np.array([1.0, steps[0], steps[0], steps[0]])
        found = optimize.least_squares(
            residual, start, x_scale=scale, xtol=1e-15, ftol=1e-15, gtol=1e-15
        )
        slopes = np.asarray(found.jac)
        inverse = np.linalg.inv(slopes.T @ slopes)
        left = y.size - LEAST_EXTREMES
        misfit = 2.0 * float(found.cost) / left if left else 1.0
        widened = inverse * max(misfit, 1.0)
        return (float(found.x[0]), float(found.x[1])), widened[:2, :2], np.asarray(found.fun)
