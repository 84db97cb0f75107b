"""``stickslip inspect``: what a log holds, how it would be read, and whether it suffices."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from stickslip.cli.arguments import LogReading, RobotJoints
from stickslip.cli.outputs import JsonFile, output
from stickslip.cli.terminal import working

EXAMPLES = """Examples:
  stickslip inspect robot.csv
  stickslip inspect robot.csv --kind rotary --schema-out robot.toml
  stickslip inspect stage.csv --check
  stickslip inspect robot.mcap --check --urdf robot.urdf"""

_LIMIT = 0.05  # half-width of an interval over the value that `--check` takes for enough [-]


def inspect(
    log: Annotated[Path, Parameter(help="The log, as stickslip identify takes it.")],
    /,
    *,
    reading: LogReading | None = None,
    robot: RobotJoints | None = None,
    check: Annotated[
        bool,
        Parameter(
            negative="",
            help="Predict whether mass, viscous, Coulomb and static friction can be identified to "
            "5 %, and what to record otherwise.",
        ),
    ] = False,
    schema_out: Annotated[
        Path | None, output(help="Write the schema by which the log would be read (TOML).")
    ] = None,
    files: JsonFile | None = None,
) -> int:
    """Show what a log holds and how it would be read.

    Prints columns, units, ranges, rates, gaps and clipping, the proposed axes with the reason for
    each column, the lag between effort and motion, and what is missing.
    Exit code 1: an axis cannot be read or, with --check, a parameter cannot be identified to 5 %.
    """
    reading, robot = reading or LogReading(), robot or RobotJoints()
    files = files or JsonFile()
    files.check(inputs=[*reading.inputs(log), *robot.inputs], schema_out=schema_out)
    reading.units()  # refused before anything is loaded
    with working(f"inspecting {log.name}"):
        from stickslip import LogSchema, read_schema
        from stickslip.tasks import inspect, write_schema

        schema = LogSchema() if reading.schema is None else read_schema(reading.schema)
        columns = reading.columns()
        found = inspect(
            log,
            schema=schema,
            axis=reading.axis,
            columns=columns,
            urdf=robot.urdf,
            joints=robot.joint or (),
            limit=_LIMIT if check else None,
        )
        if schema_out is not None:
            write_schema(log, schema_out, schema.overridden(None, columns))
        files.write(found)
    from stickslip.presentation.terminal import print_inspection

    files.print(found, print_inspection, schema_out=schema_out)
    return 0 if found.trusted else 1
