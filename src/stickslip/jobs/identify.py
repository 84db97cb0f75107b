"""From a log to identified friction parameters: reading, fitting and examining in one call."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from stickslip.jobs.reading import log_at
from stickslip.jobs.wanted import Wanted, check_known, energy_estimator, idim_estimator
from stickslip.logs import AxisSchema, LogSchema
from stickslip.records import AxisKind, AxisLog, Identification, InputError

__all__ = ["identify"]


def identify(
    log: AxisLog | Path | str,
    *,
    schema: Path | str | LogSchema | None = None,
    axis: str | int | None = None,
    columns: AxisSchema | None = None,
    estimator: Literal["energy", "idim-ls"] = "energy",
    inertia: float | None = None,
    load_inertia: float | None = None,
    stiffness: float | None = None,
    per_direction: bool = False,
    offset: bool | None = None,
    stribeck: bool = False,
    cutoff: float | None = None,
    variant: Literal["held_effort", "report"] = "held_effort",
    forgetting_factor: float | None = None,
    initial_variance: float | None = None,
    truth: Mapping[str, float] | None = None,
) -> Identification:
    """Identify the friction of an axis from a log.

    Parameters
    ----------
    log
        A log, or the path of one.
    schema, axis
        How to read it, if it is a path (see `stickslip.logs.read_log`).
    columns
        What single columns are, in place of what the schema says of them.
    estimator
        ``"energy"``: energy balance; ``"idim-ls"``: inverse dynamics by least squares.
    inertia
        Moving mass or inertia, of the first body of a flexible arm [kg or kg m^2]; None estimates
        it.
    load_inertia
        Mass or inertia of the second body of a flexible arm [kg or kg m^2]; None for a rigid axis.
    stiffness
        Of the spring between the two [N/m or N m/rad]; None for a rigid axis.
    per_direction
        Whether each direction gets its own Coulomb and viscous friction.
    offset
        Whether a constant offset is estimated; None does unless ``per_direction``.
    stribeck
        Whether static friction and Stribeck velocity are estimated too, by a law that falls from
        the one to Coulomb friction as motion sets in (Gaussian;
        `stickslip.estimation.StribeckEstimator` has the exponential one).
    cutoff
        Of the low-pass that smooths what is noisy [Hz]; None takes a tenth of the sampling rate and
        at most 100 Hz.
    variant
        Of the energy estimator: ``"held_effort"`` is exact while the effort is held over each
        sample; ``"report"`` takes the sums and the recursion as printed, for a known inertia,
        without an offset and alike in both directions (`stickslip.estimation.ReportEstimator` has
        its compensation of noise too).
    forgetting_factor
        Of the printed recursion, in (0, 1] [-]; None forgets nothing.
    initial_variance
        Diagonal of P(0) of the printed recursion [squared unit of the parameters over that of the
        energy]; None takes 1e3.
    truth
        True values by parameter name [SI], for a log that was simulated; they are shown beside the
        estimates and used for nothing else.

    Returns
    -------
    The estimate with everything its report shows.

    Raises
    ------
    InputError
        If the log cannot be read or used, a known value is impossible, or a setting has no use
        with the estimator chosen.

    Examples
    --------
    >>> import numpy as np
    >>> from stickslip.records import AxisLog
    >>> time = np.arange(0, 10, 0.001)
    >>> velocity = 0.1 * np.sin(2 * time) + 0.05 * np.sin(5 * time)
    >>> acceleration = 0.2 * np.cos(2 * time) + 0.25 * np.cos(5 * time)
    >>> position = -0.05 * np.cos(2 * time) - 0.01 * np.cos(5 * time)
    >>> effort = 3.0 * acceleration + 1.5 * np.sign(velocity) + 4.0 * velocity
    >>> log = AxisLog(name="stage", kind="linear", time=time, effort=effort,
    ...               measured_position=position)
    >>> found = identify(log)
    >>> found.estimate.status.value, round(found.estimate.value("coulomb_friction"), 1)
    ('ok', 1.5)
    """
    # The log is read first, as the estimators load libraries that take seconds: whoever mistyped a
    # file's name should not wait for them.
    if not isinstance(log, AxisLog):
        log = log_at(log, schema, axis, columns)
    wanted = Wanted(
        inertia=inertia,
        load_inertia=load_inertia,
        stiffness=stiffness,
        per_direction=per_direction,
        offset=offset,
    )
    check_known(wanted, log.kind)
    from stickslip.estimation import ReportEstimator, StribeckEstimator, examine

    of_the_report = {"forgetting factor": forgetting_factor, "initial variance": initial_variance}
    if estimator == "idim-ls":
        of_energy = {
            "load inertia": load_inertia,
            "stiffness": stiffness,
            "variant": None if variant == "held_effort" else variant,
        }
        _refuse(of_energy, "idim-ls", instead="use the energy estimator")
        _refuse(of_the_report, "idim-ls", instead="use the energy estimator with variant 'report'")
        rigid = idim_estimator(wanted, cutoff=cutoff)
        return examine(log, StribeckEstimator(method=rigid) if stribeck else rigid, truth=truth)
    if variant == "report":
        chosen = ReportEstimator(
            inertia=_known_to_the_report(wanted, log.kind, stribeck=stribeck),
            load_inertia=load_inertia,
            stiffness=stiffness,
            cutoff=cutoff,
            forgetting_factor=1.0 if forgetting_factor is None else forgetting_factor,
            initial_variance=1e3 if initial_variance is None else initial_variance,
        )
        return examine(log, chosen, truth=truth)
    _refuse(of_the_report, "this variant of energy", instead="use variant 'report'")
    chosen = energy_estimator(wanted, cutoff=cutoff)
    return examine(log, StribeckEstimator(method=chosen) if stribeck else chosen, truth=truth)


def _known_to_the_report(wanted: Wanted, kind: AxisKind, *, stribeck: bool) -> float:
    """Return the inertia that the report's variant needs; refuse what it does not estimate."""
    for what, asked in (
        ("friction per direction", wanted.per_direction),
        ("an offset", wanted.offset),
        ("a Stribeck effect", stribeck),
    ):
        if asked:
            raise InputError(
                f"{what} is asked for, and variant 'report' estimates Coulomb and viscous friction "
                "only",
                remedy="leave it out, or leave the variant at its default",
            )
    if wanted.inertia is None:
        body = "mass" if kind == "linear" else "inertia"
        raise InputError(
            f"variant 'report' takes the {body} as known, and none is given",
            remedy=f"give the {body}, or leave the variant at its default",
        )
    return wanted.inertia


def _refuse(unused: Mapping[str, object], method: str, *, instead: str) -> None:
    """Refuse settings that were given and would have no effect; say what would have use for them.

    A setting that is None was not given.
    """
    for what, value in unused.items():
        if value is not None:
            raise InputError(
                f"{what} {value} is given, and {method} has no use for it",
                remedy=f"leave it out, or {instead}",
            )
