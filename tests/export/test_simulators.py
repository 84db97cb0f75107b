"""Code and models for simulators: run, or parsed and run against stand-ins, and compared."""

import math
import runpy
import sys
import types

import numpy as np
import pytest
from exports import COULOMB, INERTIA, VISCOUS, document
from laws import uneven
from refusals import refuses

from stickslip import CoulombViscousFriction, SingleMass, StribeckFriction, simulate
from stickslip.export import ExportSettings, render

STATIC = {"static_friction": 0.7, "stribeck_velocity": 0.05}


def text(target, estimate=None, joint="elbow", **settings):
    result = render(
        document() if estimate is None else estimate,
        target,
        joint=joint,
        settings=ExportSettings(**settings),
    )
    return result.rendered.files[""], result.rendered.notes


def names_of(path, monkeypatch, modules=()):
    """Return what a file of code defines, with stand-ins for modules that are not installed."""
    for name in modules:
        around = None
        for count in range(1, name.count(".") + 2):
            path_of_module = ".".join(name.split(".")[:count])
            module = sys.modules.get(path_of_module) or Recorder(path_of_module)
            monkeypatch.setitem(sys.modules, path_of_module, module)
            if around is not None:
                setattr(around, name.split(".")[count - 1], module)
            around = module
    return runpy.run_path(str(path))


class Recorder(types.ModuleType):
    """A module whose functions return their name and arguments."""

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *args, **kwargs: (name, args, kwargs)


# python-control


def control_step(tmp_path, estimate, joint="elbow", sampling_time=0.01):
    pytest.importorskip("control")
    path = tmp_path / "axis.py"
    path.write_text(text("python-control", estimate, joint, sampling_time=sampling_time)[0])
    return runpy.run_path(str(path))


PER_DIRECTION = {
    "coulomb_friction": "absent",
    "coulomb_friction_positive": 0.7,
    "coulomb_friction_negative": 0.4,
    "viscous_friction": "absent",
    "viscous_friction_positive": 0.3,
    "viscous_friction_negative": 0.1,
}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("changes", "law"),
    [
        (
            {"offset": 0.1, "static_friction": 0.65},
            CoulombViscousFriction.symmetric(
                coulomb_friction=COULOMB,
                viscous_friction=VISCOUS,
                static_friction=0.65,
                offset=0.1,
            ),
        ),
        (
            {"viscous_friction": "absent"},
            CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=0.0),
        ),
        (
            PER_DIRECTION,
            uneven(coulomb=(0.55, 0.55), static=(0.55, 0.55), viscous=(0.3, 0.1), offset=0.15),
        ),
    ],
)
def test_python_control_steps_exactly(changes, law, tmp_path):
    names = control_step(tmp_path, document(**changes))
    generator = np.random.default_rng(1)
    effort = np.repeat(generator.uniform(-1.5, 1.5, 60), 5)
    plant = SingleMass(mass=INERTIA, friction=law, kind="rotary")
    motion = simulate(plant, effort, sampling_time=0.01)
    control = sys.modules["control"]
    times = 0.01 * np.arange(effort.size + 1)
    found = control.input_output_response(
        names["elbow"], times, np.append(effort, 0.0), [0.0, 0.0]
    ).outputs
    assert np.any(motion.velocity == 0.0)
    assert found[0] == pytest.approx(motion.position, abs=1e-11)
    assert found[1] == pytest.approx(motion.velocity, abs=1e-11)


def test_python_control_holds_and_decelerates(tmp_path):
    step = control_step(tmp_path, document(static_friction=0.7))["step"]
    for share in (0.3, 0.9):
        assert step(0.0, 0.0, share * 0.7, 10.0) == (0.0, 0.0)
    assert step(0.0, 0.0, 1.01 * 0.7, 1.0)[1] > 0.0
    stop = INERTIA / VISCOUS * math.log1p(VISCOUS * 6.0 / COULOMB)
    assert step(0.0, 6.0, 0.0, 0.999 * stop)[1] > 0.0
    assert step(0.0, 6.0, 0.0, 1.001 * stop)[1] == 0.0


# Modelica


def parameters_of_modelica(content, component):
    """Return the modifications of a component, as pymoca parses them."""
    parser = pytest.importorskip("pymoca.parser")
    tree = parser.parse(content)
    assert tree is not None, "it does not parse"
    (model,) = [each for each in tree.classes.values() if each.name == "elbow"]
    return model, model.symbols[component]


def test_modelica_of_a_rotary_axis_parses():
    content, _ = text("modelica", document(**STATIC))
    model, _ = parameters_of_modelica(content, "friction")
    assert set(model.symbols) >= {"flange_a", "flange_b", "inertia", "friction"}
    assert len(model.equations) == 3


def test_modelica_of_a_linear_axis_parses():
    content, notes = text("modelica", document("linear", **STATIC))
    parameters_of_modelica(content, "mass")
    for each in ("F_prop = 0.2", "F_Coulomb = 0.5", "fexp = 20.0", "m = 0.05"):
        assert each in content
    assert "F_Stribeck = 0.2" in content.replace("0.19999999999999996", "0.2")
    x = np.linspace(0.0, 10.0, 100_001)
    deviation = 0.2 * np.max(np.abs(np.exp(-x) - np.exp(-(x**2))))
    (note,) = [each for each in notes if "exponential" in each]
    assert float(note.split(": ")[1].split()[0]) == pytest.approx(deviation, rel=0.01)


def bearing_table(content):
    rows = content.split("tau_pos = [")[1].split("]")[0].split(";")
    peak = float(content.split("peak = ")[1].split(")")[0])
    return np.array([[float(each) for each in row.split(",")] for row in rows]), peak


@pytest.mark.parametrize("changes", [{}, STATIC, {"static_friction": 0.7}])
def test_bearing_friction_has_the_law(changes):
    content, _ = text("modelica", document(**changes))
    table, peak = bearing_table(content)
    assert peak >= 1.0
    assert peak * table[0, 1] == pytest.approx(0.7 if changes else COULOMB, rel=0.02)
    speed = np.linspace(0.001, 20.0, 500)
    # Linear interpolation, beyond the last point along the last line
    slope = (table[-1, 1] - table[-2, 1]) / (table[-1, 0] - table[-2, 0])
    found = np.where(
        speed <= table[-1, 0],
        np.interp(speed, *table.T),
        table[-1, 1] + slope * (speed - table[-1, 0]),
    )
    law = COULOMB + VISCOUS * speed
    if "stribeck_velocity" in changes:
        law = law + 0.2 * np.exp(-((speed / 0.05) ** 2))
    assert found == pytest.approx(law, rel=0.05)


def test_modelica_needs_the_inertia():
    with refuses("parameter_absent", name="inertia"):
        text("modelica", document(inertia="absent"))


# Simscape


def test_simscape_sets_the_parameters_of_the_block():
    content, notes = text("simscape", document(**STATIC), top_speed=5.0)
    law = StribeckFriction.symmetric(
        coulomb_friction=COULOMB, viscous_friction=VISCOUS, static_friction=0.7,
        stribeck_velocity=0.05,
    )  # fmt: skip
    for each in ("'brkwy_trq', '0.7'", "'Col_trq', '0.5'", "'visc_coef', '0.2'"):
        assert each in content
    breakaway = float(content.split("'brkwy_vel', '")[1].split("'")[0])
    speed = np.linspace(breakaway, 5.0, 200_001)
    share = speed / (math.sqrt(2.0) * breakaway)
    block = (
        math.sqrt(2.0 * math.e) * 0.2 * np.exp(-(share**2)) * share
        + 0.5 * np.tanh(10.0 * speed / breakaway)
        + 0.2 * speed
    )
    above = np.max(np.abs(block - law.friction(speed)))
    (note,) = [each for each in notes if "smoothed" in each]
    stated = float(note.split("holding, and ")[1].split()[0])
    assert stated == pytest.approx(above, rel=0.01)


def test_simscape_of_a_linear_axis():
    content, _ = text("simscape", document("linear"))
    assert "Translational Friction" in content
    assert "'Col_frc', '0.5'" in content


# Isaac Lab, Genesis, Drake, mjlab: these are too large to install for a test


@pytest.fixture
def written(tmp_path, monkeypatch):
    def write(target, modules, **kwargs):
        path = tmp_path / "friction.py"
        path.write_text(text(target, **kwargs)[0])
        return names_of(path, monkeypatch, modules)

    return write


def test_isaac_lab_runs_against_a_stand_in(written):
    names = written(
        "isaac-lab", ["isaaclab.actuators"], estimate=document(**STATIC), link_inertia=0.02
    )
    (name, _, values) = names["ACTUATORS"]["elbow"]
    assert name == "ImplicitActuatorCfg"
    assert values == {
        "joint_names_expr": ["elbow"],
        "stiffness": None,
        "damping": None,
        "friction": 0.7,
        "dynamic_friction": COULOMB,
        "viscous_friction": VISCOUS,
        "armature": pytest.approx(0.03),
    }


def test_isaac_lab_takes_names_as_regular_expressions(written):
    import re

    names = written("isaac-lab", ["isaaclab.actuators"], joint="arm.joint+3")
    (expression,) = names["ACTUATORS"]["arm.joint+3"][2]["joint_names_expr"]
    assert re.fullmatch(expression, "arm.joint+3")
    assert not re.fullmatch(expression, "armXjoint+3")


def test_genesis_sets_friction_and_armature(written):
    calls = []

    class Entity:
        def get_joint(self, name):
            return types.SimpleNamespace(dofs_idx_local=[7] if name == "elbow" else None)

        def __getattr__(self, name):
            return lambda values, dofs_idx_local: calls.append((name, values, dofs_idx_local))

    written("genesis", [])["apply_friction"](Entity())
    assert calls == [
        ("set_dofs_frictionloss", [COULOMB], [7]),
        ("set_dofs_damping", [VISCOUS], [7]),
        ("set_dofs_armature", [0.0], [7]),
    ]


def test_drake_sets_the_damping(written):
    damping = {}

    class Plant:
        def GetJointByName(self, name):  # noqa: N802 - of Drake
            return types.SimpleNamespace(
                set_default_damping=lambda value: damping.setdefault(name, value)
            )

    written("drake", [])["apply_friction"](Plant())
    assert damping == {"elbow": VISCOUS}
    _, notes = text("drake")
    assert any("no Coulomb friction" in each for each in notes)


def test_drake_takes_the_damping(written, tmp_path):
    pytest.importorskip("pydrake", reason="drake is not installed")
    from exports import URDF
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    path = tmp_path / "arm.urdf"
    path.write_text(URDF)
    plant = MultibodyPlant(0.001)
    Parser(plant).AddModels(str(path))
    written("drake", [])["apply_friction"](plant)
    assert plant.GetJointByName("elbow").default_damping() == VISCOUS


def test_drake_decelerates_by_viscous_friction(written, tmp_path):
    pytest.importorskip("pydrake", reason="drake is not installed")
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder

    path = tmp_path / "arm.urdf"
    inertial = (
        '<inertial><mass value="1"/><inertia ixx="0.05" iyy="0.05" izz="0.05" ixy="0" ixz="0" '
        'iyz="0"/></inertial>'
    )
    path.write_text(
        f'<robot name="arm"><link name="base"/><link name="link">{inertial}</link>'
        '<joint name="elbow" type="continuous"><parent link="base"/><child link="link"/>'
        '<axis xyz="0 0 1"/></joint></robot>'
    )
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0001)
    Parser(plant).AddModels(str(path))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    written("drake", [])["apply_friction"](plant)
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetVelocities(context, [2.0])
    simulator.AdvanceTo(0.2)
    speed = plant.GetVelocities(context)[0]
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=VISCOUS)
    axis = SingleMass(mass=0.05, friction=law, kind="rotary")
    motion = simulate(axis, np.zeros(200), sampling_time=0.001, initial_state=(0.0, 2.0))
    assert 2.0 - speed == pytest.approx(2.0 - motion.velocity[200], rel=0.01)


def test_isaac_lab_events_scale(written):
    estimate = document()
    estimate["parameters"]["viscous_friction"]["ci95"] = [0.15, 0.26]
    names = written(
        "isaac-lab-events", ["isaaclab.envs.mdp", "isaaclab.managers"], estimate=estimate
    )
    _, _, values = names["EVENTS"]["elbow_friction"]
    # Isaac Lab draws static, dynamic and viscous friction from this one range
    assert values["params"]["operation"] == "scale"
    assert values["params"]["friction_distribution_params"] == pytest.approx((0.75, 1.3))


def test_mjlab_events_are_absolute(written):
    names = written(
        "mjlab-events",
        ["mjlab.envs.mdp.dr", "mjlab.managers.event_manager", "mjlab.managers.scene_entity_config"],
    )
    ranges = {name: each[2]["params"]["ranges"] for name, each in names["EVENTS"].items()}
    assert ranges == {
        "elbow_joint_friction": pytest.approx((0.49, 0.51)),
        "elbow_joint_damping": pytest.approx((0.196, 0.204)),
    }


def test_ranges_are_yaml_with_correlations():
    yaml = pytest.importorskip("yaml")
    estimate = document(offset=-0.1)
    covariance = np.array(estimate["covariance"])
    covariance[1, 2] = covariance[2, 1] = 0.5 * math.sqrt(covariance[1, 1] * covariance[2, 2])
    estimate["covariance"] = covariance.tolist()
    content, _ = text("ranges", {"axes": {"elbow": estimate, "knee": document()}}, joint=None)
    joints = yaml.safe_load(content)["joints"]
    assert set(joints) == {"elbow", "knee"}
    offset = joints["elbow"]["parameters"]["offset"]
    assert offset == {
        "value": -0.1,
        "low": pytest.approx(-0.102),
        "high": pytest.approx(-0.098),
        "std": pytest.approx(0.001),
        "unit": "N m",
    }
    matrix = joints["elbow"]["correlations"]
    assert list(matrix) == list(joints["elbow"]["parameters"])
    assert matrix["viscous_friction"] == [0.0, 1.0, 0.5, 0.0]
