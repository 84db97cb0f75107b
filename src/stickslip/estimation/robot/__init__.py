"""Efforts of gravity and of the other joints on a joint of a robot, from a model of its links."""
