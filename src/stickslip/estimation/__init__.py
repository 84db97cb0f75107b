"""Estimators of friction from a log: one method a file, interchangeable.

The names below are loaded when they are first used, so that the registry is quick to import.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stickslip.estimation.base import (
        DetailedEstimator,
        EstimationTask,
        Estimator,
        OnlineEstimator,
    )
    from stickslip.estimation.energy.estimator import EnergyEstimator
    from stickslip.estimation.energy.published.estimator import PublishedEnergyEstimator
    from stickslip.estimation.energy.published.noise_compensation import (
        SensorNoise,
        absolute_bias,
        absolute_bias_polynomial,
        absolute_density,
        absolute_mean,
        absolute_mean_polynomial,
        double_absolute_mean,
        double_absolute_mean_polynomial,
        kinetic_energy_bias,
        potential_energy_bias,
        sensor_noise_of,
        viscous_regressor_bias,
    )
    from stickslip.estimation.examine import examine
    from stickslip.estimation.fit.fitted import Fit
    from stickslip.estimation.likelihood import (
        CramerRaoBound,
        DesignedInput,
        InputLimits,
        LikelihoodMaximum,
        MaximumLikelihoodEstimator,
        NoiseLevels,
        ProcessNoiseLikelihoodEstimator,
        cramer_rao_bound,
        design_input,
        process_noise_bound,
    )
    from stickslip.estimation.online.extended_kalman import ExtendedKalmanFilter
    from stickslip.estimation.online.observers.friedland_park import FriedlandParkObserver
    from stickslip.estimation.online.observers.gradient_estimator import GradientEstimator
    from stickslip.estimation.online.observers.least_squares_observer import LeastSquaresObserver
    from stickslip.estimation.online.observers.liao_chien import LiaoChienObserver
    from stickslip.estimation.online.observers.yazdizadeh_khorasani import (
        YazdizadehKhorasaniObserver,
    )
    from stickslip.estimation.online.recursive_least_squares import RecursiveLeastSquares
    from stickslip.estimation.registry import ESTIMATORS, EstimatorEntry
    from stickslip.estimation.regression.coupled_joints import CoupledJoints
    from stickslip.estimation.regression.decaying_extremes import DecayingExtremes
    from stickslip.estimation.regression.free_decay import FreeDecayEstimator
    from stickslip.estimation.regression.idim_instrumental import IdimInstrumentalVariables
    from stickslip.estimation.regression.idim_least_squares import IdimLeastSquares
    from stickslip.estimation.regression.law_selection import (
        FittedLaw,
        ForceRipple,
        FrictionForm,
        LawCandidate,
        LawScore,
        LawSelection,
        LinearFit,
        RowSettings,
        find_moves,
        force_ripple,
        law_candidates,
        select_friction_law,
    )
    from stickslip.estimation.regression.resimulation import replay, unexplained_effort
    from stickslip.estimation.regression.stribeck_estimator import StribeckEstimator
    from stickslip.estimation.selection.estimator import SelectedModelEstimator, SelectionTuning

__all__ = [
    "ESTIMATORS",
    "CoupledJoints",
    "CramerRaoBound",
    "DecayingExtremes",
    "DesignedInput",
    "DetailedEstimator",
    "EnergyEstimator",
    "EstimationTask",
    "Estimator",
    "EstimatorEntry",
    "ExtendedKalmanFilter",
    "Fit",
    "FittedLaw",
    "ForceRipple",
    "FreeDecayEstimator",
    "FrictionForm",
    "FriedlandParkObserver",
    "GradientEstimator",
    "IdimInstrumentalVariables",
    "IdimLeastSquares",
    "InputLimits",
    "LawCandidate",
    "LawScore",
    "LawSelection",
    "LeastSquaresObserver",
    "LiaoChienObserver",
    "LikelihoodMaximum",
    "LinearFit",
    "MaximumLikelihoodEstimator",
    "NoiseLevels",
    "OnlineEstimator",
    "ProcessNoiseLikelihoodEstimator",
    "PublishedEnergyEstimator",
    "RecursiveLeastSquares",
    "RowSettings",
    "SelectedModelEstimator",
    "SelectionTuning",
    "SensorNoise",
    "StribeckEstimator",
    "YazdizadehKhorasaniObserver",
    "absolute_bias",
    "absolute_bias_polynomial",
    "absolute_density",
    "absolute_mean",
    "absolute_mean_polynomial",
    "cramer_rao_bound",
    "design_input",
    "double_absolute_mean",
    "double_absolute_mean_polynomial",
    "examine",
    "find_moves",
    "force_ripple",
    "kinetic_energy_bias",
    "law_candidates",
    "potential_energy_bias",
    "process_noise_bound",
    "replay",
    "select_friction_law",
    "sensor_noise_of",
    "unexplained_effort",
    "viscous_regressor_bias",
]

_HOMES = {
    "base": ("DetailedEstimator", "EstimationTask", "Estimator", "OnlineEstimator"),
    "registry": ("ESTIMATORS", "EstimatorEntry"),
    "energy.estimator": ("EnergyEstimator",),
    "energy.published.estimator": ("PublishedEnergyEstimator",),
    "energy.published.noise_compensation": (
        "SensorNoise",
        "absolute_bias",
        "absolute_bias_polynomial",
        "absolute_density",
        "absolute_mean",
        "absolute_mean_polynomial",
        "double_absolute_mean",
        "double_absolute_mean_polynomial",
        "kinetic_energy_bias",
        "potential_energy_bias",
        "sensor_noise_of",
        "viscous_regressor_bias",
    ),
    "examine": ("examine",),
    "fit.fitted": ("Fit",),
    "selection.estimator": ("SelectedModelEstimator", "SelectionTuning"),
    "likelihood": (
        "CramerRaoBound",
        "DesignedInput",
        "InputLimits",
        "LikelihoodMaximum",
        "MaximumLikelihoodEstimator",
        "NoiseLevels",
        "ProcessNoiseLikelihoodEstimator",
        "cramer_rao_bound",
        "design_input",
        "process_noise_bound",
    ),
    "online.extended_kalman": ("ExtendedKalmanFilter",),
    "online.observers.friedland_park": ("FriedlandParkObserver",),
    "online.observers.gradient_estimator": ("GradientEstimator",),
    "online.observers.least_squares_observer": ("LeastSquaresObserver",),
    "online.observers.liao_chien": ("LiaoChienObserver",),
    "online.observers.yazdizadeh_khorasani": ("YazdizadehKhorasaniObserver",),
    "online.recursive_least_squares": ("RecursiveLeastSquares",),
    "regression.coupled_joints": ("CoupledJoints",),
    "regression.decaying_extremes": ("DecayingExtremes",),
    "regression.free_decay": ("FreeDecayEstimator",),
    "regression.idim_instrumental": ("IdimInstrumentalVariables",),
    "regression.idim_least_squares": ("IdimLeastSquares",),
    "regression.law_selection": (
        "FittedLaw",
        "ForceRipple",
        "FrictionForm",
        "LawCandidate",
        "LawScore",
        "LawSelection",
        "LinearFit",
        "RowSettings",
        "find_moves",
        "force_ripple",
        "law_candidates",
        "select_friction_law",
    ),
    "regression.resimulation": (
        "replay",
        "unexplained_effort",
    ),
    "regression.stribeck_estimator": ("StribeckEstimator",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Load a public name from the module it lives in (PEP 562)."""
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
