"""A landing of a flexible arm by series of pulses that feedback on both masses tracks."""
