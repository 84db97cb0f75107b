"""The search of the greatest likelihood: first guess, stages of the log, static friction."""
