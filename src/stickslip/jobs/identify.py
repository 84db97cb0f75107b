"""From a log to identified friction parameters: reading, fitting and examining in one call."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from stickslip.logs import LogSchema, read_log, read_schema
from stickslip.records import AxisKind, AxisLog, Identification, InputError

__all__ = ["Columns", "identify", "read_with_columns"]


@dataclass(frozen=True, kw_only=True)
class Columns:
    """What single columns of a log are, said in place of a schema or on top of one.

    Attributes
    ----------
    kind
        ``"linear"`` or ``"rotary"``.
    time, position, velocity, effort, load_position, load_velocity
        A column's name, or a linear expression over columns such as ``"35.15 * vir"``.
    sampling_time
        Sampling time [s] of a log without time stamps.
    units
        By channel, the unit that its column or expression comes out in.

    Examples
    --------
    >>> Columns(effort="0.5 * current", units={"position": "mm"}).effort
    '0.5 * current'
    """

    kind: AxisKind | None = None
    time: str | None = None
    position: str | None = None
    velocity: str | None = None
    effort: str | None = None
    load_position: str | None = None
    load_velocity: str | None = None
    sampling_time: float | None = None
    units: Mapping[str, str] = field(default_factory=dict[str, str])

    def applied_to(self, schema: LogSchema, axis: str | int | None) -> LogSchema:
        """Return the schema of one axis with these columns in place of its own.

        Raises
        ------
        InputError
            If the schema has no such axis.
        """
        own = schema.for_axis(axis)
        clocked = self.time is not None or self.sampling_time is not None
        return LogSchema(
            kind=self.kind or own.kind,
            name=own.name,
            time=self.time if clocked else own.time,
            sampling_time=self.sampling_time if clocked else own.sampling_time,
            sampling_frequency=None if clocked else own.sampling_frequency,
            position=self.position or own.position,
            velocity=self.velocity or own.velocity,
            effort=self.effort or own.effort,
            load_position=self.load_position or own.load_position,
            load_velocity=self.load_velocity or own.load_velocity,
            units={**own.units, **self.units},
            files=schema.files,
        )


def read_with_columns(
    path: Path | str,
    *,
    schema: Path | str | None = None,
    axis: str | int | None = None,
    columns: Columns | None = None,
) -> AxisLog:
    """Read one axis of a log, with what is said of single columns on top of a schema.

    Parameters
    ----------
    path
        The log: a file, or a folder with a schema that names its files.
    schema
        Path of a TOML schema; without one obvious columns are found.
    axis
        Which axis, if the schema has several.
    columns
        What single columns are.

    Raises
    ------
    InputError
        If the log cannot be read or makes no sense; file, row and column are named.
    """
    if columns is None or columns == Columns():
        return read_log(path, schema, axis)
    stated = LogSchema() if schema is None else read_schema(schema)
    return read_log(path, columns.applied_to(stated, axis))


def identify(
    log: AxisLog | Path | str,
    *,
    schema: Path | str | None = None,
    axis: str | int | None = None,
    columns: Columns | None = None,
    estimator: Literal["energy", "idim-ls"] = "energy",
    inertia: float | None = None,
    load_inertia: float | None = None,
    stiffness: float | None = None,
    per_direction: bool = False,
    offset: bool | None = None,
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
    schema, axis, columns
        How to read it, if it is a path.
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
    cutoff
        Of the low-pass that smooths what is noisy [Hz]; None takes a tenth of the sampling rate and
        at most 100 Hz.
    variant
        Of the energy estimator: ``"held_effort"`` is exact while the effort is held over each
        sample; ``"report"`` takes the sums and the recursion as printed.
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
        log = read_with_columns(log, schema=schema, axis=axis, columns=columns)
    from stickslip.estimation import EnergyEstimator, IdimLeastSquares, examine

    unused: dict[str, object] = {}
    if estimator != "energy":
        unused = {
            "load inertia": load_inertia,
            "stiffness": stiffness,
            "variant": None if variant == "held_effort" else variant,
        }
    if estimator != "energy" or variant != "report":
        unused |= {"forgetting factor": forgetting_factor, "initial variance": initial_variance}
    _refuse(unused, "idim-ls" if estimator != "energy" else "this variant of energy")
    if estimator == "energy":
        chosen = EnergyEstimator(
            inertia=inertia,
            load_inertia=load_inertia,
            stiffness=stiffness,
            per_direction=per_direction,
            offset=offset,
            cutoff=cutoff,
            variant=variant,
            forgetting_factor=1.0 if forgetting_factor is None else forgetting_factor,
            initial_variance=initial_variance,
        )
        return examine(log, chosen, truth=truth)
    rigid = IdimLeastSquares(
        inertia=inertia, per_direction=per_direction, offset=offset, cutoff=cutoff
    )
    return examine(log, rigid, truth=truth)


def _refuse(unused: Mapping[str, object], method: str) -> None:
    """Refuse settings that were given and would have no effect."""
    for what, value in unused.items():
        if value is not None:
            needed = "energy estimator" if "idim" in method else "variant 'report'"
            raise InputError(
                f"{what} {value} is given, and {method} has no use for it",
                remedy=f"leave it out, or use the {needed}",
            )
