"""Run the study: ``python -m studies.real_axes [NAME ...] [--data DIR] [--extra DIR] [--out DIR]``.

All 75 logs take some three minutes on one core; ``--contents`` takes one more, ``--plot`` another.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from stickslip.outputs import write_whole
from stickslip.tasks import write_json
from studies.real_axes.contents import Contents, contents_of
from studies.real_axes.logs import RealLog, load_extra_logs, load_logs
from studies.real_axes.study import Judgement, judge
from studies.real_axes.tables import page, results, summary

_STEPS = 4

app = App(name="python -m studies.real_axes", help="Judge identify on public logs of real axes.")


@app.default
def run(
    *names: str,
    data: Path | None = None,
    extra: Path | None = None,
    out: Path = Path("build/real_axes"),
    plot: bool = False,
    contents: bool = False,
    judged: Annotated[bool, Parameter(name="--judge")] = True,
    velocity: bool = True,
) -> None:
    """Identify every log and its halves, and write ``table.md`` and ``results.json``.

    Parameters
    ----------
    names
        Parts of names; only logs whose name contains one are read. All if none is given.
    data
        Folder of the public logs; ``$STICKSLIP_DATA`` or ``../shared/data`` by default.
    extra
        Folder of the extra logs.
    out
        Folder of the results.
    plot
        Draw each log as a PNG.
    contents
        Judge further terms of the effort law by cross-validation.
    judged
        Identify; without it only plots and contents are made.
    velocity
        Give identify the measured velocity, where the log has one.
    """
    console = Console()
    out.mkdir(parents=True, exist_ok=True)
    folder = data or Path(os.environ.get("STICKSLIP_DATA", "../shared/data"))
    try:
        logs = load_logs(folder)
    except FileNotFoundError as error:
        console.print(f"[red]{error}[/red]; name the folder of public logs with --data")
        sys.exit(2)
    missing: list[str] = []
    if extra is not None:
        more, missing = load_extra_logs(extra)
        logs += more
    chosen = [log for log in logs if not names or any(name in log.name for name in names)]
    if not velocity:
        chosen = [replace(log, log=replace(log.log, measured_velocity=None)) for log in chosen]
    judgements: list[Judgement] = []
    found: dict[str, Contents] = {}
    bar = (
        TextColumn("{task.description:40}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*bar, console=Console(stderr=True), transient=True) as progress:
        steps = (_STEPS if judged else 0) + plot + contents
        task = progress.add_task("", total=steps * len(chosen))
        if judged and chosen:
            progress.update(task, description="compiling")
            judge(chosen[0], lambda _: None)
        for log in chosen:

            def tick(what: str, log: RealLog = log) -> None:
                progress.update(task, description=f"{log.name}: {what}", advance=1)

            if judged:
                judgements.append(judge(log, tick))
            if plot:
                from studies.real_axes.plots import draw

                tick("plot")
                draw(log, out)
            if contents:
                tick("contents")
                made = contents_of(log.filtered())
                if made is not None:
                    found[log.name] = made
            if judged:
                # After each log, so that an interrupted study leaves what it had.
                write_json(results(judgements, found, missing), out / "results.json")
                write_whole(out / "table.md", page(judgements, found, missing).encode())
    if contents and not judged:
        from studies.real_axes.tables import contents_table

        write_whole(out / "contents.md", contents_table(found).encode())
    for line in summary(judgements) if judgements else ():
        console.print(line)
    console.print(f"written to {out}")


if __name__ == "__main__":
    app()
