"""The energy method with an unknown inertia."""
