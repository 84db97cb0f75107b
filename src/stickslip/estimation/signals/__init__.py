"""Motion, noise and timing of a log."""
