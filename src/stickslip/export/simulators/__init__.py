"""Friction as code and models for simulators that read no robot description."""
