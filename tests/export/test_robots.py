"""Robot descriptions: every other byte stays, and the real consumers read the values."""

import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from exports import COULOMB, INERTIA, MJCF, ROBOTS, SDF, URDF, USD, VISCOUS, document
from refusals import refuses

from stickslip import CoulombViscousFriction, SingleMass, StribeckFriction, simulate
from stickslip.export import EstimateReading, ExportSettings, Transmission, render, write
from stickslip.records import MissingExtraError

XML = ("urdf", "sdf", "mjcf")
CREEP = 1e-4  # rad in 10 s at rest
DECELERATION = 0.01  # of the change of velocity


def edited(target, joint="elbow", into=None, settings=None, **changes):
    kind = "linear" if joint == "slide" else "rotary"
    into = ROBOTS[target] if into is None else into
    result = render(document(kind, **changes), target, into=into, joint=joint, settings=settings)
    (content,) = result.rendered.files.values()
    return content if isinstance(content, str) else content.decode()


def added(before, after):
    """Return what was inserted, if nothing else has changed."""
    start = next(k for k in range(len(before) + 1) if before[:k] != after[:k]) - 1
    end = next(k for k in range(1, len(before) + 2) if before[-k:] != after[-k:]) - 1
    return start, len(before) - end, after[start : len(after) - end]


@pytest.mark.parametrize("target", XML)
@pytest.mark.parametrize("joint", ["elbow", "slide"])
def test_what_was_there_remains_in_its_order(target, joint):
    before, after = ROBOTS[target], edited(target, joint)
    rest = iter(after)
    assert all(each in rest for each in before), "a byte was removed or moved"
    # Without what was added it is the file as it was
    for line in before.splitlines():
        assert line in after or joint in line or "/axis" in line or "/joint" in line, line


@pytest.mark.parametrize("target", XML)
def test_line_ends_and_encoding_stay(target):
    before = ROBOTS[target].replace("\n", "\r\n").encode()
    before = before.replace(b"-->", "Gelenk \xe4 -->".encode(), 1)
    after = edited(target, into=before)
    assert "\n" not in after.replace("\r\n", "")
    assert "Gelenk \xe4" in after


@pytest.mark.parametrize("target", XML)
@pytest.mark.parametrize(
    ("head", "encoding"),
    [
        ("\ufeff<?xml version='1.0' encoding='UTF-8'?>", "utf-8"),
        ("<?xml version='1.0' encoding='ISO-8859-1'?>", "latin-1"),
        ("<?xml version='1.0'?><!DOCTYPE r [<!-- <joint/> --><!ENTITY e 'x'>]>", "utf-8"),
    ],
)
def test_encodings_and_names_beyond_ascii(target, head, encoding):
    name = 'Gelenk "Ö" & <1>'
    quoted = "'" + name.replace("&", "&amp;").replace("<", "&lt;") + "'"
    body = ROBOTS[target].replace('"elbow"', quoted)
    body = body[body.index("?>") + 2 :] if body.startswith("<?xml") else body
    before = (head + body).encode(encoding)
    estimate = document(static_friction=0.7, stribeck_velocity=0.05)
    estimate["provenance"]["files"] = ["Prüfstand ÷--.csv"]
    result = render(estimate, target, into=before, joint=name)
    after = result.rendered.files[""]
    after.decode(encoding)
    rest = iter(after)
    assert all(each in rest for each in before)
    again = render(estimate, target, into=after, joint=name)
    assert again.rendered.files[""] == after
    root = ElementTree.fromstring(after)  # noqa: S314 - of this test
    motors = [each.get("joint") for each in root.iter("dcmotor")]
    assert motors == ([name] if target == "mjcf" else [])


@pytest.mark.parametrize("target", XML)
def test_a_second_export_changes_nothing(target):
    once = edited(target)
    assert edited(target, into=once) == once


@pytest.mark.parametrize("target", XML)
def test_existing_values_need_overwrite(target):
    once = edited(target)
    with refuses("values_present", joint="elbow") as caught:
        edited(target, into=once, viscous_friction=0.3)
    assert any("0.2 -> 0.3" in each for each in caught.value.quantities["changes"])
    again = edited(target, into=once, viscous_friction=0.3, settings=ExportSettings(overwrite=True))
    assert again == edited(target, viscous_friction=0.3)


def test_values_of_usd_need_overwrite():
    layer = edited("usd")
    values = layer[layer.index('over "elbow"') :].splitlines()
    line = next(each for each in values if "newton:damping" in each)
    into = USD.replace('token physics:axis = "Z"', f'token physics:axis = "Z"\n{line}')
    assert edited("usd", into=into)
    with refuses("values_present", joint="elbow"):
        edited("usd", into=into, viscous_friction=0.3)


@pytest.mark.parametrize("target", ROBOTS)
def test_existing_values_of_all_joints_are_shown(target):
    def robot(viscous):
        return {
            "axes": {"elbow": document(), "slide": document("linear", viscous_friction=viscous)}
        }

    once = ROBOTS[target]
    if target != "usd":
        first = render(robot(3.5), target, into=once, joint=None)
        once = first.rendered.files[""]
    else:
        for axis, joint in (("Z", "elbow"), ("X", "slide")):
            assert joint in once
            line = f'token physics:axis = "{axis}"'
            once = once.replace(line, f"{line}\nfloat newton:damping = 77")
        assert once.count("77") == 2
    changed = robot(9.25)
    changed["axes"]["elbow"] = document(viscous_friction=0.3)
    with refuses("values_present", joint="elbow") as caught:
        render(changed, target, into=once)
    assert "joint 'slide'" in caught.value.quantities["more"]
    assert "9.25" in caught.value.quantities["more"]


@pytest.mark.parametrize(("target", "other"), [("urdf", "mjcf"), ("mjcf", "sdf"), ("sdf", "urdf")])
def test_a_robot_of_another_format_is_named(target, other):
    with refuses("other_robot_format"):
        edited(target, into=ROBOTS[other])


@pytest.mark.parametrize("target", ROBOTS)
def test_an_unknown_joint_suggests_similar_names(target):
    with refuses("unknown_joint", joint="elbov", choices=("elbow",)):
        edited(target, joint="elbov")
    with refuses("unknown_joint", joint="knee") as caught:
        edited(target, joint="knee")
    assert set(caught.value.quantities["choices"]) >= {"elbow", "slide"}


@pytest.mark.parametrize("target", ROBOTS)
def test_a_linear_estimate_is_refused_by_a_revolute_joint(target):
    with refuses("joint_of_other_kind", joint="elbow", kind="linear", other="rotary"):
        render(document("linear"), target, into=ROBOTS[target], joint="elbow")
    with refuses("joint_of_other_kind", joint="slide", kind="rotary", other="linear"):
        render(document("rotary"), target, into=ROBOTS[target], joint="slide")


def test_a_fixed_joint_has_no_friction():
    with refuses("joint_of_no_axis", joint="weld", type="fixed"):
        edited("urdf", joint="weld")


def test_a_joint_twice_is_ambiguous():
    with refuses("joint_not_unique", joint="elbow", count=2):
        edited("urdf", into=URDF.replace('name="weld"', 'name="elbow"'))


@pytest.mark.parametrize("target", XML)
@pytest.mark.parametrize("content", [b"", b"{}", b"<a>", b"\xff\xfe<\x00", b"<?xml?><a/>"])
def test_what_is_no_xml_is_refused(target, content):
    with pytest.raises(ValueError, match=r".") as caught:
        edited(target, into=content)
    assert caught.value.code in {"not_xml", "encoding_not_edited"}


def test_a_comment_cannot_end_early():
    assert "elbow--test" not in edited("urdf")  # the name of the log, in a comment
    assert "elbow- -test.csv" in edited("urdf")


def test_yourdfpy_reads_the_values(tmp_path):
    yourdfpy = pytest.importorskip("yourdfpy")
    path = tmp_path / "arm.urdf"
    path.write_text(edited("urdf", "slide", into=edited("urdf")))
    code = (
        "import sys, warnings; warnings.simplefilter('ignore'); import yourdfpy;"
        "m = yourdfpy.URDF.load(sys.argv[1], load_meshes=False, build_scene_graph=False).joint_map;"
        "print([m[n].dynamics.damping for n in ('elbow', 'slide')],"
        "[m[n].dynamics.friction for n in ('elbow', 'slide')])"
    )
    assert yourdfpy
    shown = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True
    ).stdout
    assert shown.replace("'", "").strip() == f"{[VISCOUS] * 2} {[COULOMB] * 2}"


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("joint", ["elbow", "slide"])
@pytest.mark.parametrize("target", XML)
def test_drake_reads_the_damping(target, joint, tmp_path):
    pytest.importorskip("pydrake", reason="drake is not installed")
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    path = tmp_path / f"arm.{'xml' if target == 'mjcf' else target}"
    path.write_text(edited(target, joint))
    plant = MultibodyPlant(0.001)
    Parser(plant).AddModels(str(path))
    assert plant.GetJointByName(joint).default_damping() == VISCOUS


@pytest.mark.parametrize("joint", ["elbow", "slide"])
def test_sdf_has_values_where_the_specification_has_them(joint):
    # The path is that of sdformat's joint.sdf; Drake reads the damping there, and no friction
    root = ElementTree.fromstring(edited("sdf", joint))  # noqa: S314 - of this test
    dynamics = root.find(f"./model/joint[@name='{joint}']/axis/dynamics")
    assert float(dynamics.find("damping").text) == VISCOUS
    assert float(dynamics.find("friction").text) == COULOMB
    if joint == "slide":
        assert dynamics.find("spring_stiffness").text == "3"


@pytest.mark.parametrize(
    ("joint", "axis", "per"), [("elbow", "angular", np.pi / 180.0), ("slide", "linear", 1.0)]
)
@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_usd_core_composes_the_layer(joint, axis, per, unit, tmp_path):
    Usd = pytest.importorskip("pxr.Usd")
    robot, out = tmp_path / "arm.usda", tmp_path / "sub" / "friction.usda"
    robot.write_text(USD.replace("metersPerUnit = 1", f"metersPerUnit = {unit}"))
    out.parent.mkdir()
    kind = "rotary" if joint == "elbow" else "linear"
    settings = ExportSettings(link_inertia=0.02)
    write(document(kind), "usd", out, into=robot, joint=joint, settings=settings)
    stage = Usd.Stage.Open(str(out))
    prim = stage.GetPrimAtPath(f"/arm/joints/{joint}")
    assert prim.GetAttribute("physics:axis").Get()  # from the user's file
    length = 1.0 / unit
    effort = length**2 if kind == "rotary" else length
    viscous = per * VISCOUS * (length**2 if kind == "rotary" else 1.0)
    inertia = 0.03 * (length**2 if kind == "rotary" else 1.0)
    expected = {
        f"physxJointAxis:{axis}:viscousFrictionCoefficient": viscous,
        f"physxJointAxis:{axis}:dynamicFrictionEffort": COULOMB * effort,
        f"physxJointAxis:{axis}:staticFrictionEffort": COULOMB * effort,
        f"physxJointAxis:{axis}:armature": inertia,
        "newton:damping": viscous,
        "newton:friction": COULOMB * effort,
        "newton:armature": inertia,
    }
    found = {name: prim.GetAttribute(name).Get() for name in expected}
    assert found == pytest.approx(expected, rel=1e-6)
    assert prim.GetMetadata("apiSchemas").GetAddedOrExplicitItems() == [
        f"PhysxJointAxisAPI:{axis}",
        "NewtonJointAPI",
    ]
    assert stage.GetDefaultPrim().GetName() == "arm"
    assert "joint side, units of the stage" in out.read_text()
    assert "SI units" not in out.read_text()


def test_a_missing_library_names_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "pxr", None)
    with refuses("missing_extra", MissingExtraError, extra="usd"):
        edited("usd")


def test_what_is_no_usd_is_refused(tmp_path):
    pytest.importorskip("pxr.Usd")
    for content in (b"", b"nothing", b"#usda 1.0\ndef {"):
        with refuses("not_usd"):
            edited("usd", into=content)


def test_a_binary_stage_is_left_as_it_is(tmp_path):
    Usd = pytest.importorskip("pxr.Usd")
    text, robot, out = (tmp_path / name for name in ("arm.usda", "arm.usdc", "friction.usda"))
    text.write_text(USD)
    plain = Usd.Stage.Open(str(text))
    plain.GetRootLayer().Export(str(robot))
    before = robot.read_bytes()
    write(document(), "usd", out, into=robot, joint="/arm/joints/elbow")
    assert robot.read_bytes() == before
    stage = Usd.Stage.Open(str(out))
    prim = stage.GetPrimAtPath("/arm/joints/elbow")
    assert prim.GetAttribute("newton:friction").Get() == pytest.approx(COULOMB)


def test_a_layer_does_not_replace_the_file_that_it_is_over(tmp_path):
    pytest.importorskip("pxr.Usd")
    robot = tmp_path / "arm.usda"
    robot.write_text(USD)
    with refuses("layer_over_itself"):
        write(document(), "usd", robot, into=robot, joint="elbow")
    assert robot.read_text() == USD


# MuJoCo, with an inertia of the model that is the identified one


def mujoco_model(xml):
    mujoco = pytest.importorskip("mujoco")
    return mujoco, mujoco.MjModel.from_xml_string(xml)


def stepped(xml, times, start, load):
    """Return position and velocity of the first joint under a load that is a function of time."""
    mujoco, model = mujoco_model(xml)
    data = mujoco.MjData(model)
    data.qvel[0] = start
    states = []
    for time in times:
        while data.time < time - 1e-9:
            data.qfrc_applied[0] = load(data.time)
            mujoco.mj_step(model, data)
        states.append((float(data.qpos[0]), float(data.qvel[0])))
    return np.array(states)


def velocities(xml, times, start, load=0.0):
    """Return position and velocity of the first joint under a constant load."""
    return stepped(xml, times, start, lambda _: load)


def exact(law, times, start, load=0.0):
    plant = SingleMass(mass=INERTIA, friction=law, kind="rotary")
    step = 0.001
    motion = simulate(
        plant,
        np.full(round(times[-1] / step), load),
        sampling_time=step,
        initial_state=(0.0, start),
    )
    return np.interp(times, np.arange(motion.velocity.size) * step, motion.velocity)


LAW = CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=VISCOUS)


@pytest.fixture(params=["degree", "radian"])
def angle(request):
    return request.param


@pytest.fixture(params=["0.0005", "0.001", "0.002", "0.004"])
def any_model(request, angle):
    """Return a model of any unit of angles and any time step."""
    into = MJCF.replace("'0.001'", f"'{request.param}'")
    return into.replace('angle="degree"', f'angle="{angle}"')


def test_mujoco_decelerates_as_the_estimate_does(any_model):
    times = np.array([0.06, 0.12, 0.16, 0.2])
    found = velocities(edited("mjcf", into=any_model), times, start=6.0)[:, 1]
    expected = exact(LAW, times, start=6.0)
    assert np.abs(found - expected) == pytest.approx(0.0, abs=DECELERATION * 6.0)
    assert 6.0 - found == pytest.approx(6.0 - expected, rel=DECELERATION)


@pytest.mark.parametrize("share", [0.3, 0.9, -0.9])
def test_mujoco_holds_below_the_friction(any_model, share):
    xml = edited("mjcf", into=any_model)
    position = velocities(xml, [10.0], start=0.0, load=share * COULOMB)[0, 0]
    assert abs(position) < CREEP


def test_mujoco_creeps_with_its_defaults():
    """The settings of the constraint are what keeps it."""
    xml = edited("mjcf")
    start = xml.index(" solreffriction")
    xml = xml[:start] + xml[xml.index("/>", start) :]
    position = velocities(xml, [10.0], start=0.0, load=0.3 * COULOMB)[0, 0]
    assert position > 100.0 * CREEP


@pytest.mark.parametrize(("inertia", "step"), [(0.05, "0.001"), (0.002, "0.001"), (0.002, "0.004")])
def test_the_creep_of_mujoco_is_stated(inertia, step):
    into = MJCF.replace("0.05 0.05 0.05", f"{inertia} {inertia} {inertia}")
    into = into.replace("0.001", step)
    result = render(document(inertia=inertia), "mjcf", into=into, joint="elbow")
    (note,) = [each for each in result.rendered.notes if "creeps by up to" in each]
    stated = float(note.split("up to ")[1].split()[0])
    xml = result.rendered.files[""].decode()
    found = velocities(xml, [1.0, 11.0], start=0.0, load=0.999 * COULOMB)[:, 0]
    assert (found[1] - found[0]) / 10.0 == pytest.approx(stated, rel=0.2)


def test_mujoco_slips_above_the_friction():
    xml = edited("mjcf")
    found = velocities(xml, [0.5], start=0.0, load=1.5 * COULOMB)[0, 1]
    assert found == pytest.approx(exact(LAW, np.array([0.5]), 0.0, 1.5 * COULOMB)[0], rel=0.01)


def test_mujoco_reads_the_values_of_a_slide_joint_over_its_class():
    _, model = mujoco_model(edited("mjcf", "slide"))
    assert model.dof_damping[1] == VISCOUS
    assert model.dof_frictionloss[1] == COULOMB
    result = render(document("linear"), "mjcf", into=MJCF, joint="slide")
    assert any("damping 9" in each for each in result.rendered.notes)


def test_mujoco_takes_the_armature_beyond_the_link():
    _, model = mujoco_model(edited("mjcf", settings=ExportSettings(link_inertia=0.03)))
    assert model.dof_armature[0] == pytest.approx(0.02)
    with refuses("link_inertia_too_large"):
        edited("mjcf", settings=ExportSettings(link_inertia=0.06))
    assert "armature" not in edited("mjcf").split("<joint name")[1].split("/>")[0]


def test_mujoco_takes_quadratic_friction_as_a_polynomial():
    quadratic = 0.05
    xml = edited("mjcf", into=MJCF.replace("0.001", "0.0002"), quadratic_friction=quadratic)
    times = np.array([0.02, 0.05])
    found = velocities(xml, times, start=20.0)[:, 1]
    speed, expected = 20.0, []
    for time in np.arange(0.0, 0.05, 1e-5):
        speed -= 1e-5 / INERTIA * (COULOMB + VISCOUS * speed + quadratic * speed**2)
        if np.isclose(time + 1e-5, times, atol=1e-9).any():
            expected.append(speed)
    assert 20.0 - found == pytest.approx(20.0 - np.array(expected), rel=DECELERATION)


def test_mujoco_takes_friction_with_a_power_of_two_thirds_as_a_polynomial():
    law = {"two_thirds_friction": (0.3, "N m (s/rad)^(2/3)")}
    result = render(
        document(**law), "mjcf", into=MJCF, joint="elbow", settings=ExportSettings(top_speed=8.0)
    )
    _, model = mujoco_model(result.rendered.files[""].decode())
    speed = np.linspace(0.0, 8.0, 1001)
    found = model.dof_damping[0] * speed + np.polyval(
        [*model.dof_dampingpoly[0][::-1], 0, 0], speed
    )
    expected = VISCOUS * speed + 0.3 * speed ** (2.0 / 3.0)
    (note,) = [each for each in result.rendered.notes if "polynomial" in each]
    stated = float(note.split(": ")[1].split()[0])
    assert np.max(np.abs(found - expected)) == pytest.approx(stated, rel=0.05)
    assert stated < 0.05 * expected[-1]
    left_out = render(document(**law), "mjcf", into=MJCF, joint="elbow")
    assert any("2/3 power of the speed is left out" in each for each in left_out.rendered.notes)


STATIC, STRIBECK = 0.7, 0.05
WITH_STATIC = {"static_friction": STATIC, "stribeck_velocity": STRIBECK}


def ramped(xml, loads, start=0.0):
    """Return position and velocity where each load ends: (end time, load there), linear between."""
    times, efforts = np.array([(0.0, 0.0), *loads]).T
    return stepped(xml, times[1:], start, lambda time: np.interp(time, times, efforts))


def test_mujoco_holds_and_breaks_away_at_the_static_friction():
    xml = edited("mjcf", **WITH_STATIC)
    for share in (0.3, 0.9):
        states = ramped(xml, [(0.5, share * STATIC), (1.0, share * STATIC), (11.0, share * STATIC)])
        assert abs(states[2, 0] - states[1, 0]) < CREEP
        assert abs(states[2, 0]) < 0.01  # with the deflection of the bristles
    states = ramped(xml, [(0.5, 1.1 * STATIC), (1.0, 1.1 * STATIC)])
    assert states[1, 1] > 0.5


def test_mujoco_decelerates_with_static_friction():
    law = StribeckFriction.symmetric(
        coulomb_friction=COULOMB, viscous_friction=VISCOUS, static_friction=STATIC,
        stribeck_velocity=STRIBECK,
    )  # fmt: skip
    push = [(0.1, 3.0), (0.2, 3.0), (0.201, 0.0)]
    coast = [(0.201 + time, 0.0) for time in (0.06, 0.12, 0.16)]
    found = ramped(edited("mjcf", **WITH_STATIC), push + coast)[2:, 1]
    expected = exact(law, np.array([0.06, 0.12, 0.16]), start=found[0])
    assert found[0] - found[1:] == pytest.approx(found[0] - expected, rel=DECELERATION)


def test_the_actuator_of_an_earlier_export_is_replaced_or_removed_with_overwrite():
    """Without static friction it would add its friction to that of the joint."""
    overwrite = ExportSettings(overwrite=True)
    once = edited("mjcf", **WITH_STATIC)
    assert edited("mjcf", into=once, **WITH_STATIC) == once
    start = once.index('lugre="') + len('lugre="')
    other = once[:start] + "1 " + once[once.index(" ", start) + 1 :]
    with refuses("values_present", joint="elbow"):
        edited("mjcf", into=other, **WITH_STATIC)
    assert edited("mjcf", into=other, settings=overwrite, **WITH_STATIC) == once
    stronger = WITH_STATIC | {"static_friction": 0.8}
    again = edited("mjcf", into=once, settings=overwrite, **stronger)
    assert again.count("<dcmotor") == 1
    mujoco_model(again)
    with refuses("values_present", joint="elbow") as caught:
        edited("mjcf", into=once)
    assert any("elbow_friction" in each for each in caught.value.quantities["changes"])
    mujoco, model = mujoco_model(edited("mjcf", into=once, settings=overwrite))
    assert mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, "elbow_friction") == -1
    assert model.dof_frictionloss[0] == pytest.approx(COULOMB)


def test_mujoco_reads_the_friction_of_a_urdf():
    mujoco, model = mujoco_model(edited("urdf"))
    joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, "elbow")
    dof = model.jnt_dofadr[joint]
    assert model.dof_damping[dof] == VISCOUS
    assert model.dof_frictionloss[dof] == COULOMB


@pytest.mark.parametrize("ratio", [50.0, -50.0])
def test_values_of_the_motor_side_are_converted(ratio):
    reading = EstimateReading(transmission=Transmission(side="motor", gear_ratio=ratio))
    result = render(document(), "mjcf", into=MJCF, joint="elbow", reading=reading)
    _, model = mujoco_model(result.rendered.files[""].decode())
    assert model.dof_damping[0] == pytest.approx(50.0**2 * VISCOUS)
    assert model.dof_frictionloss[0] == pytest.approx(50.0 * COULOMB)


def test_a_spindle_turns_a_rotary_estimate_into_a_linear_one():
    reading = EstimateReading(transmission=Transmission(side="motor", lead=0.01))
    result = render(document(), "mjcf", into=MJCF, joint="slide", reading=reading)
    _, model = mujoco_model(result.rendered.files[""].decode())
    turns = 2.0 * np.pi / 0.01  # rad/m
    assert model.dof_damping[1] == pytest.approx(turns**2 * VISCOUS)
    assert model.dof_frictionloss[1] == pytest.approx(turns * COULOMB)


def test_a_ratio_that_is_not_given_is_asked_for():
    reading = EstimateReading(transmission=Transmission(side="motor"))
    with refuses("gear_ratio_missing", side="motor", wanted="joint"):
        render(document(), "urdf", into=URDF, joint="elbow", reading=reading)


@pytest.mark.parametrize(("step", "code"), [("fast", "not_a_number"), ("-1", "not_positive")])
def test_the_time_step_of_a_model_is_checked(step, code):
    with refuses(code, name="timestep"):
        edited("mjcf", into=MJCF.replace("'0.001'", f"'{step}'"))


def test_an_sdf_joint_without_axis_is_refused():
    start, end = SDF.index("<axis>"), SDF.index("</axis>") + len("</axis>")
    with refuses("joint_without_axis", joint="elbow"):
        edited("sdf", into=SDF[:start] + SDF[end:])


def test_the_joint_may_be_in_an_included_file():
    with refuses("no_joints") as caught:
        edited("mjcf", into='<mujoco><include file="arm.xml"/></mujoco>')
    assert "arm.xml" in str(caught.value)
