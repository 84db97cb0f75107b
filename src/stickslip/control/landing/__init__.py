"""Landings: feedback near the target while friction is learned, then pulses that end at rest."""
