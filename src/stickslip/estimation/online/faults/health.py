"""Counts of what an online estimator rejected, and of its resets."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class OnlineHealth:
    """Counts of samples that an online estimator accepted, rejected and repaired."""

    samples: int  #: Number of samples.
    #: Values that were not finite or impossible (effort, and motion of each mass).
    missing_samples: int
    position_glitches: int  #: Values that contradicted those before them and were not used.
    velocity_glitches: int  #: Values that contradicted those before them and were not used.
    effort_glitches: int  #: Values that contradicted those before them and were not used.
    #: Contradictions that lasted and were accepted, such as an encoder that was homed again.
    motion_steps: int
    #: Samples that only an unknown force explains; friction did not learn from them.
    force_events: int
    #: Times that a state which was not finite or not plausible was replaced by the last valid one.
    resets: int
    #: Standard deviation of the disturbance force, given or estimated [N or N m]; None if the
    #: method has none.
    force_noise: float | None

    @property
    def rejected(self) -> int:
        """Number of values that were not used."""
        glitches = self.position_glitches + self.velocity_glitches + self.effort_glitches
        return self.missing_samples + glitches

    @property
    def text(self) -> str:
        """One sentence for a log or a display."""
        if self.resets:
            return (
                f"{self.resets} resets to the last valid state: check inertia, units and sensor "
                "noise of the estimator"
            )
        if self.rejected or self.motion_steps:
            return (
                f"{self.rejected} values of {self.samples} samples rejected, {self.motion_steps} "
                "steps of the position accepted: check the sensors and their cables"
            )
        return f"{self.samples} samples, none rejected"


def health_of(
    admission: Any,
    *,
    resets: int,
    force_events: float = 0.0,
    force_noise: float | None = None,
) -> OnlineHealth:
    """Return the health of an estimator, from the fields of its admission and its own counts."""
    return OnlineHealth(
        samples=int(admission.samples_seen),
        missing_samples=int(admission.missing_values),
        position_glitches=int(admission.motion_glitches),
        velocity_glitches=int(admission.velocity_glitches),
        effort_glitches=int(admission.effort_glitches),
        motion_steps=int(admission.motion_steps),
        force_events=int(force_events),
        resets=resets,
        force_noise=None if force_noise is None else float(force_noise),
    )
