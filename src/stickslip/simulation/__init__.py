"""Exact event-driven simulation of plants with friction, sensors, and the sampled loop."""

from stickslip.simulation.batch import SimulatedBatch, simulate_batch
from stickslip.simulation.closed_loop import ClosedLoopRun, Controller, simulate_closed_loop
from stickslip.simulation.sensitivity import (
    MotionSensitivity,
    sensitivity_names,
    simulate_sensitivity,
)
from stickslip.simulation.sensors import Noise, Sensors
from stickslip.simulation.simulate import PlantStepper, SimulatedMotion, simulate

__all__ = [
    "ClosedLoopRun",
    "Controller",
    "MotionSensitivity",
    "Noise",
    "PlantStepper",
    "Sensors",
    "SimulatedBatch",
    "SimulatedMotion",
    "sensitivity_names",
    "simulate",
    "simulate_batch",
    "simulate_closed_loop",
    "simulate_sensitivity",
]
