"""Judgement of a fit: plausibility of the log, and the status of the estimate."""
