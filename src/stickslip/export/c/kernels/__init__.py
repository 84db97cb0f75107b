"""Kernels that exist for the exported code; all others are those that the package itself runs."""
