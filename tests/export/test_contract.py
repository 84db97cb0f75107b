"""The contract of every exporter of the registry."""

import copy
import io
import json
import zipfile
from dataclasses import fields
from functools import cache

import pytest
from estimates import rotary_estimate
from exports import COULOMB, ROBOTS, VISCOUS, document
from refusals import refuses

from stickslip.export import (
    EstimateReading,
    Exporter,
    ExportSettings,
    Transmission,
    exporters,
    render,
    targets,
    write,
)
from stickslip.records import QUANTITIES

NEEDED = {
    "table": {"top_speed": 10.0},
    "twincat-cnc": {"top_speed": 10.0, "rated_current": 2.0, "torque_constant": 0.3},
    "ax2000": {"torque_constant": 0.3},
    "indradrive": {"rated_current": 2.0, "torque_constant": 0.3},
    "python-control": {"sampling_time": 0.01},
    "fmu-arm": {"load_inertia": 0.02, "stiffness": 5.0},
}
"""Settings that a target requires."""

NO_BINARIES = {"binaries": "none"}
"""Not to compile; test_fmu.py does."""

SETTINGS = {name: NEEDED.get(name, {}) for name in exporters()}
for _name in ("fmu", "fmu-arm", "fmu-observer"):
    SETTINGS[_name] = SETTINGS[_name] | NO_BINARIES

VALUES = {
    "top_speed": 7.0,
    "points": 5,
    "link_inertia": 0.01,
    "rated_current": 3.0,
    "torque_constant": 0.2,
    "sampling_time": 0.001,
    "precision": "single",
    "fmi_version": "3.0",
    "binaries": "none",
    "load_inertia": 0.01,
    "stiffness": 7.0,
}
"""A value of every option."""

TARGETS = list(exporters())


@pytest.fixture(params=TARGETS)
def target(request):
    if request.param == "usd":
        pytest.importorskip("pxr.Usd")
    return request.param


def reading(**others):
    return EstimateReading(transmission=Transmission(gear_ratio=1.0), **others)


def rendered(target, estimate=None, joint="elbow", *, read=None, **settings):
    return render(
        document() if estimate is None else estimate,
        target,
        into=ROBOTS.get(target),
        joint=joint,
        reading=read or reading(),
        settings=ExportSettings(**SETTINGS[target] | settings),
    )


usual = cache(rendered)
"""Of what is rendered alike in several tests."""


def text_of(result):
    """Return all text in the files, also of an archive."""
    texts = []
    for content in result.rendered.files.values():
        if isinstance(content, str):
            texts.append(content)
        elif content.startswith(b"PK"):
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                texts += [archive.read(name).decode("latin-1") for name in archive.namelist()]
        else:
            texts.append(content.decode("latin-1"))
    return "\n".join(texts)


def test_targets_are_named_by_the_registry():
    assert list(targets()) == TARGETS
    assert len(set(targets().values())) == len(TARGETS)


def test_the_protocol_is_obeyed(target):
    exporter = exporters()[target]
    assert isinstance(exporter, Exporter)
    assert exporter.name == target
    assert exporter.side in {"motor", "joint", None}
    assert exporter.edits == ("always" if target in ROBOTS else "never")
    assert exporter.ending == "" or exporter.ending.startswith(".")
    assert set(exporter.represents) <= set(QUANTITIES)
    assert set(exporter.cannot) <= {*QUANTITIES, "direction"}
    assert not set(exporter.cannot) & set(exporter.represents)
    assert set(exporter.options) <= {each.name for each in fields(ExportSettings)}
    assert (getattr(exporter, "values", type(exporter)).__doc__ or "").strip()


def test_values_and_origin_are_in_the_file(target):
    result = usual(target)
    assert result.complete
    assert result.warnings == ()
    assert "elbow" in text_of(result).replace("elbow--test", "").replace("elbow- -test", "") or (
        not exporters()[target].several
    )
    assert "0123456789ab" in text_of(result), "the hash of the log"
    assert "joint side" in text_of(result) or "motor side" in text_of(result)


def test_rendering_is_repeatable(target):
    assert rendered(target).rendered == usual(target).rendered


def test_an_axis_without_a_name_is_the_axis(target):
    if exporters()[target].edits == "never":
        assert "axis axis" not in text_of(rendered(target, joint=None)).lower()


def test_what_is_not_represented_is_stated_in_the_file_and_in_the_notes(target):
    estimate = document(offset=0.123, static_friction=0.777, stribeck_velocity=0.05)
    result = rendered(target, estimate)
    exporter = exporters()[target]
    for quantity, value in (("offset", "0.123"), ("static_friction", "0.777")):
        if quantity not in exporter.represents:
            assert any(value in note for note in result.rendered.notes), quantity
            assert value in text_of(result)


def test_different_directions_are_stated(target):
    exporter = exporters()[target]
    estimate = document(
        coulomb_friction="absent", coulomb_friction_positive=0.6, coulomb_friction_negative=0.4
    )
    result = rendered(target, estimate)
    if "direction" in exporter.cannot and "coulomb_friction" in exporter.represents:
        assert any("per direction" in note for note in result.rendered.notes)
        assert "per direction" in text_of(result)


def test_what_was_not_identified_is_not_written(target):
    result = rendered(target, document(status="not_identifiable", offset=None))
    assert not result.complete
    exporter = exporters()[target]
    if "offset" in exporter.represents:
        assert any("offset is not written" in each for each in result.warnings)


def test_an_estimate_not_to_be_used_is_refused(target):
    with refuses("nothing_to_write"):
        rendered(target, document(status="poor_fit"))


def test_force_writes_with_a_warning_in_the_file(target):
    result = rendered(target, document(status="poor_fit"), read=reading(force=True))
    assert not result.complete
    assert any("by force" in each for each in result.warnings)
    assert "WARNING" in text_of(result)
    assert "poor_fit" in text_of(result)


def test_a_verdict_withholds_a_value_that_is_there(target):
    estimate = document(viscous_friction=0.7654321)
    for verdict in estimate["diagnostics"]["verdicts"]:
        verdict["identifiable"] = verdict["parameter"] != "viscous_friction"
    if set(exporters()[target].represents) == {"viscous_friction"}:
        with refuses("nothing_to_write"):
            rendered(target, estimate)
        return
    result = rendered(target, estimate)
    if "viscous_friction" in exporters()[target].represents:
        assert not result.complete
    assert "0.7654321" not in text_of(result)


def test_an_option_that_is_not_used_is_refused(target):
    exporter = exporters()[target]
    for name, value in VALUES.items():
        if name in exporter.options:
            rendered(target, **{name: value})
        elif name != "torque_constant":  # also of an estimate in ampere
            with refuses("option_unused", name=name, title=exporter.title):
                rendered(target, **{name: value})


def test_a_required_option_is_asked_for(target):
    for name in NEEDED.get(target, {}):
        with refuses("option_needed", name=name):
            rendered(target, **{name: None})


def test_a_robot_has_all_joints_or_one_is_asked_for(target):
    exporter = exporters()[target]
    estimate = {"axes": {"elbow": document(), "slide": document("linear", viscous_friction=3.5)}}
    if exporter.several:
        both = text_of(rendered(target, estimate, joint=None))
        assert text_of(usual(target)) != both
        assert "3.5" in both or both.count("slide") > text_of(usual(target)).count("slide")
    else:
        with refuses("several_axes", axes=("elbow", "slide")):
            rendered(target, estimate, joint=None)


def test_an_edited_file_is_required_or_refused(target):
    exporter = exporters()[target]
    settings = ExportSettings(**SETTINGS[target])
    if exporter.edits == "always":
        with refuses("file_to_edit_missing"):
            render(document(), target, joint="elbow", settings=settings)
        with refuses("option_needed", name="joint"):
            render(document(), target, into=ROBOTS[target], settings=settings)
    if exporter.edits == "never":
        with refuses("not_edited"):
            render(document(), target, into="<a/>", joint="elbow", settings=settings)


def test_an_effort_in_ampere_needs_the_torque_constant(target):
    estimate = document(
        inertia=(0.05, "A s^2/rad"),
        viscous_friction=(VISCOUS, "A s/rad"),
        coulomb_friction=(COULOMB, "A"),
    )
    with refuses("estimate_in_units_of_drive", effort="A"):
        rendered(target, estimate)
    result = rendered(target, estimate, read=reading(torque_constant=2.0))
    twice = rendered(
        target, document(inertia=0.1, viscous_friction=2 * VISCOUS, coulomb_friction=2 * COULOMB)
    )
    assert text_of(result) == text_of(twice)


def test_a_torque_constant_of_an_estimate_in_si_units_is_for_motors_only(target):
    exporter, read = exporters()[target], reading(torque_constant=0.3)
    if "torque_constant" in exporter.options:
        assert rendered(target, read=read).complete
    else:
        with refuses("torque_constant_unused", title=exporter.title):
            rendered(target, read=read)


def files_of(target, folder):
    """Return a robot description in a folder, and the arguments of a function that writes."""
    robot = folder / ("robot.usda" if target == "usd" else "robot")
    robot.write_text(ROBOTS.get(target, ""))
    return robot, {
        "into": robot if target in ROBOTS else None,
        "joint": "elbow",
        "reading": reading(),
        "settings": ExportSettings(**SETTINGS[target]),
    }


def test_a_file_is_written_whole_or_not_at_all(target, tmp_path):
    robot, arguments = files_of(target, tmp_path)
    out, estimate = tmp_path / "out", tmp_path / "elbow.json"
    with pytest.raises(ValueError, match=r"."):
        write(document(status="poor_fit"), target, out, **arguments | {"reading": None})
    assert not out.exists()
    estimate.write_text(json.dumps(document()))
    result = write(estimate, target, out, **arguments)
    assert out.exists()
    assert result.complete
    assert "elbow.json" in text_of(result)
    assert sorted(each.name for each in tmp_path.iterdir()) == sorted(
        ["elbow.json", "out", robot.name]
    )


def test_an_estimate_has_a_method_for_every_target(target, tmp_path):
    estimate, (_, arguments) = rotary_estimate(), files_of(target, tmp_path)
    method_name = f"to_{target.replace('-', '_')}"
    method = getattr(estimate, method_name)
    assert method.args == (estimate, target)
    assert method_name in dir(estimate)
    if exporters()[target].group == "code":  # takes seconds
        return
    done = method(tmp_path / "out", **arguments)
    assert done.target == target
    assert done.complete
    assert (tmp_path / "out").exists()


def test_an_estimate_has_no_other_methods_of_exports():
    estimate = rotary_estimate()
    assert not any(hasattr(estimate, name) for name in ("to_numpy", "to_", "from_urdf"))
    assert copy.deepcopy(estimate).to_dict() == estimate.to_dict()
