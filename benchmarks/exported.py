"""Time of a step of exported C beside the compiled kernel that it is translated from."""

import ctypes
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from rich.progress import Progress

from benchmarks.measuring import Comparison, Rows
from stickslip.compiled import compiled
from stickslip.control.pulses import exact
from stickslip.control.pulses.kernel import head
from stickslip.estimation.energy.known_inertia.online.recursion import work_step
from stickslip.estimation.online.kalman.kernels import ekf_step
from stickslip.export import ExportParameters
from stickslip.export.c.content import CodeContent, derived_content
from stickslip.export.c.folder import Part, parts_of, sources
from stickslip.export.c.kernels import friction
from stickslip.export.c.vectors import vectors_of
from stickslip.export.fmu.model import plant_model
from stickslip.friction import CoulombViscousFriction
from stickslip.numerics.named_fields import fields_at
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import SensorSample
from stickslip.simulation.kernels.arm import arm_step
from stickslip.simulation.kernels.single_mass import mass_step
from stickslip.simulation.plant_kernels import initial_kernel_state, kernel_model

_OPTIONS = ("-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC")
_ROUNDS = 40  # through the samples of the test vectors, from the first state
_EFFORTS = 4000  # samples of a plant
_T = 0.001
_TARGET = 1e-3  # of the pulse controller, which begins at 0 [m]
_PARAMETERS = ExportParameters(
    kind="linear",
    values={"mass": 150.0, "coulomb_friction": 100.0, "viscous_friction": 700.0, "offset": 4.0},
)
_LAW = CoulombViscousFriction.symmetric(
    coulomb_friction=100.0, static_friction=130.0, viscous_friction=700.0, offset=4.0
)
_PLANTS: dict[str, Any] = {
    "rigid axis": SingleMass(mass=150.0, friction=_LAW),
    "flexible arm": FlexibleArm(mass_1=100.0, mass_2=50.0, stiffness=4e5, friction=_LAW),
}

# How C works through samples, by module: what it includes, and a step
_SHIM = """
#include "stickslip_{name}.h"
double run(int64_t rounds, int64_t n, const double *in);
int64_t size(void);
int64_t size(void) {{ return (int64_t)({size}); }}
double run(int64_t rounds, int64_t n, const double *in) {{
    double out = 0.0;
    {declare}
    for (int64_t r = 0; r < rounds; r += 1) {{
        {init}
        for (int64_t k = 0; k < n; k += 1) {{ const double *z = in + {columns} * k; {step} }}
    }}
    {end}
    return out;
}}
"""
_PLANT = """
#include "model.c"
double run(int64_t rounds, int64_t n, const double *in);
int64_t size(void);
int64_t size(void) { return (int64_t)(sizeof(plant) + sizeof(model_t)); }
double run(int64_t rounds, int64_t n, const double *in) {
    double values[16] = {0.0};
    model_t state;
    for (int64_t r = 0; r < rounds; r += 1) {
        model_begin(&state, values);
        for (int64_t k = 0; k < n; k += 1) { values[1] = in[k]; (void)model_step(&state, values); }
    }
    return values[2];
}
"""
_STATE = {
    "size": "sizeof(stickslip_{name}_config_t) + sizeof(stickslip_{name}_state_t)",
    "declare": "static stickslip_{name}_state_t state;",
    "init": "stickslip_{name}_init(&stickslip_{name}, &state);",
}
_STEP = "(void)stickslip_{name}_step_missing(&stickslip_{name}, &state, z[0], z[1], z[2]);"
_RESULT = (
    "stickslip_{name}_result_t result; "
    "stickslip_{name}_result(&stickslip_{name}, &state, &result); out = result.coulomb_friction;"
)
_CALLS = {
    "law": {
        "size": "sizeof(stickslip_law_config_t)",
        "declare": "",
        "init": "",
        "step": "(void)stickslip_law_feedforward(&stickslip_law, z[0], z[1], &out);",
        "end": "",
    },
    "pulses": {
        **_STATE,
        "step": "const stickslip_sample_t sample = {z[0], z[1], z[2], NAN, NAN}; "
        "(void)stickslip_pulses_step(&stickslip_pulses, &state, &sample, &out);",
        "end": "out = state.motion.error;",
    },
    "kalman": {**_STATE, "step": _STEP, "end": _RESULT},
    "energy": {**_STATE, "step": _STEP, "end": _RESULT},
}

Vector = Float[np.ndarray, " s"]


@contextmanager
def _in_c(files: dict[str, str], units: list[str]) -> Generator[tuple[Callable[..., float], int]]:
    """Yield the compiled run over samples, and the bytes of configuration and state."""
    found = shutil.which("gcc") or shutil.which("clang")
    compiler = [found] if found else [sys.executable, "-m", "ziglang", "cc"]
    with tempfile.TemporaryDirectory() as name:
        for file, text in files.items():
            (Path(name) / file).write_text(text)
        command = [*compiler, *_OPTIONS, *units, "-o", "code.so", "-lm"]
        subprocess.run(command, cwd=name, check=True)
        code = ctypes.CDLL(str(Path(name) / "code.so"))
        code.run.restype, code.size.restype = ctypes.c_double, ctypes.c_int64

        def run(rounds: int, samples: Float[np.ndarray, "n i"]) -> float:
            data = np.ascontiguousarray(samples)
            pointer = data.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
            return float(code.run(ctypes.c_int64(rounds), ctypes.c_int64(len(data)), pointer))

        yield run, int(code.size())


@compiled(cached=False)
def _run_law(law: Any, rounds: int, samples: Any) -> float:
    out = 0.0
    for _ in range(rounds):
        for k in range(samples.shape[0]):
            effort = friction.feedforward(law, samples[k, 0], samples[k, 1])
            if np.isfinite(samples[k, 0]):
                out = effort
    return out


@compiled(cached=False)
def _run_pulses(step: Any, first: Any, rounds: int, samples: Any) -> Any:
    state = first
    for _ in range(rounds):
        state = first
        for k in range(samples.shape[0]):
            z = samples[k]
            state, _effort = step(state, SensorSample(z[0], z[1], z[2], np.nan, np.nan))
    return state


@compiled(cached=False)
def _run_online(step: Any, first: Any, rounds: int, samples: Any) -> Any:
    state = first.copy()
    for _ in range(rounds):
        state[:] = first
        for k in range(samples.shape[0]):
            step(state, samples[k, 0], samples[k, 1], 0.0, 0.0, 0.0)
    return state


@compiled(cached=False)
def _run_plant(step: Any, model: Any, first: Any, rounds: int, efforts: Any) -> float:
    state = first
    for _ in range(rounds):
        state = first
        for k in range(efforts.shape[0]):
            state, _output = step(model, state, efforts[k])
    return state[0]


def _python(part: Part, content: CodeContent) -> tuple[Callable[[int, Any], float], int]:
    """Return the run over samples by the compiled kernels, and the bytes of their state."""
    first, name = part.vector, part.module.name
    if name == "law":
        law = fields_at(friction.LAW)(first)
        return lambda rounds, samples: _run_law(law, rounds, samples), first.nbytes
    if name == "pulses":
        step: Any = exact._step  # pyright: ignore[reportPrivateUsage]
        return (
            lambda rounds, samples: float(head(_run_pulses(step, first, rounds, samples)).error),
            first.nbytes,
        )
    estimator: Any = content.energy if name == "energy" else content.kalman
    kernel: Any = work_step if name == "energy" else ekf_step

    def run(rounds: int, samples: Any) -> float:
        state = _run_online(kernel, first, rounds, samples)
        return float(state[estimator.values_at][0])

    return run, first.nbytes


def _plant_in_python(plant: Any) -> tuple[Callable[[int, Any], float], int]:
    """Return the run of a plant by the compiled kernel, and the bytes of its model and state."""
    model, first = kernel_model(plant, _T), initial_kernel_state(plant, None)
    step: Any = arm_step if plant.flexible else mass_step
    return (
        lambda rounds, efforts: float(_run_plant(step, model, first, rounds, efforts)),
        model.nbytes + 8 * len(first),
    )


def compare(progress: Progress) -> list[Comparison]:
    """Time the steps of exported C and of the compiled kernels, and compare what they need."""
    content = derived_content("axis", _PARAMETERS, sampling_time=_T).content
    assert content.controller is not None
    content = replace(content, controller=replace(content.controller, target=_TARGET))
    parts, files = parts_of(content), sources(content)
    rows = Rows(progress, "exported code", total=2 * (len(parts) + len(_PLANTS)))

    def both(name: str, python: Any, code: Any, samples: Any, rounds: int) -> None:
        (run_python, python_bytes), (run_c, c_bytes) = python, code
        expected = run_python(1, samples)
        for how, run, size in (("C", run_c, c_bytes), ("Python", run_python, python_bytes)):
            rows.add(
                f"{name}, {how}",
                lambda run=run: run(rounds, samples),
                rounds * len(samples),
                error=lambda found: abs(found - expected) / abs(expected),
                repetitions=9,
                ours=True,
                size=size,
            )

    for part in parts:
        name = part.module.name
        samples = vectors_of(part, content).inputs
        calls = {each: text.replace("{name}", name) for each, text in _CALLS[name].items()}
        shim = _SHIM.format(name=name, columns=samples.shape[1], **calls)
        units = ["shim.c", f"stickslip_{name}.c", f"stickslip_{name}_config.c"]
        with _in_c({**files, "shim.c": shim}, units) as code:
            both(name, _python(part, content), code, samples, _ROUNDS)
    efforts = np.repeat(np.random.default_rng(1).normal(0.0, 200.0, _EFFORTS // 20), 20)
    for name, plant in _PLANTS.items():
        model = plant_model("axis", plant, _T, "")
        with _in_c({**model.sources, "shim.c": _PLANT}, ["shim.c"]) as code:
            both(name, _plant_in_python(plant), code, efforts, 4)
    return [
        Comparison(
            title="A step of exported C (-O2) and of the compiled kernel",
            item="sample",
            error_name="relative difference",
            rows=tuple(rows.rows),
        )
    ]
