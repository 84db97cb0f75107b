"""Study of model mismatch: how often ``identify`` reports ``ok`` and is wrong.

The axis is simulated by a plant of its own (`plant`) that shares no code with the package.
"""
