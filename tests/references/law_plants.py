"""Plants whose friction law is not affine, for several tests."""

import numpy as np

from stickslip.friction import (
    CoulombViscousFriction,
    DahlFriction,
    ElastoPlasticFriction,
    FrictionLaw,
    LuGreFriction,
    StribeckFriction,
)
from stickslip.plants import FlexibleArm, Plant, SingleMass

# The values of Canudas de Wit et al. (1995)
STRIBECK = StribeckFriction.symmetric(
    coulomb_friction=1.0, static_friction=1.5, viscous_friction=0.4, stribeck_velocity=1e-3
)
STIFFNESS, DAMPING = 1e5, float(np.sqrt(1e5))
DAHL = DahlFriction(
    sliding=CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.4),
    bristle_stiffness=STIFFNESS,
)
LUGRE = LuGreFriction(sliding=STRIBECK, bristle_stiffness=STIFFNESS, bristle_damping=DAMPING)
PLASTIC = ElastoPlasticFriction(
    sliding=STRIBECK, bristle_stiffness=STIFFNESS, bristle_damping=DAMPING, elastic_deflection=7e-6
)
LAWS: dict[str, FrictionLaw] = {
    "Stribeck": STRIBECK,
    "Dahl": DAHL,
    "LuGre": LUGRE,
    "elasto-plastic": PLASTIC,
}


def plant_of(law: FrictionLaw, *, arm: bool) -> Plant:
    """Return a plant of 1 kg with a law, the arm with half a kilogram more on a spring."""
    if arm:
        return FlexibleArm(mass_1=1.0, mass_2=0.5, stiffness=500.0, friction=law)
    return SingleMass(mass=1.0, friction=law)


def random_law(rng: np.random.Generator, name: str) -> FrictionLaw:
    """Return an uneven law of random values around those above."""

    def near(value: float) -> float:
        return value * float(rng.uniform(0.5, 2.0))

    forward, backward = near(1.0), near(1.0)
    coulomb = {"coulomb_friction_positive": forward, "coulomb_friction_negative": backward}
    viscous = {"viscous_friction_positive": near(0.4), "viscous_friction_negative": near(0.4)}
    offset = float(rng.normal(scale=0.2))
    if name == "Dahl":
        static = {"static_friction_positive": forward, "static_friction_negative": backward}
        sliding = CoulombViscousFriction(**coulomb, **static, **viscous, offset=offset)
        exponent = float(rng.choice([1.0, 1.5, 2.0]))
        return DahlFriction(sliding=sliding, bristle_stiffness=near(1e5), exponent=exponent)
    stribeck = StribeckFriction(
        **coulomb,
        static_friction_positive=forward * float(rng.uniform(1.0, 2.0)),
        static_friction_negative=backward * float(rng.uniform(1.0, 2.0)),
        **viscous,
        stribeck_velocity=near(1e-3),
        shape=str(rng.choice(["gaussian", "exponential"])),
        offset=offset,
    )
    stiffness = near(1e5)
    if name == "Stribeck":
        return stribeck
    if name == "LuGre":
        return LuGreFriction(
            sliding=stribeck, bristle_stiffness=stiffness, bristle_damping=near(300.0)
        )
    return ElastoPlasticFriction(
        sliding=stribeck,
        bristle_stiffness=stiffness,
        bristle_damping=near(300.0),
        elastic_deflection=float(rng.uniform(0.3, 0.9)) * min(forward, backward) / stiffness,
    )


def random_plant(rng: np.random.Generator, name: str, *, arm: bool) -> Plant:
    """Return a random plant with such a law."""
    law = random_law(rng, name)
    if arm:
        return FlexibleArm(
            mass_1=float(rng.uniform(0.5, 2)),
            mass_2=float(rng.uniform(0.3, 2)),
            stiffness=float(10.0 ** rng.uniform(1, 3)),
            friction=law,
        )
    return SingleMass(mass=float(rng.uniform(0.3, 3)), friction=law)


def stored_energy(plant, motion):
    """Return the kinetic energy of all masses and that of the spring at every sample [J]."""
    if not plant.flexible:
        return 0.5 * plant.mass * motion.velocity**2
    stretch = motion.position - motion.load_position
    return 0.5 * (
        plant.mass_1 * motion.velocity**2
        + plant.mass_2 * motion.load_velocity**2
        + plant.stiffness * stretch**2
    )
