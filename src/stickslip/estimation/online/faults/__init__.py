"""Missing and impossible samples, the last valid state, and the counts of both."""
