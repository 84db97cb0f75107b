"""Energy-based estimation (van de Wijdeven 2002, part A)."""
