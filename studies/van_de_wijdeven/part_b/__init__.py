"""Part B: pulse width control, pulse amplitude and width control, and what beats them.

`computation` puts it together. The way there, in the order to read it: `setting` holds Table 1,
`cases` the controllers in the readings that the text allows, `runs` simulates them run after run,
`evidence` gathers all of them; `numbers` are those that the source prints, `figures` its figures.
`law_claims` judges sections 2 and 3.1, `width_claims` the claims on PWC, `form_claims` the
equations of PAPWC, `error_claims`, `pulse_claims` and `estimate_claims` PAPWC at work (`judging` is
what they share). Beyond the source, `study` puts controllers beside each other on `random_axes`
(`contenders` says which, `pid_tuning` how the PID among them are tuned, `trials` and `scoring` run
and score them), and `resolution` asks how near the target pulses can bring an axis.
"""

from studies.van_de_wijdeven.part_b.computation import reproduce_part_b

__all__ = ["reproduce_part_b"]
