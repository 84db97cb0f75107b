"""Joint fit of several logs of one axis: common friction, separate offsets, delays and drifts."""
