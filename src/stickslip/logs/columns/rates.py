"""Channels of different rates, resampled to the slowest of them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.records import InputError

_SAME = 1e-9  # stamps of two groups that differ by at most this share of a step are the same

_FEWEST = 2  # samples of a channel, between which it is interpolated


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """Channels that were sampled together."""

    time: Float[np.ndarray, " n"]  # s
    channels: Mapping[str, Float[np.ndarray, " n"]]


def together(parts: Mapping[str, Sampled], *, label: str) -> tuple[Sampled, list[str]]:
    """Return all channels at the stamps of the slowest group, and sentences on it.

    A motion is interpolated linearly between its samples. An effort is averaged over each period of
    the slowest group, in which the log holds it. Stamps outside the time that all groups cover are
    left out.
    """
    groups = list(parts.items())
    for name, part in groups:
        if part.time.size < _FEWEST or np.any(np.diff(part.time) <= 0):
            raise InputError("group_time_not_increasing", where=label, group=name)
    steps = {name: float(np.median(np.diff(part.time))) for name, part in groups}
    base_name = max(steps, key=lambda name: steps[name])
    base = parts[base_name]
    if all(
        part.time.size == base.time.size
        and np.all(np.abs(part.time - base.time) <= _SAME * steps[base_name])
        for _, part in groups
    ):
        channels = {k: v for _, part in groups for k, v in part.channels.items()}
        return Sampled(time=base.time, channels=channels), []
    first = max(part.time[0] for _, part in groups)
    last = min(part.time[-1] for _, part in groups)
    inside = (base.time >= first) & (base.time <= last)
    time = base.time[inside]
    if time.size < _FEWEST:
        raise InputError("groups_apart", where=label, groups=list(parts))
    channels: dict[str, Float[np.ndarray, " n"]] = {}
    notes: list[str] = []
    for name, part in groups:
        for channel, values in part.channels.items():
            if name == base_name:
                channels[channel] = values[inside]
            elif channel == "effort":
                channels[channel] = _mean_while_held(part.time, values, time)
            else:
                channels[channel] = np.interp(time, part.time, values)
        if name == base_name:
            continue
        effort = "effort" in part.channels
        how = "averaged over each of them" if effort else "interpolated"
        lag = 0.5e3 * steps[name]
        notes.append(
            f"{_listed(part.channels)} of {name}, one every {1e3 * steps[name]:.4g} ms, "
            f"{'is' if len(part.channels) == 1 else 'are'} resampled to the "
            f"{1e3 * steps[base_name]:.4g} ms of {base_name} ({how}); added lag: 0 ms on average, "
            f"at most {lag:.3g} ms"
        )
    return Sampled(time=time, channels=channels), notes


def _mean_while_held(
    stamps: Float[np.ndarray, " n"],
    values: Float[np.ndarray, " n"],
    time: Float[np.ndarray, " m"],
) -> Float[np.ndarray, " m"]:
    """Return the mean from each time to the next of a signal that is held between its stamps."""
    impulse = np.concatenate(([0.0], np.cumsum(values[:-1] * np.diff(stamps))))
    ends = np.append(time, 2.0 * time[-1] - time[-2])
    k = np.clip(np.searchsorted(stamps, ends, side="right") - 1, 0, stamps.size - 1)
    until = impulse[k] + values[k] * (ends - stamps[k])
    return np.diff(until) / np.diff(ends)


def _listed(names: Mapping[str, object]) -> str:
    return " and ".join(name.replace("_", " ") for name in names)
