"""The faults of drives, sensors and mechanics under which controllers are judged."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from studies.mismatch.plant import Plant


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Noise of the sensors of an arm, which is given to the controller."""

    #: Standard deviations [m, m/s].
    position: float = 0.0
    velocity: float = 0.0
    step: float = 0.0  #: Of the encoders of both positions; 0 for none [m].
    #: Whether the velocities are differences of encoder positions over a sample; the controller
    #: takes ``velocity`` for their noise.
    differentiated: bool = False

    @classmethod
    def of_encoder(cls, step: float, T: float) -> "Noise":
        """Return that of differentiated encoder positions, of a step [m] and a sampling time."""
        return cls(step=step, velocity=step / (T * np.sqrt(6.0)), differentiated=True)


@dataclass(frozen=True, kw_only=True)
class Channels:
    """Faults between controller and plant."""

    delay: int = 0  #: Of all sensors, whole samples [-].
    lost: float = 0.0  #: Probability that a sample has no channel but its time [-].
    glitches: float = 0.0  #: Probability that a position is off by the length of a move [-].
    frozen_from: float = np.inf  #: Time from which all channels keep their values [s].
    missing_load: bool = False  #: Whether the second body has no sensors.
    gain: float = 1.0  #: True effort over the commanded one [-].
    effort_noise: float = 0.0  #: Standard deviation of the effort's gain from sample to sample [-].
    effort_step: float = 0.0  #: Resolution of the effort over its limit [-]; 0 is exact.
    clip: float = 1.0  #: True effort limit over the limit of the controller [-].
    #: Force against the axis over the effort limit, for 50 ms at half of the time [-].
    push: float = 0.0
    velocity: bool = True  #: Whether the velocities of an arm are measured.
    #: Of the sensors of an arm, given the sampling time [s]; None for exact sensors.
    noise: Callable[[float], Noise] | None = None


@dataclass(frozen=True, kw_only=True)
class Case:
    """A set of faults: changes of the plant, given its sampling time, and of the channels.

    ``mild`` cases must position; of the others only safety is asked. With ``retargeted`` the target
    is halved during the first move, after that many seconds.
    """

    name: str
    mild: bool = True
    channels: Channels = Channels()
    plant: Callable[[Plant, float], Plant] = lambda plant, _: plant
    retargeted: float | None = None


def _all_mild_axis(plant: Plant, T: float) -> Plant:
    return plant._replace(
        actuation_delay=T,
        actuation_lag=0.5 * T,
        static_ratio=max(1.3, plant.static_ratio),
        presliding=5e-6,
        presliding_damping=0.3,
        ripple=0.1 * plant.coulomb_positive,
        ripple_period=2e-3,
    )


def _resonance(plant: Plant, hertz: float) -> Plant:
    """Put 30 % of the mass behind a spring, with a damping of 2 %."""
    driven, load = 0.7 * plant.mass, 0.3 * plant.mass
    reduced, frequency = driven * load / plant.mass, 2.0 * np.pi * hertz
    return plant._replace(
        mass=driven,
        load_mass=load,
        coupling_stiffness=reduced * frequency**2,
        coupling_damping=2.0 * 0.02 * reduced * frequency,
    )


def _backlash(plant: Plant, _: float) -> Plant:
    """Put 20 % of the mass behind a stiff spring (200 Hz) with a play of 10 µm."""
    driven, load = 0.8 * plant.mass, 0.2 * plant.mass
    reduced, frequency = driven * load / plant.mass, 2.0 * np.pi * 200.0
    return plant._replace(
        mass=driven,
        load_mass=load,
        coupling_stiffness=reduced * frequency**2,
        coupling_damping=2.0 * 0.05 * reduced * frequency,
        backlash=10e-6,
    )


def _loaded(share: float) -> Case:
    """Return the case of a constant load, over Coulomb friction."""

    def plant(plant: Plant, _: float) -> Plant:
        return plant._replace(offset=share * max(plant.coulomb_positive, plant.coulomb_negative))

    return Case(name=f"load of {share:.0%} of friction".replace("%", " %"), mild=False, plant=plant)


AXIS_CASES = (
    Case(name="no fault"),
    Case(name="delay of 1/2 sample", plant=lambda p, T: p._replace(actuation_delay=0.5 * T)),
    Case(name="delay of 1 sample", plant=lambda p, T: p._replace(actuation_delay=T)),
    Case(name="delay of 2 samples", plant=lambda p, T: p._replace(actuation_delay=2.0 * T)),
    Case(name="delay of 5 samples", plant=lambda p, T: p._replace(actuation_delay=5.0 * T)),
    Case(name="lag of the drive of 1 sample", plant=lambda p, T: p._replace(actuation_lag=T)),
    Case(
        name="Stribeck effect of 50 %",
        plant=lambda p, _: p._replace(static_ratio=1.5, stribeck_velocity=0.005),
    ),
    Case(
        name="friction of the directions 20 % apart",
        plant=lambda p, _: p._replace(
            coulomb_positive=1.1 * p.coulomb_positive, coulomb_negative=0.9 * p.coulomb_negative
        ),
    ),
    Case(name="resonance of the drive, 30 Hz", plant=lambda p, _: _resonance(p, 30.0)),
    Case(name="resonance of the drive, 80 Hz", plant=lambda p, _: _resonance(p, 80.0)),
    Case(
        name="delay of 1 sample, presliding of 5 µm",
        plant=lambda p, T: p._replace(actuation_delay=T, presliding=5e-6, presliding_damping=0.3),
    ),
    Case(
        name="lag of 1 sample, load of 50 %",
        plant=lambda p, T: p._replace(actuation_lag=T, offset=0.5 * p.coulomb_positive),
    ),
    Case(
        name="delay of 1 sample, Stribeck effect of 50 %",
        plant=lambda p, T: p._replace(actuation_delay=T, static_ratio=1.5, stribeck_velocity=0.005),
    ),
    Case(
        name="delay of 1 sample, effort gain of 0.9",
        channels=Channels(gain=0.9),
        plant=lambda p, T: p._replace(actuation_delay=T),
    ),
    Case(
        name="ripple of 20 %, load of 50 %",
        plant=lambda p, _: p._replace(
            ripple=0.2 * p.coulomb_positive, ripple_period=2e-3, offset=0.5 * p.coulomb_positive
        ),
    ),
    Case(
        name="presliding of 5 µm, load of 80 %",
        plant=lambda p, _: p._replace(
            presliding=5e-6, presliding_damping=0.3, offset=0.8 * p.coulomb_positive
        ),
    ),
    Case(
        name="presliding of 5 µm",
        plant=lambda p, _: p._replace(presliding=5e-6, presliding_damping=0.3),
    ),
    Case(
        name="presliding of 50 µm",
        plant=lambda p, _: p._replace(presliding=5e-5, presliding_damping=0.3),
    ),
    Case(
        name="ripple of 20 % of friction",
        plant=lambda p, _: p._replace(ripple=0.2 * p.coulomb_positive, ripple_period=2e-3),
    ),
    Case(
        name="load of 80 % of friction",
        plant=lambda p, _: p._replace(offset=0.8 * min(p.coulomb_positive, p.coulomb_negative)),
    ),
    Case(name="effort of 8 bits", channels=Channels(effort_step=1.0 / 127.0)),
    Case(name="effort gain of 0.9", channels=Channels(gain=0.9)),
    Case(name="effort gain of 1.1", channels=Channels(gain=1.1)),
    Case(name="effort limit of 70 %", channels=Channels(clip=0.7)),
    Case(name="lost samples, 2 %", channels=Channels(lost=0.02)),
    Case(name="glitches, 1 %", channels=Channels(glitches=0.01)),
    Case(name="push of 80 % of the limit", channels=Channels(push=0.8)),
    Case(name="backlash of 10 µm", plant=_backlash),
    Case(name="another target during the move", retargeted=0.04),
    Case(
        name="all mild faults",
        plant=_all_mild_axis,
        channels=Channels(effort_step=1.0 / 127.0, gain=0.95, lost=0.01),
    ),
    _loaded(1.6),
    _loaded(2.4),
    Case(name="frozen sensors", mild=False, channels=Channels(frozen_from=0.35)),
    Case(name="sensors that freeze in the move", mild=False, channels=Channels(frozen_from=0.05)),
    Case(name="no sensors", mild=False, channels=Channels(lost=1.0)),
)


def _presliding(plant: Plant, _: float) -> Plant:
    return plant._replace(presliding=5e-5, presliding_damping=0.3)


def damped(plant: Plant, _: float) -> Plant:
    """Return an arm whose spring has a damping of 2 %."""
    damping = 2.0 * 0.02 * float(np.sqrt(plant.coupling_stiffness * plant.load_mass))
    return plant._replace(coupling_damping=damping)


def _all_mild_arm(plant: Plant, T: float) -> Plant:
    return damped(_presliding(plant, T), T)._replace(actuation_delay=T, load_friction=0.02)


def _other_arm(plant: Plant, _: float) -> Plant:
    return plant._replace(
        mass=0.9 * plant.mass,
        load_mass=1.1 * plant.load_mass,
        coupling_stiffness=0.9 * plant.coupling_stiffness,
    )


ARM_CASES = (
    Case(name="no fault"),
    Case(name="delay of 1/4 sample", plant=lambda p, T: p._replace(actuation_delay=0.25 * T)),
    Case(name="delay of 1 sample", plant=lambda p, T: p._replace(actuation_delay=T)),
    Case(name="delay of 2 samples", plant=lambda p, T: p._replace(actuation_delay=2.0 * T)),
    Case(
        name="Stribeck effect of 50 %",
        plant=lambda p, _: p._replace(static_ratio=1.5, stribeck_velocity=0.01),
    ),
    Case(name="presliding of 5e-5 m", plant=_presliding),
    Case(name="damping of 2 %", plant=damped),
    Case(name="friction of 2 % on mass 2", plant=lambda p, _: p._replace(load_friction=0.02)),
    Case(name="effort noise of 1 %", channels=Channels(effort_noise=0.01)),
    Case(name="effort gain of 1.03", channels=Channels(gain=1.03)),
    Case(
        name="offset of 10 % of friction",
        plant=lambda p, _: p._replace(offset=0.1 * p.coulomb_positive),
    ),
    Case(name="effort limit of 70 %", channels=Channels(clip=0.7)),
    Case(name="lost samples, 2 %", channels=Channels(lost=0.02)),
    Case(
        name="all mild faults",
        plant=_all_mild_arm,
        channels=Channels(effort_noise=0.01, lost=0.01),
    ),
    Case(
        name="noise of 1e-5 m and 1e-4 m/s",
        channels=Channels(noise=lambda _: Noise(position=1e-5, velocity=1e-4)),
    ),
    Case(
        name="encoders of 1e-5 m, differentiated",
        channels=Channels(noise=lambda T: Noise.of_encoder(1e-5, T)),
    ),
    Case(
        name="encoders of 1e-5 m, no velocity",
        channels=Channels(noise=lambda _: Noise(step=1e-5), velocity=False),
    ),
    Case(name="glitches, 1 %", channels=Channels(glitches=0.01)),
    Case(name="push of 80 % of the limit", channels=Channels(push=0.8)),
    Case(name="another target during the move", retargeted=2.0),
    Case(
        name="noise of 1e-6 m and 1e-5 m/s, all mild faults",
        plant=_all_mild_arm,
        channels=Channels(
            effort_noise=0.01, lost=0.01, noise=lambda _: Noise(position=1e-6, velocity=1e-5)
        ),
    ),
    Case(name="masses and spring wrong by 10 %", plant=_other_arm),
    Case(
        name="noise of 1e-5 m and 1e-4 m/s, masses and spring wrong by 10 %",
        plant=_other_arm,
        channels=Channels(noise=lambda _: Noise(position=1e-5, velocity=1e-4)),
    ),
    Case(name="load not measured", mild=False, channels=Channels(missing_load=True)),
    Case(name="frozen sensors", mild=False, channels=Channels(frozen_from=6.0)),
)
