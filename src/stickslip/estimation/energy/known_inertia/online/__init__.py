"""The energy method with a known inertia, sample by sample."""
