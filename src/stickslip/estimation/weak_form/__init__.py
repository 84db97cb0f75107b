"""The force balance of a rigid axis in its weak form: windows over stretches of slip."""
