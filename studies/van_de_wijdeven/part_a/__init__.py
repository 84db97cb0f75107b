"""Part A: energy-based estimation of Coulomb and viscous friction.

`computation` puts it together. The way there, in the order to read it: `cases` says which
estimators are looked at, `runs` simulates them in both loops, `sequences` and `monte_carlo` repeat
that and keep what `effects` and the claims need; `expectations` and `run_figures` make the figures
of chapters 5 and 6; `evidence` holds all that was measured, by which `noise_claims`,
`simulation_claims` and `loop_claims` judge chapters 5, 6.1 and 6.2 (`judging` is what they share).
"""

from studies.van_de_wijdeven.part_a.computation import reproduce_part_a

__all__ = ["reproduce_part_a"]
