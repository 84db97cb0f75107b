"""Maximum likelihood with process noise: effort noise, disturbance forces and sensor noise."""
