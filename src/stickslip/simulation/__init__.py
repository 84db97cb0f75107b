"""Exact event-driven simulation of plants with friction, sensors, and the sampled loop."""

from stickslip.simulation.motion import SimulatedMotion
from stickslip.simulation.simulate import simulate
from stickslip.simulation.stepper import PlantStepper

__all__ = ["PlantStepper", "SimulatedMotion", "simulate"]
