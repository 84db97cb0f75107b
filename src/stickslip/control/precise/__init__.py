"""Moves with feedback by a model that is learned on the way, then pulses."""
