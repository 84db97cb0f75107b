"""Part B: pulse width control, pulse amplitude and width control, and what beats them."""
