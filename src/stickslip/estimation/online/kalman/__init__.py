"""The extended Kalman filter of motion and friction."""
