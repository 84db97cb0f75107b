"""Feedback of position and velocity: PD with notch and friction compensation, and PID."""
