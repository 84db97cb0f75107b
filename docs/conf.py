"""Sphinx configuration; also writes the tables read from the code, and reports to look at."""

import ast
import inspect
import types
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import stickslip
from stickslip import __version__, write_report
from stickslip.estimation import ESTIMATORS
from stickslip.export import exporters
from stickslip.logs.formats.registry import CONVERTED, ENTRIES
from stickslip.records import PARAMETER_NAMES, QUANTITIES, Ending, Status
from stickslip.scenario import (
    ARM_CONTROLLERS,
    AXES,
    AXIS_CONTROLLERS,
    FileInput,
    GuessTable,
    SensorsTable,
    SineInput,
    Table,
    TaskTable,
)
from stickslip.tasks import demonstrate, position

project = "stickslip"
author = "the stickslip developers"
project_copyright = "2026, the stickslip developers"
release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx-mathjax-offline",
    "sphinx_copybutton",
]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "_generated", "evidence/mismatch-table.md"]
html_extra_path = ["_generated/pages"]
html_theme = "furo"
html_title = "stickslip"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_preprocess_types = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"
default_role = "code"

_MOST_QUANTITIES = 12  # named one by one in the table of exports


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in (head, tuple("---" for _ in head), *rows)]
    return "\n".join(lines) + "\n"


SAMPLES = {
    "text": "written in the tests; exports of TwinCAT Scope after public ones (CagtayFabry/pytcs)",
    "Parquet": "written by pyarrow",
    "Feather": "written by pyarrow",
    "MATLAB": "written by scipy, h5py and mat-io, none by MATLAB itself; public logs",
    "HDF5": "written by h5py",
    "ROS bag": "written by rosbags",
    "MCAP": "written by rosbags, and by mcap with protobuf and JSON",
    "LeRobot": "written by pyarrow after the description of version 3",
    "TDMS": "written by npTDMS",
    "MDF": "written by asammdf, versions 3.3 and 4.1",
    "SysId": "written in the tests after the source of SysId",
    "NPY": "written by NumPy",
    "NPZ": "written by NumPy",
}
"""Origin of the sample of each format of the registry, all in ``tests/factories``."""


def _write_tables() -> None:
    folder = Path(__file__).parent / "_generated"
    folder.mkdir(exist_ok=True)
    quantities = [
        (q.name, f"${q.symbol}$", q.linear, q.rotary)
        for key, q in QUANTITIES.items()
        if key != "inertia"
    ]
    (folder / "quantities.md").write_text(
        _table(("quantity", "symbol", "linear axis", "rotary axis"), quantities)
    )
    (folder / "estimators.md").write_text(
        _table(
            ("name", "method", "axis", "friction", "mass or inertia", "intervals", "online"),
            [
                (
                    f"`{entry.name}`",
                    entry.summary,
                    "rigid" if entry.rigid_only else "rigid, flexible",
                    "equal" if entry.symmetric_only else "equal, per direction",
                    "must be known" if entry.needs_inertia else "estimated or known",
                    "yes" if entry.gives_intervals else "no",
                    "yes" if entry.online else "no",
                )
                for entry in ESTIMATORS.values()
            ],
        )
    )
    (folder / "formats.md").write_text(
        _table(
            ("format", "endings", "extra", "libraries and their licences", "sample in the tests"),
            [
                (
                    entry.name,
                    ", ".join(
                        [f"`{ending}`" for ending in entry.endings]
                        + ([f"folder with `{entry.folder}`"] if entry.folder else [])
                    ),
                    f"`{entry.extra}`" if entry.extra else "-",
                    entry.libraries or "-",
                    SAMPLES[entry.name],
                )
                for entry in ENTRIES
            ],
        )
    )
    (folder / "converted.md").write_text(
        _table(
            ("format", "ending", "conversion"),
            [(name, f"`{ending}`", command) for ending, (name, command) in CONVERTED.items()],
        )
    )
    (folder / "statuses.md").write_text(
        _table(
            ("status", "exit code", "meaning and remedy"),
            [(f"`{s.value}`", "0" if s.trusted else "1", s.text) for s in Status],
        )
    )
    (folder / "endings.md").write_text(
        _table(
            ("ending", "exit code", "meaning and remedy"),
            [(f"`{e.value}`", "0" if e.reached else "1", e.text) for e in Ending],
        )
    )
    (folder / "exporters.md").write_text(
        _table(
            ("group", "target", "title", "side", "holds", "left out or changed", "options"),
            [
                (
                    each.group,
                    f"`{name}`",
                    each.title,
                    each.side or "either",
                    ", ".join(_in_words(each.represents)),
                    ", ".join(_in_words(each.cannot)),
                    ", ".join(f"`--{option.replace('_', '-')}`" for option in each.options),
                )
                for name, each in exporters().items()
            ],
        )
    )
    (folder / "parameters.md").write_text("\n".join(f"- `{n}`" for n in PARAMETER_NAMES) + "\n")


def _in_words(quantities: Iterable[str]) -> list[str]:
    """Return the terms of quantities; "all" of a target that holds every parameter."""
    names = list(quantities)
    if len(names) > _MOST_QUANTITIES:
        return ["all"]
    words = [name.replace("_", " ") for name in names]
    return [word.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck") for word in words]


def _type(annotation: Any) -> str:
    """Return the TOML type of a key."""
    if get_origin(annotation) is Literal:
        return ", ".join(f'`"{each}"`' for each in get_args(annotation))
    if get_origin(annotation) is tuple:
        return "list of numbers"
    if get_origin(annotation) is types.UnionType:
        return _type(get_args(annotation)[0])
    return {float: "number", int: "whole number", bool: "`true` or `false`", str: "text"}[
        annotation
    ]


def _keys(model: type[Table], names: Iterable[str]) -> str:
    """Return the table of keys of a model."""
    rows: list[tuple[str, ...]] = []
    for name in names:
        field, key = model.model_fields[name], model.declared()[name]
        default = "required" if field.is_required() else key.says
        if not default and field.default is not None:
            default = f"`{field.default}`".lower()
        units = " or ".join(unit for unit in dict.fromkeys(key.units) if unit)
        rows.append((f"`{name}`", _type(field.annotation), units, default, key.meaning))
    return _table(("key", "type", "unit", "default", "meaning"), rows)


def _variants(models: dict[str, type[Table]], key: str, where: str = "") -> list[str]:
    """Return the keys that the models share, and those that each has beside them."""
    first, *others = models.values()
    shared = [n for n in first.model_fields if all(n in each.model_fields for each in others)]
    parts = [_keys(first, [name for name in shared if name != key])]
    for name, model in models.items():
        own = [each for each in model.model_fields if each not in shared]
        parts.append(f'`{key} = "{name}"`{where}: {(model.__doc__ or "").splitlines()[0]}\n')
        parts += [_keys(model, own)] if own else []
    return parts


def _write_scenario_keys() -> None:
    """Write the keys of scenario files, as their models declare them."""
    parts = [
        "## `[axis]`\n",
        *_variants(dict(AXES.models), "law"),
        "## `[task]`\n",
        _keys(TaskTable, TaskTable.model_fields),
        "## `[sensors]`\n",
        _keys(SensorsTable, SensorsTable.model_fields),
        "## `[controller]` of a rigid axis\n",
        *_variants(dict(AXIS_CONTROLLERS.models), "method"),
        "## `[controller]` of a flexible arm\n",
        *_variants(dict(ARM_CONTROLLERS.models), "method"),
        "## `[guess]`\n",
        _keys(GuessTable, GuessTable.model_fields),
        "Each controller uses some of these; others are errors.\n",
        _table(
            ("method", "uses"),
            [
                (f"`{name}`{where}", ", ".join(f"`{each}`" for each in model.guesses))
                for table, where in ((AXIS_CONTROLLERS, ""), (ARM_CONTROLLERS, ", flexible arm"))
                for name, model in table.models.items()
                if model.guesses
            ],
        ),
        "## `[input]`: sines\n",
        _keys(SineInput, SineInput.model_fields),
        "## `[input]`: a file\n",
        _keys(FileInput, FileInput.model_fields),
    ]
    folder = Path(__file__).parent / "_generated"
    (folder / "scenario_keys.md").write_text("\n".join(parts))


PUBLIC_NAMES = {
    "Read and write logs": """
        inspect read_log read_axes log_from_frame find_benchmark read_schema LogSchema AxisSchema
        AxisLog write_csv""",
    "Identify": """
        identify identify_axes examine EstimationTask Identification FrictionEstimate Status
        predict_effort compare_log compare_scenario""",
    "Estimators": """
        ESTIMATORS SelectedModelEstimator JointEstimator EnergyEstimator PublishedEnergyEstimator
        MaximumLikelihoodEstimator ProcessNoiseLikelihoodEstimator IdimLeastSquares
        IdimInstrumentalVariables StribeckEstimator FreeDecayEstimator""",
    "Online estimators": """
        ExtendedKalmanFilter RecursiveLeastSquares LeastSquaresObserver FriedlandParkObserver
        YazdizadehKhorasaniObserver LiaoChienObserver GradientEstimator""",
    "Design experiments": "excite design_input cramer_rao_bound process_noise_bound",
    "Axes and friction laws": """
        SingleMass FlexibleArm CoulombViscousFriction StribeckFriction DahlFriction LuGreFriction
        ElastoPlasticFriction""",
    "Simulate": "simulate simulate_batch simulate_closed_loop Sensors SensorSample read_scenario",
    "Position": """
        position PreciseController ExactPulseController PulseWidthController
        PulseAmplitudeWidthController LearnedPulses LandingController AxisLandingController
        TrackedLandingController""",
    "Feedback": """
        FeedbackController PD Notch FrictionCompensation OnlineFriction PIDController ResetIntegral
        ProfileController Dither PointToPoint Move RestDetection""",
    "Show and save results": "write_report figures_of json_text write_json InputError",
}
"""Every name that `stickslip` exports, by task."""


def _first_line(thing: Any) -> str:
    """Return the first line of the docstring; empty for a registry."""
    documented = inspect.isclass(thing) or inspect.isroutine(thing)
    return (inspect.getdoc(thing) or "").splitlines()[0] if documented else ""


def _write_names() -> None:
    """Write the public names by task, each with the first line of its docstring.

    Raises
    ------
    ValueError
        If a name is missing here, or stands here twice.
    """
    listed = [name for names in PUBLIC_NAMES.values() for name in names.split()]
    if sorted(listed) != sorted(stickslip.__all__):
        wrong = sorted({*listed} ^ {*stickslip.__all__}) or "some twice"
        raise ValueError(f"PUBLIC_NAMES and stickslip.__all__ differ: {wrong}")
    stub = ast.parse(Path(stickslip.__file__).with_suffix(".pyi").read_text())
    imports = [each for each in stub.body if isinstance(each, ast.ImportFrom)]
    packages = {name.name: each.module for each in imports for name in each.names}
    parts: list[str] = []
    for task, names in PUBLIC_NAMES.items():
        rows = [
            (
                f"[`{name}`](#stickslip.{packages[name]}.{name})" if line else f"`{name}`",
                line or "every registered one, by name",
            )
            for name in names.split()
            for line in [_first_line(getattr(stickslip, name))]
        ]
        parts += [f"## {task}\n", _table(("name", "what it is"), rows)]
    (Path(__file__).parent / "_generated" / "names.md").write_text("\n".join(parts))


def _write_demonstration() -> None:
    docs = Path(__file__).parent
    folder = docs / "_generated" / "pages" / "demo"
    demonstrate(folder)
    for scenario, page in (("gravity", "positioning"), ("arm", "arm")):
        task = position(docs.parent / "examples" / "scenarios" / f"{scenario}.toml")
        write_report(task, folder / f"{page}.html")


_write_tables()
_write_names()
_write_scenario_keys()
_write_demonstration()
