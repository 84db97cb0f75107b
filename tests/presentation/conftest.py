"""A plausible identification made from closed forms, so that the page is tested without a fit."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float

from stickslip.records import (
    AxisLog,
    Diagnostics,
    EnergyBalance,
    EstimateEvolution,
    FrictionCurve,
    FrictionEstimate,
    Identification,
    LogSource,
    ParameterEstimate,
    Provenance,
    Residuals,
    Resimulation,
    Status,
    Verdict,
    unit_of,
)

TRUTH = {"mass": 2.0, "coulomb_friction": 1.5, "viscous_friction": 3.0, "offset": -0.2}
STDS = {"mass": 0.012, "coulomb_friction": 0.021, "viscous_friction": 0.055, "offset": 0.008}
ERRORS = {"mass": 0.4, "coulomb_friction": -0.9, "viscous_friction": 1.1, "offset": 0.2}
NORMAL_95 = 1.96


def _estimate(samples: int) -> FrictionEstimate:
    """Return an estimate that is off the truth by less than its intervals."""
    values = {key: TRUTH[key] + ERRORS[key] * STDS[key] for key in TRUTH}
    return FrictionEstimate(
        estimator="energy",
        kind="linear",
        parameters={
            key: ParameterEstimate(
                name=key,
                value=values[key],
                std=STDS[key],
                ci95=(values[key] - NORMAL_95 * STDS[key], values[key] + NORMAL_95 * STDS[key]),
                unit=unit_of(key, "linear"),
            )
            for key in TRUTH
        },
        covariance=np.diag([STDS[key] ** 2 for key in TRUTH]),
        status=Status.OK,
        diagnostics=Diagnostics(
            relative_residual=0.0312,
            cross_validation_residual=0.0345,
            condition_number=7.9,
            residual_autocorrelation=0.8,
            effective_samples=165.0,
            classical_std={key: 0.3 * STDS[key] for key in TRUTH},
            samples=samples,
            verdicts=tuple(
                Verdict(parameter=key, identifiable=True, reason="the log determines it")
                for key in TRUTH
            ),
            notes=("The velocity <was> measured.",),
        ),
        provenance=Provenance(
            stickslip_version="0.1.0",
            files=("log <1>.csv",),
            input_sha256="ab" * 32,
            options={"variant": "exact", "forgetting_factor": 1.0, "inertia": None, "offset": True},
            assumptions=("The column 'x' was taken as position [m], as 'a & b' says nothing.",),
        ),
    )


def _curve(
    velocity: Float[np.ndarray, " n"], friction: Float[np.ndarray, " n"], values: dict[str, float]
) -> FrictionCurve:
    """Return measured friction with the law of estimated values and its band."""
    half = np.linspace(0.0, float(velocity.max()), 60)
    fitted_velocity = np.concatenate((-half[::-1], [np.nan], half))
    fitted = (
        np.sign(np.concatenate((-np.ones(60), [np.nan], np.ones(60)))) * values["coulomb_friction"]
        + values["viscous_friction"] * fitted_velocity
        + values["offset"]
    )
    width = 2 * np.hypot(STDS["coulomb_friction"], STDS["viscous_friction"] * fitted_velocity)
    return FrictionCurve(
        velocity=velocity,
        friction=friction,
        fitted_velocity=fitted_velocity,
        fitted_friction=fitted,
        band_low=fitted - width,
        band_high=fitted + width,
    )


def make_identification(
    *, samples: int = 1500, name: str = 'stage <b>&"x"</b>', with_truth: bool = True
) -> Identification:
    """Prescribe a motion x = A sin(w t) of growing speed, and give the effort that it takes."""
    generator = np.random.default_rng(7)
    time = np.linspace(0.0, 12.0, samples)
    amplitude, rate, chirp = 0.08, 3.0, 0.35
    phase = rate * time + chirp * time**2
    phase_rate = rate + 2 * chirp * time
    position = amplitude * np.sin(phase)
    velocity = amplitude * phase_rate * np.cos(phase)
    acceleration = amplitude * (2 * chirp * np.cos(phase) - phase_rate**2 * np.sin(phase))
    noise = np.zeros(samples)
    shocks = generator.normal(0.0, 0.08, samples)
    for k in range(1, samples):
        noise[k] = 0.8 * noise[k - 1] + shocks[k]
    friction = (
        TRUTH["coulomb_friction"] * np.sign(velocity)
        + TRUTH["viscous_friction"] * velocity
        + TRUTH["offset"]
        + noise
    )
    effort = TRUTH["mass"] * acceleration + friction
    log = AxisLog(
        name=name,
        kind="linear",
        time=time,
        effort=effort,
        measured_position=position,
        measured_velocity=velocity,
        source=LogSource(files=("log <1>.csv",), sha256="ab" * 32, assumptions=("a & b",)),
    )
    estimate = _estimate(samples)
    values = {key: estimate.value(key) for key in TRUTH}
    work = np.concatenate(([0.0], np.cumsum(effort[:-1] * np.diff(position))))
    kinetic = 0.5 * values["mass"] * velocity**2
    modelled = np.concatenate(([0.0], np.cumsum((friction - noise)[:-1] * np.diff(position))))
    settling = np.exp(-time / 1.5)
    lags = np.arange(60)
    return Identification(
        log=log,
        estimate=estimate,
        truth=TRUTH if with_truth else None,
        curve=_curve(velocity, friction, values),
        energy=EnergyBalance(
            time=time,
            input=work,
            kinetic=kinetic - kinetic[0],
            potential=np.zeros(samples),
            measured_dissipation=work - (kinetic - kinetic[0]),
            explained_dissipation=modelled,
        ),
        evolution=EstimateEvolution(
            time=time,
            values={
                key: values[key] + 8 * settling * STDS[key] * np.cos(3 * time) for key in TRUTH
            },
            stds={key: STDS[key] * (1 + 15 * settling) for key in TRUTH},
        ),
        residuals=Residuals(
            time=time,
            residual=noise,
            share=0.0298,
            lag=lags * float(time[1]),
            autocorrelation=0.8**lags,
            white_bound=NORMAL_95 / np.sqrt(samples),
        ),
        resimulation=Resimulation(
            time=time,
            measured_position=position,
            simulated_position=position + 0.004 * np.sin(0.8 * time),
            measured_velocity=velocity,
            simulated_velocity=velocity + 0.01 * np.cos(0.8 * time),
            horizon=1.0,
            fit=0.964,
        ),
    )


def make_doubtful_identification() -> Identification:
    """Return one that the log could not determine: no figures, and the reason."""
    good = make_identification(samples=50)
    estimate = replace(
        good.estimate,
        parameters={
            key: ParameterEstimate(name=key, value=None, std=None, ci95=None, unit=p.unit)
            for key, p in good.estimate.parameters.items()
        },
        covariance=np.zeros((0, 0)),
        status=Status.INSUFFICIENT_EXCITATION,
        diagnostics=replace(
            good.estimate.diagnostics,
            cross_validation_residual=None,
            verdicts=tuple(
                Verdict(parameter=key, identifiable=False, reason="the axis does not move <at all>")
                for key in TRUTH
            ),
        ),
    )
    return Identification(log=good.log, estimate=estimate)


@pytest.fixture
def identification() -> Identification:
    return make_identification()


@pytest.fixture
def make() -> Callable[..., Identification]:
    return make_identification


@pytest.fixture
def doubtful() -> Identification:
    return make_doubtful_identification()
