"""Energy-based estimation where the inertia is known."""
