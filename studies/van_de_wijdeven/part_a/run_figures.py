"""Figures 6.1 to 6.10 of the source, from five consecutive runs of each case in each loop."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from stickslip.records import in_words, parameter_label, unit_of
from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.runs import Loop, Trace, itse
from studies.van_de_wijdeven.records import Curve, CurveRole, FiveRuns, Panel, ReproducedFigure

Traces = Mapping[tuple[Loop, str], Trace]

_PAIRS = (("clean", "noisy"), ("full", "wrong"), ("terms", "wrong-terms"))
"""Which two cases share a panel of Figures 6.1, 6.2, 6.6, 6.7, or a figure of the others."""

_PARAMETERS = tuple(surrogate.TRUTH)
_FIRST_NUMBER = {"feedforward": 1, "feedback": 6}
_STRIDE = 10
_SETTLING = 5.0  # of the first run, in which the estimates come from their first guesses [s]
_MARGIN = 0.08  # of the vertical range, on either side
_ALIKE = 3.0  # ratio of two columns' ranges up to which they share one
_SHOWN = 99.5  # percentile of noisy prediction errors that the vertical range holds


def run_figures(loop: Loop, traces: Traces) -> tuple[ReproducedFigure, ...]:
    """Return the five figures of one loop."""
    shown = {key: traces[loop, key] for pair in _PAIRS for key in pair}
    first = _FIRST_NUMBER[loop]
    reference = _reference(loop, traces)
    remarks = {"full": _larger_errors(first + len(_PARAMETERS), loop, shown)}
    return (
        *(_evolution(first + k, k, shown) for k in range(len(_PARAMETERS))),
        *(
            _errors(
                first + len(_PARAMETERS) + k,
                [shown[key] for key in pair],
                reference,
                remarks.get(pair[0], ""),
            )
            for k, pair in enumerate(_PAIRS)
        ),
    )


def five_run_table(traces: Traces) -> tuple[FiveRuns, ...]:
    """Return the estimates and the ITSE after each run, of every case."""
    return tuple(
        FiveRuns(
            loop=loop,
            case=trace.case.label,
            values={name: trace.values[:, -1, k].copy() for k, name in enumerate(_PARAMETERS)},
            itse=itse(trace.time, trace.error) / _reference(loop, traces),
        )
        for (loop, _), trace in traces.items()
    )


def _reference(loop: Loop, traces: Traces) -> float:
    """Return the ITSE of the first run without noise, over which the source puts all others."""
    clean = traces[loop, "clean"]
    return float(itse(clean.time, clean.error)[0])


def _evolution(number: int, parameter: int, traces: Mapping[str, Trace]) -> ReproducedFigure:
    name = _PARAMETERS[parameter]
    truth = surrogate.TRUTH[name]
    unit = unit_of(name, "linear")
    panels: list[tuple[Curve, ...]] = []
    for pair in _PAIRS:
        whole = [_joined(traces[key], parameter) for key in pair]
        ends = whole[0][0][[0, -1]]
        roles: tuple[CurveRole, ...] = ("first", "second")
        panels.append(
            (
                *(
                    Curve(label=traces[key].case.label, role=role, x=time, y=values)
                    for key, role, (time, values) in zip(pair, roles, whole, strict=True)
                ),
                Curve(label="truth", role="truth", x=ends, y=np.full(2, truth)),
            )
        )
    settled = [
        curve.y[np.searchsorted(curve.x, _SETTLING) :]
        for curves in panels
        for curve in curves
        if curve.role != "truth"
    ]
    loop = traces["clean"].loop
    runs = traces["clean"].error.shape[0]
    return ReproducedFigure(
        number=f"6.{number}",
        title=f"{loop.capitalize()}: evolution of the estimate of {in_words(name)}",
        caption=(
            f"The estimate over {runs} consecutive runs of {surrogate.DURATION:g} s, each "
            "beginning with the estimates and P that the run before ended with. From above: "
            "without noise and with (dotted); with noise compensated by the true standard "
            "deviations and by half of them (dotted); the same with B and S. The noise is the same "
            "in all cases. "
            "The first seconds lie partly outside."
        ),
        columns=1,
        panels=tuple(
            Panel(
                title=title,
                x_label="time, run after run [s]",
                y_label=f"{parameter_label(name)} [{unit}]",
                y_range=_range(settled, truth),
                curves=curves,
            )
            for title, curves in zip(
                ("not compensated", "noise compensated", "noise compensated, with B and S"),
                panels,
                strict=True,
            )
        ),
    )


def _joined(
    trace: Trace, parameter: int
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """Return every tenth sample of all runs, one after the other."""
    time = trace.time[::_STRIDE]
    runs = trace.values.shape[0]
    values = trace.values[:, ::_STRIDE, parameter]
    starts = np.arange(runs)[:, None] * trace.time[-1]
    return (starts + time).ravel(), values.ravel()


def _range(settled: Sequence[Float[np.ndarray, "..."]], truth: float) -> tuple[float, float]:
    low = min(truth, *(float(np.min(each)) for each in settled))
    high = max(truth, *(float(np.max(each)) for each in settled))
    margin = _MARGIN * (high - low)
    return low - margin, high + margin


def _larger_errors(number: int, loop: Loop, traces: Mapping[str, Trace]) -> str:
    """Return a remark if compensating the noise makes the feedback's prediction error larger.

    ``number`` is that of the figure, after the dot, that shows the error without compensation.
    """
    noisy, full = (itse(traces[key].time, traces[key].error) for key in ("noisy", "full"))
    if loop == "feedforward" or not np.sum(full) > np.sum(noisy):
        return ""
    return (
        " With the true standard deviations it is, over all runs, larger than without compensation "
        f"(Figure 6.{number}): there the regressors grow with the noise while the arm is slow, and "
        "so follow a part of the drift of the input energy (Eq. 5.5); compensated ones do not."
    )


def _size(trace: Trace) -> float:
    """Return what the vertical range holds: all of a noise-free error, nearly all of another."""
    error = np.abs(trace.error)
    return float(np.max(error) if trace.case.noise == 0.0 else np.percentile(error, _SHOWN))


def _errors(
    number: int, traces: Sequence[Trace], reference: float, remark: str
) -> ReproducedFigure:
    left, right = traces
    sizes = [_size(trace) for trace in traces]
    if max(sizes) <= _ALIKE * min(sizes):
        sizes = [max(sizes)] * len(sizes)
    relative = [itse(trace.time, trace.error) / reference for trace in traces]
    runs = left.error.shape[0]
    return ReproducedFigure(
        number=f"6.{number}",
        title=f"{left.loop.capitalize()}: prediction error e_y",
        caption=(
            f"Left column: {left.case.label}; right column: {right.case.label}. From above, the "
            f"{runs} consecutive runs; the source does not say how it arranges them. Above each "
            "stands its integral of time-multiplied squared error (Eq. 6.3), over that of the "
            f"first run without noise in the same loop.{remark} Every tenth sample is drawn; with "
            "noise, single ones may lie outside. Columns of very different size have scales of "
            "their own."
        ),
        columns=2,
        panels=tuple(
            Panel(
                title=(f"{trace.case.label}: run {run + 1}, ITSE {_short(relative[column][run])}"),
                x_label="time [s]",
                y_label="e_y [J]",
                y_range=(-sizes[column] * (1 + _MARGIN), sizes[column] * (1 + _MARGIN)),
                curves=(
                    Curve(
                        label=trace.case.label,
                        role=role,
                        x=trace.time[::_STRIDE],
                        y=trace.error[run, ::_STRIDE],
                    ),
                ),
            )
            for run in range(runs)
            for column, (trace, role) in enumerate(zip(traces, ("first", "second"), strict=True))
        ),
    )


def _short(value: float) -> str:
    """Return a positive number with three digits, and without an exponent where it is large."""
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"
