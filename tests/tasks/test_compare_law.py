"""Estimators side by side on an axis whose friction law most of them do not have."""

from pathlib import Path

import pytest

from stickslip import EstimationTask
from stickslip.tasks import compare_scenario

CLOSE = 0.05  # relative, of ten seconds with little noise
FAR = 0.1  # relative: what a law that lacks the step from static friction takes it for, at least

SCENARIO = """
[axis]
mass = 1.0
coulomb_friction = 1.0
static_friction = 1.6
viscous_friction = 2.0
{law}
[input]
amplitudes = [2.5, 1.0]
frequencies = [0.5, 1.3]
duration = 10.0
sampling_time = 0.002
[sensors]
position_noise = 2e-5
velocity_noise = 2e-3
"""
STRIBECK = 'law = "stribeck"\nstribeck_velocity = 0.05'
LAWS = {
    "Stribeck": STRIBECK,
    # Bristles that bend by 16 um, much less than the way over which friction falls
    "LuGre": STRIBECK.replace("stribeck", "lugre", 1)
    + "\nbristle_stiffness = 1e5\nbristle_damping = 300.0",
}


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_an_estimator_is_scored_by_the_friction_of_steady_motion(law: str, tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO.format(law=LAWS[law]))
    study = compare_scenario(path, runs=2, only=("energy", "stribeck-energy"))
    assert study.truth["stribeck_velocity"] == 0.05
    assert (study.truth["coulomb_friction"], study.truth["static_friction"]) == (1.0, 1.6)
    energy, stribeck = study.applied
    for name, score in stribeck.scores.items():
        assert abs(score.bias) < CLOSE * (abs(score.truth) or 1.0), name
        assert score.bound_ratio is None
    assert set(stribeck.scores) == {
        "mass",
        "coulomb_friction",
        "viscous_friction",
        "static_friction",
        "offset",
        "stribeck_velocity",
    }
    # What a model leaves out, its parameters take in
    assert energy.scores["coulomb_friction"].bias > FAR
    assert energy.scores["viscous_friction"].bias < -FAR
    assert dict(study.bound) == {}
    assert f"{law} friction" in study.notes[0]
    assert "no Cramér-Rao bound" in study.notes[1]


@pytest.mark.slow
def test_static_friction_of_a_direction_has_the_offset_in_it(tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO.format(law=f"offset = 0.2\n{STRIBECK}"))
    task = EstimationTask(per_direction=True)
    (stribeck,) = compare_scenario(path, runs=2, task=task, only=("stribeck-energy",)).applied
    for side, sign in (("positive", 1.0), ("negative", -1.0)):
        static = stribeck.scores[f"static_friction_{side}"]
        assert static.truth == pytest.approx(1.6 + sign * 0.2)
        assert abs(static.bias) < CLOSE * static.truth
