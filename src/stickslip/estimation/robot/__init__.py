"""What gravity and the other joints of a robot ask of a joint, from a model of its links."""
