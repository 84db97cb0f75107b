"""Controllers on hardware: the loop that runs them in real time."""
