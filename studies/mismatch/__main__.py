"""``python -m studies.mismatch``: run the study, or draw one of its logs."""

import argparse
import shlex
import sys
from pathlib import Path

from rich.console import Console

from studies.mismatch.cases import CASES, record
from studies.mismatch.study import Study, run_study, save


def main() -> int:
    """Run the command line; return the exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m studies.mismatch",
        description="Measure how often identify() reports ok and is wrong.",
    )
    parser.add_argument("--cases", nargs="+", choices=tuple(CASES), metavar="CASE")
    parser.add_argument("--group", choices=("ideal", "noise", "in_class", "unmodelled"))
    parser.add_argument("--list", action="store_true", help="list the cases")
    parser.add_argument("--runs", type=int, default=100, help="recordings a case (default 100)")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="folder, or file with --show")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--estimator", help="passed to identify")
    parser.add_argument("--show", choices=tuple(CASES), metavar="CASE", help="draw one log")
    parser.add_argument("--seed", type=int, default=0, help="of the log drawn")
    given = parser.parse_args()
    console = Console()
    if given.list:
        for case in CASES.values():
            console.print(f"{case.name:25} {case.group:11} {case.description}", highlight=False)
        return 0
    if given.show:
        from studies.mismatch.show import draw

        file = given.out or Path(f"{given.show}-{given.seed}.png")
        draw(record(given.show, given.seed), file)
        console.print(f"wrote {file}")
        return 0
    names = given.cases or [
        name for name, case in CASES.items() if given.group in (None, case.group)
    ]
    study = Study(
        cases=tuple(names),
        runs=given.runs,
        first_seed=given.first_seed,
        processes=given.processes,
        options={} if given.estimator is None else {"estimator": given.estimator},
    )
    folder = given.out or Path("mismatch-results")
    runs, complete = run_study(study)
    if not runs:
        return 130
    command = "python -m studies.mismatch " + shlex.join(sys.argv[1:])
    results, table = save(folder, study, runs, complete=complete, command=command)
    console.print(table.read_text(), markup=False, highlight=False, soft_wrap=True)
    console.print(f"wrote {results} and {table}")
    return 0 if complete else 130


if __name__ == "__main__":
    sys.exit(main())
