"""Friction compensation in drives and numerical controls, and tables of effort over speed."""
