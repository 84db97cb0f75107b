"""Which pulse moves a mass how far, and which pulses move it as far as asked."""

from stickslip.planning.pulse_law import PulseLaw

__all__ = ["PulseLaw"]
