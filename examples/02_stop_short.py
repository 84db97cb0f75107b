"""Why dry friction matters: a PD controller that stops short of its target, in the sampled loop.

The controller is a compiled kernel, so the whole loop is compiled.
Run it: python examples/02_stop_short.py
"""

from dataclasses import dataclass

from stickslip import (
    CoulombViscousFriction,
    Sensors,
    SensorSample,
    SingleMass,
    simulate_closed_loop,
)
from stickslip.compiled import compiled

TARGET, KP, KD = 0.01, 20_000.0, 2_500.0  # m, N/m, N s/m


@compiled(cached=False)
def pd_step(state: float, sample: SensorSample) -> tuple[float, float]:
    """Return the effort of a PD controller; it remembers nothing, so its state is a mere number."""
    return state, KP * (TARGET - sample.measured_position) - KD * sample.measured_velocity


@dataclass(frozen=True)
class ProportionalDerivative:
    """A controller is anything with ``init`` and a pure ``step``."""

    step = staticmethod(pd_step)

    def init(self) -> float:
        """Return the state before the first sample."""
        return 0.0


# The positioning table of van de Wijdeven (2002), part B, Table 1
law = CoulombViscousFriction.symmetric(
    coulomb_friction=100.0, viscous_friction=700.0, static_friction=130.0
)
run = simulate_closed_loop(
    SingleMass(mass=150.0, friction=law),
    ProportionalDerivative(),
    sampling_time=0.001,
    samples=2000,
    sensors=Sensors(encoder_step=1e-6, velocity="differences"),
)
error = TARGET - float(run.motion.position[-1])
print(f"at rest: {bool(run.motion.stuck[-1])}, {1e3 * error:.2f} mm short of the target")
print(f"static friction holds the axis up to {1e3 * 130.0 / KP:.2f} mm away")
