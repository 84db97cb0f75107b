"""Settings that the estimators refuse when they are made."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from refusals import refuses

from stickslip.estimation import (
    EnergyEstimator,
    ExtendedKalmanFilter,
    FreeDecayEstimator,
    FriedlandParkObserver,
    IdimInstrumentalVariables,
    IdimLeastSquares,
    MaximumLikelihoodEstimator,
    ProcessNoiseLikelihoodEstimator,
    PublishedEnergyEstimator,
    RecursiveLeastSquares,
    StribeckEstimator,
)
from stickslip.friction import StribeckEffect

NAN = float("nan")
Case = tuple[Callable[..., Any], dict[str, Any], str]


def cases(make: Callable[..., Any], **refused: list[dict[str, Any]]) -> list[Case]:
    """Return a case for each of the settings that are refused with a code."""
    return [(make, settings, code) for code, each in refused.items() for settings in each]


CASES = [
    *cases(
        EnergyEstimator,
        not_positive=[{"inertia": -1.0}, {"level_noise": 0.0}],
        negative=[{"position_noise": -1.0}],
        half_an_arm=[{"stiffness": 1.0}],
        not_in_interval=[{"forgetting_factor": 1.5}],
        guess_not_estimated=[
            {"initial_values": {"speed": 1.0}},
            {"inertia": 1.0, "initial_values": {"mass": 1.0}},
        ],
        offset_and_directions=[{"per_direction": True, "offset": True}],
        not_whole=[{"filter_order": 2.5}, {"filter_order": NAN}],
        not_finite=[{"initial_values": {"mass": NAN}}, {"initial_values": {"offset": np.inf}}],
        no_level_noise=[{"force_noise": 1.0}],
    ),
    *cases(
        partial(PublishedEnergyEstimator, inertia=1.0, load_inertia=1.0, stiffness=1.0),
        not_positive=[{"inertia": -1.0}, {"initial_variance": 0.0}, {"cutoff": -1.0}],
        negative=[{"position_noise": -1.0, "velocity_noise": 1.0}],
        half_an_arm=[{"stiffness": None}],
        half_the_noise=[{"velocity_noise": 0.1}],
        not_in_interval=[{"forgetting_factor": 1.5}],
        not_a_choice=[{"sums": "exact"}, {"compensation": "full"}],
        printed_compensation_of_settled_sums=[{"sums": "settled", "compensation": "printed"}],
        error_terms_uncompensated=[{"error_terms": True}],
        guess_not_estimated=[{"initial_values": {"slope": 1.0}}],
        not_finite=[{"initial_values": {"coulomb_friction": NAN}}],
    ),
    *cases(
        MaximumLikelihoodEstimator,
        not_positive=[{"inertia": -1.0}, {"horizon": 0.0}],
        not_a_choice=[{"noise": "pink"}],
        not_whole=[{"largest_delay": -1}],
        offset_and_directions=[{"per_direction": True, "offset": True}],
        no_guess_of_arm=[{"flexible": True}],
        parts_of_rigid_axis=[{"flexible": False, "stiffness": 1.0}],
        guess_not_estimated=[{"initial_values": {"stiffness": 1.0}}],
    ),
    *cases(
        ProcessNoiseLikelihoodEstimator,
        not_positive=[{"inertia": -1.0}],
        not_whole=[{"largest_delay": -1}],
    ),
    *cases(
        IdimLeastSquares,
        not_positive=[{"inertia": -1.0}, {"cutoff": 0.0}],
        not_whole=[{"decimation": 0}, {"filter_order": 0}],
        offset_and_directions=[{"per_direction": True, "offset": True}],
    ),
    *cases(IdimInstrumentalVariables, not_positive=[{"feedback": 0.0}, {"cutoff": -1.0}]),
    *cases(
        partial(StribeckEstimator, method=EnergyEstimator()),
        stribeck_given=[{"method": EnergyEstimator(stribeck=StribeckEffect(velocity=0.05))}],
        velocities_out_of_order=[{"velocities": (0.1, 0.05)}, {"velocities": (0.0, 0.05)}],
    ),
    *cases(FreeDecayEstimator, inertia_or_stiffness=[{}, {"inertia": 1.0, "stiffness": 1.0}]),
    *cases(
        partial(ExtendedKalmanFilter, inertia=1.0),
        guess_not_estimated=[{"initial_values": {"offset": 1.0}}],
        not_whole=[{"memory": -1}],
    ),
    *cases(
        partial(FriedlandParkObserver, inertia=1.0),
        not_positive=[{"inertia": 0.0}, {"rate": -1.0}, {"speed": 0.0}, {"exponent": 0.0}],
        guess_not_estimated=[{"initial_values": {"mass": 1.0}}],
    ),
    *cases(
        RecursiveLeastSquares,
        not_in_interval=[{"forgetting_factor": factor} for factor in (0.0, -1.0, 1.001, NAN)],
        not_a_choice=[{"forgetting": "foo"}],
    ),
]


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize(("make", "settings", "code"), CASES)
def test_impossible_settings_are_refused(
    make: Callable[..., Any], settings: dict[str, Any], code: str
) -> None:
    # An error that names a value names that setting, and not another one
    of = {*settings, *settings.get("initial_values", {})}
    named = {"not_positive", "negative", "not_in_interval", "not_a_choice", "not_whole"}
    with refuses(code, of=of if code in named else None):
        make(**settings)


def test_a_negative_drift_is_refused() -> None:
    with refuses("negative", name="drift of viscous_friction", value=-1.0):
        ExtendedKalmanFilter(inertia=1.0, drift={"viscous_friction": -1.0})
