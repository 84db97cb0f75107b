"""An example that needs MuJoCo, as a module."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest


def mujoco_example(name: str) -> ModuleType:
    """Return the example, or skip the test where MuJoCo is absent."""
    pytest.importorskip("mujoco")
    path = Path(__file__).parents[2] / "examples" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(name[3:], path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
