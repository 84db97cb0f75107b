"""Positioning on axes whose friction law is not that of the controller."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from stickslip.friction import (
    CoulombViscousFriction,
    DahlFriction,
    ElastoPlasticFriction,
    FrictionLaw,
    LuGreFriction,
    StribeckFriction,
)
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import Ending, InputError, Positioning
from stickslip.tasks import position, read_scenario
from stickslip.tasks.positioning.judging import ending, settling_time

TOLERANCE = 2e-5  # m, of every task here: van de Wijdeven's

CLOSE = 1e-4  # relative: an axis on bristles is within some hundredths of its rest after a second

AXIS = "mass = 150.0\ncoulomb_friction = 100.0\nviscous_friction = 700.0"
STATIC = "static_friction = 130.0"
STRIBECK = f"{STATIC}\nstribeck_velocity = 0.005"
BRISTLES = "bristle_stiffness = 2e7"
DAMPED = f"{BRISTLES}\nbristle_damping = 5e4"
LUGRE = f'law = "lugre"\n{STRIBECK}\n{DAMPED}'

DRY = {"coulomb_friction": 100.0, "viscous_friction": 700.0}
FALLING = DRY | {"static_friction": 130.0, "stribeck_velocity": 0.005}
STIFF = {"bristle_stiffness": 2e7, "bristle_damping": 5e4}
SLIDING = StribeckFriction.symmetric(**FALLING)
LAWS: dict[str, tuple[str, FrictionLaw]] = {
    "coulomb": (STATIC, CoulombViscousFriction.symmetric(**DRY, static_friction=130.0)),
    "stribeck": (
        f'{STRIBECK}\nshape = "exponential"',
        StribeckFriction.symmetric(**FALLING, shape="exponential"),
    ),
    "dahl": (
        BRISTLES,
        DahlFriction(bristle_stiffness=2e7, sliding=CoulombViscousFriction.symmetric(**DRY)),
    ),
    "lugre": (f"{STRIBECK}\n{DAMPED}", LuGreFriction(**STIFF, sliding=SLIDING)),
    "elasto-plastic": (
        f"{STRIBECK}\n{DAMPED}\nelastic_deflection = 3e-6",
        ElastoPlasticFriction(**STIFF, elastic_deflection=3e-6, sliding=SLIDING),
    ),
}

# Keys that other laws use or that are missing: tests/scenario/test_contract.py
BAD = [
    ('law = "viscous"', ["law is 'viscous'"]),
    ('law = "stribeck"\nstribeck_velocity = 0.01', ["static_friction is missing", "in N"]),
    (
        f'law = "elasto-plastic"\n{STRIBECK}\n{DAMPED}\nelastic_deflection = 6e-6',
        ["elastic_deflection is 6e-06 m, it must be below 5e-06 m"],
    ),
    (f'law = "dahl"\n{STATIC}\n{BRISTLES}', ["static_friction", "law 'lugre'"]),
    (
        f'law = "lugre"\n{STRIBECK}\nbristle_stiffness = 0.0\nbristle_damping = 1.0',
        ["bristle_stiffness is 0 N/m, it must be positive"],
    ),
    (
        f"{LUGRE}\nload_mass = 1.0\nstiffness = 10.0",
        ["law 'lugre'", "flexible arm", "law 'stribeck'"],
    ),
]

Run = Callable[..., Positioning]


def _text(axis: str, method: str, *, target: float = 0.01, more: str = "", duration: float) -> str:
    guess = "mass = 150.0\ncoulomb_friction = 80.0" if method not in {"pd", "pid"} else ""
    return (
        f"[axis]\n{AXIS}\n{axis}\n[task]\ntarget = {target}\ntolerance = {TOLERANCE}\n"
        f"duration = {duration}\nsampling_time = 0.01\n[guess]\n{guess}\n"
        f'[controller]\nmethod = "{method}"\neffort_limit = 300.0\n{more}\n'
    )


@pytest.fixture
def run(tmp_path: Path) -> Run:
    def run_scenario(
        axis: str, method: str, *, target: float = 0.01, more: str = "", duration: float = 4.0
    ) -> Positioning:
        path = tmp_path / "a_task.toml"
        path.write_text(_text(axis, method, target=target, more=more, duration=duration))
        return position(path)

    return run_scenario


@pytest.mark.parametrize("name", LAWS)
def test_law_of_the_plant(name: str, tmp_path: Path) -> None:
    keys, law = LAWS[name]
    path = tmp_path / "a_task.toml"
    path.write_text(_text(f'law = "{name}"\n{keys}', "papwc", duration=1.0))
    axis = read_scenario(path).scenario.axis
    assert axis.build() == SingleMass(mass=150.0, friction=law)
    assert axis.friction().breakaway() == law.breakaway()
    assert axis.bristles == (name in {"dahl", "lugre", "elasto-plastic"})


def test_values_of_each_direction(tmp_path: Path) -> None:
    path = tmp_path / "a_task.toml"
    axis = LUGRE.replace(
        STATIC, "static_friction_positive = 130.0\nstatic_friction_negative = 110.0"
    )
    path.write_text(_text(f"{axis}\noffset = 5.0", "pwc", duration=1.0))
    law = read_scenario(path).scenario.axis.build().friction
    assert law.breakaway() == (130.0, 110.0)
    assert law.offset == 5.0


@pytest.mark.parametrize(("axis", "words"), BAD)
def test_bad_axis(axis: str, words: list[str], tmp_path: Path) -> None:
    path = tmp_path / "a_task.toml"
    method = "feedback" if "load_mass" in axis else "papwc"
    path.write_text(_text(axis, method, duration=1.0))
    with pytest.raises(InputError) as refusal:
        read_scenario(path)
    message = str(refusal.value)
    assert f"{path}, [axis]" in message
    for word in words:
        assert word in message


def test_pd_control_ends_stuck_where_bristles_balance_it(run: Run) -> None:
    # Without a Stribeck effect the bristles' force follows the way as Dahl's, in closed form
    gain, target, stiffness, limit = 5e4, 1e-3, 2e7, 100.0
    axis = f'law = "lugre"\nstribeck_velocity = 1.0\n{BRISTLES}\nbristle_damping = 5e5'
    result = run(axis, "pd", target=target, more=f"position_gain = {gain}\nvelocity_gain = 1e4")

    def left(x: float) -> float:
        return gain * (target - x) - limit * (1.0 - np.exp(-stiffness * x / limit))

    rest = brentq(left, 0.0, target, xtol=1e-15)
    assert result.ending is Ending.STUCK
    assert target - result.last.final_error == pytest.approx(rest, rel=CLOSE)
    assert "LuGre friction" in result.notes[0]
    assert "5.00 µm" in result.notes[1]


@pytest.mark.parametrize(
    ("law", "method", "reached"),
    [
        ("stribeck", "papwc", Ending.REACHED),
        ("stribeck", "pwc", Ending.HUNTING),
        ("lugre", "papwc", Ending.REACHED),
        ("lugre", "pwc", Ending.HUNTING),
        ("elasto-plastic", "papwc", Ending.REACHED),
    ],
)
def test_pulses_on_an_unknown_law(law: str, method: str, reached: Ending, run: Run) -> None:
    result = run(f'law = "{law}"\n{LAWS[law][0]}', method)
    assert result.ending is reached
    assert len(result.last.pulses) > 2
    assert ("counts as resting when 10 positions" in " ".join(result.notes)) == (law != "stribeck")
    assert result.scenario["axis"]["law"] == (law, "")
    # The truth beside what was learned is that of steady motion
    known = {"gain_2": 1 / 300.0} if method == "papwc" else {"pulse_gain": 300.0 * 200.0 / 3e4}
    for name, value in known.items():
        assert result.truth[name] == pytest.approx(value)


def test_pid_control_hunts_on_bristles(run: Run) -> None:
    axis = LUGRE.replace("0.005", "0.001")
    gains = "position_gain = 6e4\nvelocity_gain = 5e3\nintegral_gain = 4e5"
    result = run(axis, "pid", more=gains, duration=40.0)
    assert result.ending is Ending.HUNTING


def test_rest_on_bristles() -> None:
    time = 0.01 * np.arange(200)
    creeping = 1e-5 + 1e-8 * np.exp(-np.arange(200) / 50.0)
    at_last = np.concatenate((np.linspace(1e-3, 3e-5, 189), creeping[:11]))
    rest_motion = 0.01 * TOLERANCE
    assert ending(at_last, TOLERANCE, None) is Ending.UNDER_WAY
    assert ending(at_last, TOLERANCE, None, rest_motion=rest_motion) is Ending.REACHED
    assert settling_time(time, at_last, TOLERANCE) is None
    assert settling_time(time, at_last, TOLERANCE, rest_motion=rest_motion) == pytest.approx(1.89)
    outside = creeping + TOLERANCE
    assert ending(outside, TOLERANCE, None) is Ending.UNDER_WAY
    assert ending(outside, TOLERANCE, None, rest_motion=rest_motion) is Ending.STUCK
    moves = TOLERANCE * (2.0 + np.linspace(0.0, 1.0, 200))
    assert ending(moves, TOLERANCE, None, rest_motion=rest_motion) is Ending.UNDER_WAY


def test_arm_with_a_stribeck_effect(tmp_path: Path) -> None:
    path = tmp_path / "a_task.toml"
    path.write_text(
        "[axis]\nmass = 1.0\nload_mass = 1.0\nstiffness = 1.0\ncoulomb_friction = 0.1\n"
        'viscous_friction = 0.05\nstatic_friction = 0.12\nlaw = "stribeck"\n'
        "stribeck_velocity = 0.01\n[task]\ntarget = 0.5\ntolerance = 1e-3\nduration = 20.0\n"
        'sampling_time = 0.02\n[controller]\nmethod = "feedback"\neffort_limit = 1.0\n'
    )
    plant = read_scenario(path).scenario.axis.build()
    assert isinstance(plant, FlexibleArm)
    assert isinstance(plant.friction, StribeckFriction)
    result = position(path)
    assert result.truth["coulomb_friction"] == 0.1
    assert "Stribeck friction" in result.notes[0]
    assert abs(result.last.final_error) < 0.5
