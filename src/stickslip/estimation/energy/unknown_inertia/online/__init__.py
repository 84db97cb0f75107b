"""The energy method with an unknown inertia, sample by sample."""
