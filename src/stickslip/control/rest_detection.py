"""When an axis counts as being at rest."""

from dataclasses import dataclass
from math import sqrt
from statistics import NormalDist

from stickslip.control.checks import check_fields
from stickslip.records import non_negative, positive, quantity_field, whole

_MISSED = 1e-3  # of the windows of an axis at rest; the next window, a sample later, makes it good
_FALSE = 1e-6  # of the rests: noise taken for motion, from which something wrong would be learned


@dataclass(frozen=True, kw_only=True)
class RestDetection:
    """When an axis counts as being at rest, and where it then is.

    It is at rest when over the last ``samples`` samples the measured position stays within
    ``spread`` and, if ``speed`` is given, no measured velocity exceeds it. Its position is the mean
    of those samples. Only samples from the end of a pulse on count.

    With ideal sensors ``RestDetection(samples=1, spread=0.0, speed=0.0)`` finds the axis at rest in
    the very sample in which it has stuck. On an encoder without a velocity, `for_encoder`.

    Attributes
    ----------
    samples
        Length of the window; at least 2 where no velocity is looked at.
    spread
        Largest difference of two positions in the window.
    speed
        Largest magnitude of the measured velocity; None where none is measured.
    least_motion
        A pulse after which the axis rests no farther than this from where it was has not moved it;
        None for the ``spread``.
    delay
        Of the sensors in whole samples: so many after a pulse still show what was before its end.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> ideal = RestDetection(samples=1, spread=0.0, speed=0.0)
    """

    samples: int
    spread: float = quantity_field("position")
    speed: float | None = quantity_field("velocity", default=None)
    least_motion: float | None = quantity_field("position", default=None)
    delay: int = 0

    def __post_init__(self) -> None:
        for name, least in (("samples", 1 if self.speed is not None else 2), ("delay", 0)):
            object.__setattr__(self, name, whole(name, getattr(self, name), least=least))
        units = {"spread": "m or rad", "speed": "m/s or rad/s", "least_motion": "m or rad"}
        check_fields(self, non_negative, units)

    @classmethod
    def for_encoder(
        cls, *, resolution: float, noise: float = 0.0, samples: int, delay: int = 0
    ) -> "RestDetection":
        """Return the detection for an encoder alone, without a velocity.

        At rest the window's range is within ``spread`` but for one window in a thousand, and the
        means of two windows are within ``least_motion`` but for one pair in a million.

        Parameters
        ----------
        resolution
            Step of the encoder [m or rad].
        noise
            Standard deviation of white noise before it is rounded to a step [m or rad].
        samples
            Length of the window; so long that an axis in motion moves by more than the spread.
        delay
            Of the sensors, in whole samples.

        Examples
        --------
        >>> rest = RestDetection.for_encoder(resolution=1e-6, noise=1e-6, samples=20)
        >>> f"{rest.spread:.1e} m, {rest.least_motion:.1e} m"
        '9.1e-06 m, 2.5e-06 m'
        """
        step = positive("resolution", resolution, "m or rad")
        sigma = non_negative("noise", noise, "m or rad")
        if samples < 2:  # before it is divided by
            return cls(samples=samples, spread=step, delay=delay)
        # Rounding adds at most one step to a range, and to a difference of means
        normal = NormalDist()
        outermost = normal.inv_cdf(1.0 - _MISSED / (2.0 * samples))
        farthest = normal.inv_cdf(1.0 - _FALSE / 2.0)
        return cls(
            samples=samples,
            spread=step + 2.0 * sigma * outermost,
            least_motion=step + sigma * farthest * sqrt(2.0 / samples),
            delay=delay,
        )
