"""``stickslip excite``: the most informative effort within the limits of an axis."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Group, Parameter

from stickslip.cli.arguments import whole_number
from stickslip.cli.outputs import JsonFile
from stickslip.cli.terminal import working

EXAMPLES = """Examples:
  stickslip excite --mass 95 --coulomb-friction 20 --viscous-friction 200 --effort-limit 120 --travel-limit 0.1 --duration 10 --sampling-time 0.001 --encoder-step 1e-6 --out input.csv
  stickslip excite --estimate stage.json --effort-limit 10 --speed-limit 0.3 --travel-limit 0.2 --duration 5 --sampling-time 0.002 --position-noise 1e-5 --out input.csv"""  # noqa: E501 - a command is one line

_axis = partial(Parameter, group=Group("Known of the axis", sort_key=1))
_limits = partial(Parameter, group=Group("Limits", sort_key=2))
_sensors = partial(Parameter, group=Group("Sensors", sort_key=3))
_output = partial(Parameter, group=Group("Effort", sort_key=4))


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class GuessedAxis:
    """Approximate parameters of an axis."""

    inertia: Annotated[
        float | None,
        _axis(
            name=("--inertia", "--mass"),
            help="Moving inertia in kg m² or mass in kg; of a flexible arm the driven side.",
        ),
    ] = None
    coulomb_friction: Annotated[
        float | None, _axis(help="In N or N m; a rough value is enough.")
    ] = None
    viscous_friction: Annotated[
        float | None, _axis(help="In N s/m or N m s/rad; a rough value is enough.")
    ] = None
    static_friction: Annotated[
        float | None,
        _axis(help="In N or N m. [default: Coulomb friction]"),
    ] = None
    offset: Annotated[
        float | None,
        _axis(help="Constant part of the effort, such as gravity, in N or N m. [default: 0]"),
    ] = None
    load_inertia: Annotated[
        float | None,
        _axis(
            name=("--load-inertia", "--load-mass"),
            help="Inertia in kg m² or mass in kg of a flexible arm's load side. [default: a rigid "
            "axis]",
        ),
    ] = None
    stiffness: Annotated[
        float | None,
        _axis(help="Of a flexible arm's spring, in N/m or N m/rad."),
    ] = None


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class WantedEffort:
    """Limits of an axis, its sensors, and the samples of an effort."""

    effort_limit: Annotated[float, _limits(help="Largest effort, in N or N m.")]
    speed_limit: Annotated[
        float | None, _limits(help="Largest speed, in m/s or rad/s. [default: no limit]")
    ] = None
    travel_limit: Annotated[
        float | None,
        _limits(help="Largest distance from the start, in m or rad. [default: no limit]"),
    ] = None
    position_noise: Annotated[
        float, _sensors(help="Standard deviation of the positions, in m or rad.")
    ] = 0.0
    encoder_step: Annotated[float, _sensors(help="Step of the encoder, in m or rad.")] = 0.0
    velocity_noise: Annotated[
        float | None,
        _sensors(
            help="Standard deviation of measured velocities, in m/s or rad/s. [default: not "
            "measured]",
        ),
    ] = None
    duration: Annotated[float, _output(help="In s.")]
    sampling_time: Annotated[float, _output(help="In s; the effort is held over each sample.")]
    seed: Annotated[
        int,
        _output(
            converter=whole_number,
            help="Seed of the inputs that the search starts from.",
        ),
    ] = 1


def excite(
    *,
    estimate: Annotated[
        Path | None,
        _axis(help="File that stickslip identify --json wrote; other options override its values."),
    ] = None,
    kind: Annotated[
        Literal["linear", "rotary"] | None,
        _axis(help="Kind of axis. [default: that of the estimate, or linear]"),
    ] = None,
    guess: GuessedAxis | None = None,
    wanted: WantedEffort,
    out: Annotated[Path, _output(help="CSV file for the drive: time and effort.")],
    files: JsonFile | None = None,
) -> int:
    """Design an effort that determines the parameters of an axis as well as its limits allow.

    The Fisher information about mass, friction and offset is made as large as limits of effort,
    speed and travel allow (D-optimal), for an axis with the given parameters that starts at
    rest. Prints the smallest intervals to expect. The axis must be free to move by the travel limit
    in both directions, and a little more, as its parameters are not exact.
    """
    files = files or JsonFile()
    files.check(inputs=[] if estimate is None else [estimate], out=out)
    with working("designing the effort"):
        from stickslip.tasks import excite, write_effort

        believed = {
            name: value for name, value in vars(guess or GuessedAxis()).items() if value is not None
        }
        designed = excite(believed, kind=kind, estimate=estimate, **vars(wanted))
        write_effort(designed.effort, designed.sampling_time, out, kind=designed.kind)
        files.write(designed)
    from stickslip.presentation.terminal import print_excitation

    files.print(designed, print_excitation, effort=out)
    return 1 if designed.undetermined else 0
