"""Preparation of a log for estimation.

Time stamps of arrival are replaced, wrapped angles are continued, the time of lost records is
restored, glitches and steps of the position are repaired, clipped efforts are marked, and uneven
time stamps resampled. Each change is counted and stated in a note.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from stickslip.estimation.signals.arrival_times import ArrivalTuning, at_rate_of, with_even_time
from stickslip.estimation.signals.kinematics import LowPass, noise_level
from stickslip.estimation.signals.lost_records import LostRecordTuning, with_lost_time
from stickslip.estimation.signals.observation import fuse
from stickslip.estimation.signals.resampling import SMALLEST_JITTER, resampled
from stickslip.estimation.signals.sensor_noise import encoder_step, position_noise
from stickslip.estimation.signals.velocity_delay import checked_velocity
from stickslip.records import AxisLog, EffortKind, InputError, count_of


@dataclass(frozen=True, kw_only=True)
class PreparationTuning:
    """Tuning of the detection of defects."""

    shortest_part: int = 20  #: Samples of the shortest stretch without gaps that holds a window.
    wrap_share: float = 0.8
    """Size of a step over the range of the position [-] from which it may be a wrapped angle."""
    glitch_deviations: float = 8.0
    """Deviation from the neighbours, beyond twice their own changes, in standard deviations of the
    second difference [-]: white noise is at most 25 standard deviations off then."""
    longest_glitch: int = 3  #: Samples of the longest glitch, at slow sampling.
    longest_dropout: float = 0.01
    """Duration of the longest glitch [s], at fast sampling: a few cycles of a bus."""
    jump_ratio: float = 5.0
    """Step of the position over its neighbours, and over all but the largest 1 % of the steps,
    beyond which it is no motion [-]."""
    most_jumps: int = 20
    """Number of different steps of the position beyond which they are a property of the recording
    [-]."""
    equal_jumps: float = 0.02
    """Largest relative deviation of equal steps from their median [-]: a counter begins again."""
    closest: float = 0.005
    """Step of time over its median [-] below which a time stamp is wrong: the motion in it is below
    the noise, and speeds over it are noise."""
    most_glitches: float = 0.05
    """Share of the samples [-] beyond which they are not glitches but the signal."""
    fewest_levels: int = 20
    """Distinct efforts [-]: with fewer of them, the drive switches, and its extremes repeat."""
    useful_velocity: float = 0.3
    """Squared noise of fused over that of measured positions [-], below which a velocity is
    used."""
    most_clipped: float = 0.4
    """Share of the samples [-] at an extreme beyond which the input is switched, not clipped."""
    lost_records: LostRecordTuning = field(default_factory=LostRecordTuning)
    """Tuning of the search for lost records."""
    arrival: ArrivalTuning = field(default_factory=ArrivalTuning)
    """Tuning of the test for time stamps of arrival."""


@dataclass(frozen=True, kw_only=True)
class PreparedPart:
    """One stretch without gaps, evenly sampled."""

    time: Float[np.ndarray, " n"]  #: Shape (n,) [s].
    effort: Float[np.ndarray, " n"]  #: Shape (n,) [N or N m].
    position: Float[np.ndarray, " n"]  #: Shape (n,) [m or rad].
    #: At each time stamp [N or N m], shape (n,); zero without a model.
    model_effort: Float[np.ndarray, " n"]
    #: Whether a sample was recorded as it was, shape (n,); clipped and repaired ones are not.
    usable: Bool[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class PreparedLog:
    """A log with its defects found, repaired where possible, and counted."""

    log: AxisLog  #: Repaired, with its own time stamps.
    parts: tuple[PreparedPart, ...]  #: Its stretches without gaps, evenly sampled.
    sampling_time: float  #: [s].
    #: Kind of the effort of the log. That of the parts acts for one sample, from `effort_lead`
    #: before its time stamp on.
    effort_kind: EffortKind
    #: Standard deviation of the noise of a position, rounding included [m or rad].
    position_noise: float
    #: Of that noise from one sample to the next [-]; 0 unless positions are fused with velocities.
    noise_correlation: float
    #: Period by which the position was found to wrap [m or rad]; 0 if it does not.
    wrap_period: float
    repaired: int  #: Number of samples repaired [-].
    clipped: int  #: Number of samples with a clipped effort [-].
    notes: tuple[str, ...]  #: Changes of the log, one sentence each.

    @property
    def effort_lead(self) -> float:
        """Time before its time stamp from which the effort of a part acts [samples]."""
        return 0.5 if self.effort_kind == "sampled" else 0.0

    @property
    def averaged_effort(self) -> bool:
        """Whether the effort of a part is a mean of an effort that varies within a sample."""
        return self.effort_kind == "mean" and not self.resampled

    @property
    def resampled(self) -> bool:
        """Whether the time stamps were uneven."""
        return self.log.timing_jitter >= SMALLEST_JITTER

    def with_parts(self) -> "PreparedLog":
        """Return the log, which has one part or more.

        Raises
        ------
        InputError
            If no stretch without a gap is long enough.
        """
        if not self.parts:
            raise InputError(
                "no_stretch",
                where=self.log.name,
                samples=len(self.log),
                sampling_time=self.sampling_time,
                least=_DEFAULT.shortest_part,
            )
        return self


@dataclass(frozen=True, kw_only=True)
class RepairedLog(AxisLog):
    """A log with its defects repaired and with uniform samples between its gaps."""

    notes: tuple[str, ...] = ()  #: Changes of the log, one sentence each.
    #: Whether the effort is probably clipped: it is biased unless the drive was clipped too.
    clipped: bool = False


_DEFAULT = PreparationTuning()


def repaired(log: AxisLog, tuning: PreparationTuning = _DEFAULT) -> RepairedLog:
    """Return a log with wraps, glitches and jumps repaired and with uniform samples.

    For the estimators that take every sample. A log without defects and with even time stamps keeps
    its samples, and so does a repaired log. Efforts that are probably clipped are kept, as the
    drive may have been clipped too; a note names them.
    """
    if isinstance(log, RepairedLog):
        return log
    log, _, timed = _timed(log, tuning)
    marks, clipped = _clipped(log, tuning, "taken as they are")
    log, _, mended = _mended(log, tuning)
    even, changes = resampled(log)
    samples = {each.name: getattr(even, each.name) for each in fields(AxisLog)}
    return RepairedLog(
        **samples, notes=(*timed, *clipped, *mended, *changes), clipped=bool(np.any(marks))
    )


def prepare(
    log: AxisLog, tuning: PreparationTuning = _DEFAULT, *, effort_kind: EffortKind = "held"
) -> PreparedLog:
    """Return the log of a rigid axis with its defects found, repaired where possible, and counted.

    The logged effort is ``"held"`` from its time stamp to the next, ``"sampled"`` at its time
    stamp, or the ``"mean"`` since the time stamp before.
    """
    log, wrap_period, timed = _timed(log, tuning)
    clipped, found = _clipped(log, tuning, "excluded")
    log, marks, mended = _mended(log, tuning)
    notes = [*timed, *found, *mended]
    lost = np.zeros(len(log), dtype=bool)
    if effort_kind == "mean":  # which is held from the time stamp before
        log, lost = _held_before(log)
        clipped = np.append(clipped[1:], True)
    even, found = resampled(log, held=effort_kind != "sampled")
    notes += found
    spoiled = np.interp(even.time, log.time, (clipped | marks | lost).astype(float)) > 0.0
    even, fused, correlation, found = _with_velocity(even, tuning)
    notes += found
    parts: list[PreparedPart] = []
    model = np.zeros(len(even)) if even.model_effort is None else even.model_effort
    starts = [*even.segment_starts.tolist(), len(even)]
    for start, stop in pairwise(starts):
        if stop - start >= tuning.shortest_part:
            parts.append(
                PreparedPart(
                    time=even.time[start:stop],
                    effort=even.effort[start:stop],
                    position=even.measured_position[start:stop],
                    model_effort=model[start:stop],
                    usable=~spoiled[start:stop],
                )
            )
    longest = max((part.position for part in parts), key=len, default=np.zeros(0))
    step = max((encoder_step(part.position) for part in parts), default=0.0)
    return PreparedLog(
        log=log,
        parts=tuple(parts),
        sampling_time=even.sampling_time,
        effort_kind=effort_kind,
        position_noise=fused or max(noise_level(longest), step / float(np.sqrt(12.0))),
        noise_correlation=correlation,
        wrap_period=wrap_period,
        repaired=int(np.sum(marks)),
        clipped=int(np.sum(clipped)),
        notes=tuple(notes),
    )


def _mended(
    log: AxisLog, tuning: PreparationTuning
) -> tuple[AxisLog, Bool[np.ndarray, " n"], list[str]]:
    """Repair glitches of all signals and jumps of the position, and mark the repaired samples."""
    log, marks, notes = _without_glitches(log, tuning)
    log, jumped, found = _without_jumps(log, tuning)
    return log, marks | jumped, notes + found


_POSITIONS = ("measured_position", "measured_load_position")
_FEW_JUMPS = 3  # steps up to which they need not be equal [-]
_FEWEST_DIFFERENCES = 50  # of a signal [-]: with fewer, the usual size of a difference is uncertain


def _timed(log: AxisLog, tuning: PreparationTuning) -> tuple[AxisLog, float, list[str]]:
    """Return the log with the times of its samples, the period by which it wraps, and notes."""
    log, period, notes = _continued(log, tuning)
    even, arrival = with_even_time(log, tuning.arrival)
    if arrival:
        restored, lost = with_lost_time(even, replace(tuning.lost_records, arrival=True))
        if lost:
            restored = at_rate_of(restored, log.time, tuning.arrival)
        return restored, period, [*notes, *arrival, *lost]
    timed, close = _without_close_stamps(log, tuning)
    restored, lost = with_lost_time(timed, tuning.lost_records)
    return restored, period, [*notes, *close, *lost]


def _continued(log: AxisLog, tuning: PreparationTuning) -> tuple[AxisLog, float, list[str]]:
    """Return the log with continued angles, the period by which they wrap, and notes."""
    period, notes = 0.0, list[str]()
    for name in _POSITIONS:
        log, own, found = _unwrapped(log, name, tuning)
        period, notes = period or own, notes + found
    return log, period, notes


def sample_times(log: AxisLog, tuning: PreparationTuning = _DEFAULT) -> Float[np.ndarray, " n"]:
    """Return the time at which each sample of a log was taken, as `prepare` finds it [s].

    That of a sample which `prepare` excludes is interpolated.
    """
    timed, _, _ = _timed(log, tuning)
    if len(timed) == len(log):
        return timed.time
    kept = np.append(True, ~_close_stamps(log, tuning))
    return np.interp(log.time, log.time[kept], timed.time)


def with_common_times(
    logs: Mapping[str, AxisLog], tuning: PreparationTuning = _DEFAULT
) -> dict[str, AxisLog]:
    """Return logs of one record, with the even times that the motion of another axis shows.

    Time stamps of arrival are those of the whole record. An axis that hardly moves does not show
    that its samples are even; an axis that moves, with the same time stamps, does.
    """
    found = dict(logs)
    if len(found) < 2:
        return found
    continued = {axis: _continued(log, tuning)[0] for axis, log in logs.items()}
    shown = {axis for axis, log in continued.items() if with_even_time(log, tuning.arrival)[1]}
    for axis, log in logs.items():
        if axis in shown:
            continue
        same = [other for other in sorted(shown) if np.array_equal(logs[other].time, log.time)]
        if same:
            note = (
                f"the time stamps are those of arrival, as the motion of {same[0]} shows; even "
                "times are used"
            )
            source = log.source
            if source is not None:
                source = replace(source, assumptions=(*source.assumptions, note))
            found[axis] = replace(log, time=sample_times(logs[same[0]], tuning), source=source)
    return found


def _close_stamps(log: AxisLog, tuning: PreparationTuning) -> Bool[np.ndarray, " m"]:
    """Mark the steps of time that are too short for one sample."""
    return np.diff(log.time) < tuning.closest * log.sampling_time


def _without_close_stamps(log: AxisLog, tuning: PreparationTuning) -> tuple[AxisLog, list[str]]:
    """Return the log without samples whose time stamp is next to that of the one before."""
    close = _close_stamps(log, tuning)
    if not close.any():
        return log, []
    note = (
        f"{count_of(int(close.sum()), 'time stamp')} less than {100 * tuning.closest:g} % of a "
        "sampling time after the one before; excluded"
    )
    return log.selected(np.append(True, ~close)), [note]


def _held_before(log: AxisLog) -> tuple[AxisLog, Bool[np.ndarray, " n"]]:
    """Return the log with each effort one time stamp earlier, and the samples that have none."""
    lost = np.zeros(len(log), dtype=bool)
    lost[[*(log.segment_starts[1:] - 1), len(log) - 1]] = True
    effort = np.append(log.effort[1:], log.effort[-1])
    return replace(log, effort=np.where(lost, log.effort, effort)), lost


def _clipped(
    log: AxisLog, tuning: PreparationTuning, treated: str
) -> tuple[Bool[np.ndarray, " n"], list[str]]:
    """Mark samples whose effort stays at its largest or smallest value."""
    u = log.effort
    marks = np.zeros(u.size, dtype=bool)
    levels = np.unique(u)
    if levels.size < tuning.fewest_levels:
        return marks, []
    inner = u[(u > levels[0]) & (u < levels[-1])]
    repeats = float(np.mean(inner[1:] == inner[:-1]))  # in coarse steps, or of a slower bus
    notes: list[str] = []
    for extreme in (levels[0], levels[-1]):
        at = u == extreme
        share = float(np.mean(at))
        if extreme == 0.0:  # no effort is how a drive rests
            continue
        expected = 5.0 / levels.size + 5.0 * repeats * share
        if np.sum(at[1:] & at[:-1]) >= 3 and share > expected:
            marks |= at
            notes.append(
                f"effort clipped at {extreme:.4g} {log.unit('effort')} in {100 * share:.2g} % of "
                f"samples; samples {treated}"
            )
    share = float(np.mean(marks))
    if share > tuning.most_clipped:
        note = f"effort at an extreme in {100 * share:.2g} % of samples: a square wave, or clipped"
        return np.zeros(u.size, dtype=bool), [note]
    return marks, notes


def _unwrapped(
    log: AxisLog, name: str, tuning: PreparationTuning
) -> tuple[AxisLog, float, list[str]]:
    """Return the log with an angle continued where it jumps by its period, and that period.

    Readings between the ends of a period may cross it back and forth, so that every step is taken
    modulo the period. A linear axis does not wrap.
    """
    x = getattr(log, name)
    if x is None:
        return log, 0.0, []
    steps = np.abs(np.diff(x))
    low, high = np.quantile(x, [0.005, 0.995])
    extent = float(high - low)
    jumps = steps[steps > tuning.wrap_share * extent]
    if log.kind != "rotary" or extent == 0.0 or jumps.size == 0:
        return log, 0.0, []
    size = float(np.median(jumps))
    period = min(_PERIODS, key=lambda usual: abs(size / usual - 1.0))
    if abs(size / period - 1.0) > 1.0 - tuning.wrap_share:
        return log, 0.0, []
    if extent > (2.0 - tuning.wrap_share) * period or extent < tuning.wrap_share * period:
        return log, 0.0, []
    note = (
        f"{_shown(name)} jumps by {period:.4g} {log.unit('position')} in "
        f"{count_of(jumps.size, 'place')}; unwrapped"
    )
    return replace(log, **{name: np.unwrap(x, period=period)}), period, [note]


def _shown(name: str) -> str:
    """Return the name of a signal for a note."""
    return name.removeprefix("measured_").replace("_", " ")


_PERIODS = (2.0 * np.pi, 360.0, 1.0)  # periods of an angle in rad, degrees and turns


def _without_jumps(
    log: AxisLog, tuning: PreparationTuning
) -> tuple[AxisLog, Bool[np.ndarray, " n"], list[str]]:
    """Return the log without steps of the position, as of an encoder that was homed again."""
    x = log.measured_position
    steps = np.diff(x)
    marks = np.zeros(x.size, dtype=bool)
    size = np.abs(steps)
    size[log.segment_starts[1:] - 1] = 0.0  # the axis may move in a gap
    if size.size < _FEWEST_DIFFERENCES:
        return log, marks, []
    around = np.maximum(
        ndimage.maximum_filter1d(np.concatenate(([0.0] * 3, size[:-3])), 5),
        ndimage.maximum_filter1d(np.concatenate((size[3:], [0.0] * 3)), 5),
    )
    least = float(np.min(size[size > 0.0], initial=np.inf))  # a single step of an encoder is none
    usual = max(float(np.quantile(size, 0.99)), least)
    jumps = np.flatnonzero(size > tuning.wrap_share * float(np.ptp(x)))  # a register begins again
    if jumps.size <= _FEW_JUMPS:
        jumps = np.flatnonzero(size > tuning.jump_ratio * np.maximum(around, usual))
    if jumps.size == 0:
        return log, marks, []
    taken = np.zeros(x.size)
    for k in jumps.tolist():
        beside = [steps[j] for j in (k - 1, k + 1) if 0 <= j < steps.size and j not in jumps]
        taken[k + 1] = steps[k] - (float(np.mean(beside)) if beside else 0.0)
        marks[k : k + 2] = True
    typical = float(np.median(np.abs(taken[jumps + 1])))
    apart = np.max(np.abs(np.abs(taken[jumps + 1]) - typical))
    equal = jumps.size > _FEW_JUMPS and apart <= tuning.equal_jumps * typical
    if equal:
        taken = typical * np.sign(taken)
    elif jumps.size > tuning.most_jumps:
        return log, np.zeros_like(marks), []
    unit = log.unit("position")
    sizes = ", ".join(f"{taken[k + 1]:.3g} {unit} at {log.time[k + 1]:.4g} s" for k in jumps[:3])
    note = f"position jumps in {count_of(jumps.size, 'place')} ({sizes}); continued behind it"
    return replace(log, measured_position=x - np.cumsum(taken)), marks, [note]


def _without_glitches(
    log: AxisLog, tuning: PreparationTuning
) -> tuple[AxisLog, Bool[np.ndarray, " n"], list[str]]:
    """Return the log with interpolated glitches; a pulse of effort that moves the axis stays."""
    marks = np.zeros(len(log), dtype=bool)
    notes: list[str] = []
    changed: dict[str, Float[np.ndarray, " n"]] = {}
    T = log.sampling_time
    length = max(tuning.longest_glitch, round(tuning.longest_dropout / T))
    for name in (*_POSITIONS, *_VELOCITIES, "effort"):
        values = getattr(log, name)
        if values is None:
            continue
        wild = _glitches(values, length, tuning)
        if name in _VELOCITIES:  # at low speed that of an encoder is zero between single steps
            low, high = np.quantile(values, [0.005, 0.995])
            wild &= np.abs(values - 0.5 * (low + high)) > high - low
        elif name == "effort":
            wild &= ~_answers(changed.get("measured_position", log.measured_position), length)
        if np.any(wild):
            good = np.flatnonzero(~wild)
            changed[name] = np.interp(np.arange(values.size), good, values[good])
            marks |= wild
            notes.append(
                f"{count_of(int(wild.sum()), 'sample')} of the {_shown(name)} excluded as glitches"
            )
    return (replace(log, **changed) if changed else log), marks, notes


_VELOCITIES = ("measured_velocity", "measured_load_velocity")
_ANSWER = 5.0  # acceleration over its 95 % quantile [-], beyond which a pulse moved the axis


def _answers(position: Float[np.ndarray, " n"], length: int) -> Bool[np.ndarray, " n"]:
    """Mark the samples around which the axis accelerates much more than usual."""
    second = np.abs(np.diff(position, 2, prepend=position[0], append=position[-1]))
    usual = float(np.quantile(second, 0.95))
    return ndimage.maximum_filter1d(second, 2 * length + 3) > _ANSWER * usual


def _with_velocity(
    log: AxisLog, tuning: PreparationTuning
) -> tuple[AxisLog, float, float, list[str]]:
    """Return the log with positions fused with a measured velocity, and their noise; 0 if not.

    A velocity is used if its scale and its delay agree with the positions, and if it reduces their
    noise. Errors of a smoothed local level are correlated by 1 - K from sample to sample, with the
    gain K = (sqrt(r^2 + 4 r) - r)/2 of its filter and r the variance of a step over that of a
    measurement.
    """
    low_pass = LowPass.of(log.sampling_time)
    match, note = checked_velocity(log, low_pass)
    if note:
        return log, 0.0, 0.0, [note]
    T = log.sampling_time
    x, v = log.measured_position, log.measured_velocity
    if v is None or match is None or log.segment_starts.size > 1:
        return log, 0.0, 0.0, []
    position, velocity = position_noise(x), noise_level(v)
    # Smoothed local level: steps of variance q between measurements of variance position^2
    q = (T * velocity) ** 2
    share = float(np.sqrt(q / (q + 4.0 * position**2))) if q > 0 else 0.0
    if position == 0.0 or velocity == 0.0 or share > tuning.useful_velocity:
        return log, 0.0, 0.0, []
    fused = fuse(x, v, position, velocity, T)
    ratio = q / position**2
    correlation = 1.0 - 0.5 * (float(np.sqrt(ratio**2 + 4.0 * ratio)) - ratio)
    return (
        replace(log, measured_position=fused),
        position * float(np.sqrt(share)),
        correlation,
        [],
    )


def _glitches(
    values: Float[np.ndarray, " n"], longest: int, tuning: PreparationTuning
) -> Bool[np.ndarray, " n"]:
    """Mark runs of a few samples that are far off the line through their neighbours."""
    n = values.size
    wild = np.zeros(n, dtype=bool)
    second = np.abs(np.diff(values, 2))
    if second.size < _FEWEST_DIFFERENCES:
        return wild
    # Two quantiles of the magnitudes of normal values: the median of coarse steps may be zero
    scale = max(float(np.median(second)) / 0.6745, float(np.quantile(second, 0.9)) / 1.645)
    least = tuning.glitch_deviations * scale
    # A longer run is more than a glitch, and may be longer than the part of the log
    for length in range(1, min(longest, int(tuning.most_glitches * n)) + 1):
        # Few samples are so far off the line: only these are examined
        left, right = values[1 : n - length - 2], values[2 + length : n - 1]
        far = np.abs(values[2 : n - length - 1] - 0.5 * (left + right)) - 2.0 * np.abs(right - left)
        at = 2 + np.flatnonzero(far > least)
        before, after = values[at - 1], values[at + length]
        middle = values[at + np.arange(length)[:, None]]
        off = middle - 0.5 * (before + after)
        same_side = np.all(np.sign(off) == np.sign(off[0]), axis=0)
        changes = (
            np.abs(after - before)
            + np.abs(before - values[at - 2])
            + np.abs(values[at + length + 1] - after)
        )
        beyond = np.min(np.abs(off), axis=0) - 2.0 * changes
        for k in at[same_side & (beyond > least)].tolist():
            wild[k : k + length] = True
    return wild if np.mean(wild) <= tuning.most_glitches else np.zeros(n, dtype=bool)
