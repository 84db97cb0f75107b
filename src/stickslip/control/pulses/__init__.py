"""Positioning by pulses from rest to rest."""
