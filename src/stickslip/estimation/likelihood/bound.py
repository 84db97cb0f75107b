"""How well a scenario can be identified at best: Fisher information and Cramer-Rao bound."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.estimation.likelihood.axis_parameters import (
    AxisParameters,
    coulomb_of,
    load_name,
    without_side,
)
from stickslip.estimation.likelihood.windows import run_means, run_starts
from stickslip.friction import FrictionTerms
from stickslip.plants import Plant, SingleMass
from stickslip.records import InputError, ReadOnlyMapping, mass_name, unit_of
from stickslip.simulation import MotionSensitivity, Sensors, sensitivity_names, simulate_sensitivity

_DITHER = 0.25
"""Noise in encoder steps from which on equal readings in a row are readings of their own."""

_UNDETERMINED = 1e-13  # of the largest eigenvalue of the information, columns scaled to unit norm
_INVOLVED = 1e-6  # component of an undetermined combination that takes part in it


@dataclass(frozen=True, kw_only=True)
class CramerRaoBound:
    """Covariance below which no unbiased estimator comes."""

    names: tuple[str, ...]  #: Of the parameters.
    #: Fisher information with the first state unknown [1/(unit of one times that of the other)],
    #: shape (p, p).
    information: Float[np.ndarray, "p p"]
    #: Its inverse [unit of one times that of the other], shape (p, p); infinite for what the
    #: scenario does not determine.
    covariance: Float[np.ndarray, "p p"]
    units: Mapping[str, str]  #: By name.

    def __post_init__(self) -> None:
        object.__setattr__(self, "units", ReadOnlyMapping(self.units))

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation of each parameter [SI] that no unbiased estimator falls below."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))


def default_sought(plant: Plant) -> tuple[str, ...]:
    """Return masses, spring, friction (for each direction if it differs) and offset by name."""
    law = plant.friction
    per_direction = any(
        getattr(law, f"{name}_positive") != getattr(law, f"{name}_negative")
        for name in ("coulomb_friction", "viscous_friction")
    )
    rigid = isinstance(plant, SingleMass)
    load = () if rigid else (load_name(plant.kind), "stiffness")
    terms = FrictionTerms.asked(per_direction=per_direction, offset=None)
    return (mass_name(plant.kind), *load, *terms.names)


def cramer_rao_bound(
    plant: Plant,
    commanded_effort: ArrayLike,
    *,
    sampling_time: float,
    sensors: Sensors,
    initial_state: tuple[float, ...] | None = None,
    sought: Sequence[str] | None = None,
) -> CramerRaoBound:
    """Return the Cramer-Rao bound of a plant's parameters in a scenario.

    The Fisher information is that of the exact motion and of independent Gaussian errors of every
    reading. Errors of rounding to an encoder's step count as such, with the variance of a uniform
    distribution, and equal readings in a row as one. The first state is unknown, but for the
    velocity of a driven mass that begins at rest. The bound is for the plant as it is; it holds in
    the limit of long logs, and where no event grazes.

    Parameters
    ----------
    plant
        The truth.
    commanded_effort
        Effort held over each sample [N or N m], shape (n,).
    sampling_time
        [s].
    sensors
        What measures, with its noise. A delay changes nothing, and a velocity from differences adds
        nothing to the positions.
    initial_state
        As `stickslip.simulation.simulate` takes it [SI]; at rest at 0 if None.
    sought
        Names of the parameters, as an estimate has them; None for masses, spring, viscous and
        Coulomb friction (for each direction if they differ) and offset. What is not sought is
        known; static friction then follows the Coulomb friction where the plant has them equal.

    Raises
    ------
    InputError
        If a reading has neither noise nor steps, or as `simulate` does.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=3.0)
    >>> bound = cramer_rao_bound(
    ...     SingleMass(mass=1.5, friction=law), 9.0 * np.sin(np.arange(2000) * 0.02),
    ...     sampling_time=0.005, sensors=Sensors(position_noise=1e-3, velocity="none"))
    >>> bound.std["mass"] < 1e-3
    True
    """
    found = simulate_sensitivity(
        plant, commanded_effort, sampling_time=sampling_time, initial_state=initial_state
    )
    return bound_of(plant, found, sensors, default_sought(plant) if sought is None else sought)


def bound_of(
    plant: Plant, found: MotionSensitivity, sensors: Sensors, sought: Sequence[str]
) -> CramerRaoBound:
    """Return the bound from the sensitivities of a motion; see `cramer_rao_bound`."""
    parameters = AxisParameters(
        kind=plant.kind,
        names=tuple(sought),
        known=_known(plant, sought),
        flexible=not isinstance(plant, SingleMass),
    )
    own, p = sensitivity_names(plant), len(sought)
    kept = [k for k, name in enumerate(own) if not name.startswith("initial")]
    resting = {"initial_velocity"} if found.motion.velocity[0] == 0.0 else set[str]()
    free = [k for k, name in enumerate(own) if k not in kept and name not in resting]
    chain = np.zeros((len(own), p + len(free)))
    chain[kept, :p] = parameters.chain([own[k] for k in kept])
    chain[free, p + np.arange(len(free))] = 1.0
    information = np.zeros((chain.shape[1], chain.shape[1]))
    for rows in _rows(found, sensors):
        changes = rows @ chain
        information += changes.T @ changes
    scale = np.sqrt(np.diag(information))
    scale[scale == 0.0] = 1.0
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    determined = values > _UNDETERMINED * values[-1]
    inverse = (vectors[:, determined] / values[determined]) @ vectors[:, determined].T
    inverse = inverse / np.outer(scale, scale)
    unknown = np.any(np.abs(vectors[:, ~determined]) > _INVOLVED, axis=1)
    inverse[unknown, unknown] = np.inf
    marginal = np.linalg.pinv(information[p:, p:], rcond=_UNDETERMINED, hermitian=True)
    across = information[:p, p:]
    return CramerRaoBound(
        names=tuple(sought),
        information=information[:p, :p] - across @ marginal @ across.T,
        covariance=inverse[:p, :p],
        units={name: unit_of(name, plant.kind) for name in sought},
    )


def _known(plant: Plant, sought: Sequence[str]) -> dict[str, float]:
    """Return the parameters of a plant that are not sought, by the names of estimates."""
    known: dict[str, float] = {}
    if isinstance(plant, SingleMass):
        known[mass_name(plant.kind)] = plant.mass
    else:
        known[mass_name(plant.kind)] = plant.mass_1
        known[load_name(plant.kind)] = plant.mass_2
        known["stiffness"] = plant.stiffness
    law: Any = plant.friction
    for name in law.__dataclass_fields__:
        coulomb = coulomb_of(name)
        if name == coulomb or getattr(law, name) != getattr(law, coulomb):
            known[name] = getattr(law, name)
    return {n: v for n, v in known.items() if n not in sought and without_side(n) not in sought}


def _rows(found: MotionSensitivity, sensors: Sensors) -> list[Float[np.ndarray, "_ p"]]:
    """Return the sensitivities of every reading that counts, over its standard deviation."""
    motion = found.motion
    spread = float(np.hypot(sensors.position_noise, sensors.encoder_step / np.sqrt(12.0)))
    if spread == 0.0:
        raise InputError("exact_positions")
    if sensors.velocity == "measured" and sensors.velocity_noise == 0.0:
        raise InputError("exact_velocities")
    positions = [(motion.position, found.position)]
    velocities = [found.velocity]
    if sensors.load and found.load_position is not None and found.load_velocity is not None:
        load = motion.load_position
        positions.append((motion.position if load is None else load, found.load_position))
        velocities.append(found.load_velocity)
    step = sensors.encoder_step
    merged = sensors.position_noise < _DITHER * step
    rows: list[Float[np.ndarray, "_ p"]] = []
    for position, change in positions:
        starts = run_starts(np.floor(position / step + 0.5)) if merged else np.arange(len(position))
        rows.append(run_means(change, starts) / spread)
    if sensors.velocity == "measured":
        rows += [change / sensors.velocity_noise for change in velocities]
    return rows
