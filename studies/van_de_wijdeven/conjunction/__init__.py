"""The conjunction: a flexible arm lands at rest, with friction that it learns on the way.

`random_arms` draws arms and what is guessed of them; `contenders` makes controllers for them;
`scoring` runs a controller on an arm and judges the true motion; `study` puts the scores together.
`series` and `landings` measure what `claims` judges and `figures` shows; `computation` does it all.
"""

from studies.van_de_wijdeven.conjunction.computation import reproduce_conjunction

__all__ = ["reproduce_conjunction"]
