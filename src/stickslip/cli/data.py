"""``stickslip data``: public benchmark data on this machine."""

import sys
from typing import Annotated

from cyclopts import Parameter

from stickslip.cli.terminal import reader_may_leave, working

__all__ = ["data"]


def data(name: Annotated[str, Parameter(help='The data set: "emps".')], /) -> int:
    """Find a public benchmark on this machine, or fetch it, and print its folder.

    Looked for in the folder that the environment variable STICKSLIP_DATA names, then in the user's
    cache; fetched to the cache otherwise, and checked.
    """
    from stickslip import find_benchmark

    with working(f"looking for {name}"):
        folder = find_benchmark(name)
    with reader_may_leave():
        sys.stdout.write(f"{folder}\n")
    return 0
