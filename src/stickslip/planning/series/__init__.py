"""Series of pulses that take a flexible arm from rest to rest."""
