"""Reproducible studies of the package; they stand beside it and are not part of the wheel."""
