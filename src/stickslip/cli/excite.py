"""``stickslip excite``: the most informative effort within the limits of an axis."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from stickslip.cli.arguments import group, whole_number
from stickslip.cli.outputs import JsonFile
from stickslip.cli.terminal import working

EXAMPLES = """Examples:
  stickslip excite --mass 95 --coulomb-friction 20 --viscous-friction 200 --effort-limit 120 --travel-limit 0.1 --duration 10 --sampling-time 0.001 --encoder-step 1e-6 --out input.csv
  stickslip excite --estimate stage.json --effort-limit 10 --speed-limit 0.3 --travel-limit 0.2 --duration 5 --sampling-time 0.002 --position-noise 1e-5 --out input.csv"""  # noqa: E501 - a command is one line

_SENSORS, _EFFORT = group("Sensors", 3), group("Effort", 4)


@Parameter(name="*", group=group("Known of the axis", 1))
@dataclass(frozen=True, kw_only=True)
class GuessedAxis:
    """Approximate parameters of an axis."""

    estimate: Path | None = None
    """File that stickslip identify --json wrote; other options override its values."""
    kind: Literal["linear", "rotary"] | None = None
    """Kind of axis. [default: that of the estimate, or linear]"""
    inertia: Annotated[float | None, Parameter(name=("--inertia", "--mass"))] = None
    """Moving inertia in kg m² or mass in kg; of a flexible arm the driven side."""
    coulomb_friction: float | None = None
    """In N or N m; a rough value is enough."""
    viscous_friction: float | None = None
    """In N s/m or N m s/rad; a rough value is enough."""
    static_friction: float | None = None
    """In N or N m. [default: Coulomb friction]"""
    offset: float | None = None
    """Constant part of the effort, such as gravity, in N or N m. [default: 0]"""
    load_inertia: Annotated[float | None, Parameter(name=("--load-inertia", "--load-mass"))] = None
    """Inertia in kg m² or mass in kg of a flexible arm's load side. [default: a rigid axis]"""
    stiffness: float | None = None
    """Of a flexible arm's spring, in N/m or N m/rad."""


@Parameter(name="*", group=group("Limits", 2))
@dataclass(frozen=True, kw_only=True)
class WantedEffort:
    """Limits of an axis, its sensors, and the samples of an effort."""

    effort_limit: float
    """Largest effort, in N or N m."""
    speed_limit: float | None = None
    """Largest speed, in m/s or rad/s. [default: no limit]"""
    travel_limit: float | None = None
    """Largest distance from the start, in m or rad. [default: no limit]"""
    position_noise: Annotated[float, Parameter(group=_SENSORS, show_default=False)] = 0.0
    """Standard deviation of the positions, in m or rad. [required without --encoder-step]"""
    encoder_step: Annotated[float, Parameter(group=_SENSORS, show_default=False)] = 0.0
    """Step of the encoder, in m or rad. [required without --position-noise]"""
    velocity_noise: Annotated[float | None, Parameter(group=_SENSORS)] = None
    """Standard deviation of measured velocities, in m/s or rad/s. [default: not measured]"""
    duration: Annotated[float, Parameter(group=_EFFORT)]
    """In s."""
    sampling_time: Annotated[float, Parameter(group=_EFFORT)]
    """In s; the effort is held over each sample."""
    seed: Annotated[int, Parameter(group=_EFFORT, converter=whole_number)] = 1
    """Seed of the inputs that the search starts from."""


def excite(
    *,
    guess: GuessedAxis | None = None,
    wanted: WantedEffort,
    out: Annotated[Path, Parameter(group=_EFFORT, help="CSV file for the drive: time and effort.")],
    files: JsonFile | None = None,
) -> int:
    """Design an effort that determines the parameters of an axis as well as its limits allow.

    The Fisher information about mass, friction and offset is made as large as limits of effort,
    speed and travel allow (D-optimal), for an axis with the given parameters that starts at
    rest. Prints the smallest intervals to expect. The axis must be free to move by the travel limit
    in both directions, and a little more, as its parameters are not exact.
    """
    from stickslip.input_files import check_exists

    files = files or JsonFile()
    given = {
        name: value for name, value in vars(guess or GuessedAxis()).items() if value is not None
    }
    estimate, kind = given.pop("estimate", None), given.pop("kind", None)
    if estimate is not None:
        check_exists(estimate, "file")  # before what takes long to load
    files.check(inputs=[] if estimate is None else [estimate], out=out)
    with working("designing the effort"):
        from stickslip.tasks import excite, write_effort

        designed = excite(given, kind=kind, estimate=estimate, **vars(wanted))
        write_effort(designed.effort, designed.sampling_time, out, kind=designed.kind)
        files.write(designed)
    from stickslip.presentation.terminal import print_excitation

    files.print(designed, print_excitation, effort=out)
    return 1 if designed.undetermined else 0
