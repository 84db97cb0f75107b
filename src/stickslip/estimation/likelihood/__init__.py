"""Maximum likelihood on the exact simulator, and the Cramer-Rao bound of any estimator."""
