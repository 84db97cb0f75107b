"""Tuning of the windows and of the search."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class SearchTuning:
    """Tuning of the windows and of the search."""

    shortest_window: float = 0.01
    """Half of the narrowest window [s]: drives act on friction below 100 Hz."""
    fewest_samples: int = 3  #: The same in samples: the integrals over a window need them.
    widest_window: float = 0.1  #: Half of the widest window [s], which moves must outlast.
    widest_encoder_window: float = 0.15
    """Half of the widest window where noise of the positions makes most of the residual [s]."""
    largest_attenuation: float = 5e-4
    """Share of the inertia that noise of the position may take, above which windows widen [-]."""
    largest_p_value: float = 2e-3
    """p-value up to which a term is selected [-]: some ten terms give 2 % of false selections."""
    open_p_value: float = 0.1
    """p-value of a small delay [-] below which the delay that fits best is tested: a delay of many
    samples hides behind a wrong inertia."""
    unsettled_p_value: float = 1e-6
    """p-value of a delay that is not found within its bounds [-], above which it is not counted: in
    slow moves all delays fit nearly as well."""
    fewest_deviations: float = 1.0
    """Gain on moves left out of the fit, in its standard errors (one-standard-error rule) [-]."""
    smallest_gain: float = 0.02
    """The same relative to the squared error [-]: less is of no practical importance."""
    dead_band_gain: float = 0.8
    """The same for a dead band [-], whose column contains small efforts themselves: with a band
    only noise remains. 0.5 takes presliding for one in some logs; above 0.9 noise hides bands."""
    friction_beside: float = 0.5
    """Least Coulomb friction beside a dead band, over the band [-]: where friction builds up over
    much of the travel, a band takes its place."""
    smallest_share: float = 1e-3
    """Share of the effort that a term must explain [-]: errors of a sampled motion can be as
    large."""
    smallest_ratio: float = 0.015
    """Smallest over largest singular value of the columns with the term, scaled to unit norm [-]:
    below 0.01 parameters count as not identifiable, which a term must not cause."""
    reversed_viscous: float = 0.1
    """Negative viscous friction beside a bend of the curve, over that without it [-], from which
    the bend is not accepted: viscous friction that is absent is less than that by chance."""
    encoder_share: float = 0.5
    """Share of the residual's variance by noise of the positions from which windows are widened for
    it [-]: below one half, noise of the effort or a disturbance force is as large."""
    least_coverage: float = 0.8
    """Least share of the moves that wider windows must fit into, of that of narrower ones [-]."""
    most_terms: int = 6  #: Most terms in one model beyond the first four [-].
    largest_delay: float = 0.1  #: Largest delay of the effort, positive or negative [s].
    unexplained: float = 0.05
    """Unexplained share of the effort [-] from which delays are compared on a grid."""
    delay_gain: float = 0.5
    """Largest squared unexplained share with the best delay of the grid over that without it
    [-]."""
    scanned_step: float = 0.005  #: Step of that grid [s]: half of `shortest_window`.
    settled_delay: float = 0.005  #: Step of the delay below which it is found [samples].
    delay_steps: int = 40
    """Most Gauss-Newton steps to the delay [-]: noise of the effort shortens them."""
    fewest_rows: int = 20
    """Fewest windows of a log [-]: with fewer, wider ones leave too few for a fit."""
    paired: int = 4
    """Number of terms of which every pair is tried [-]: those that explain most."""
    fewest_periods: int = 3
    """Fewest periods of a ripple along the travel [-]: slower forces are springs and offsets."""
    most_periods: int = 3000
    """Most periods of a ripple along the travel [-]: bounds the memory of the search."""
    ripple_peaks: int = 2  #: Waves of the residual that are tried [-].
    ripple_share: float = 0.2
    """Share of the windows that hold one wave of the shortest ripple at most [-]: the mean over a
    faster window is close to zero."""
