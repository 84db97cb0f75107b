"""Make docs/theory/limits.md, how near estimators come to the bound of a log.

    python -m studies.documentation.limits [--runs N]

400 runs of every case take about twenty minutes on two processors. Each case is what ``stickslip
compare`` prints of one scenario in examples/comparisons.
"""

import argparse
from dataclasses import dataclass, replace

from rich.progress import Progress

from stickslip import EstimationTask
from stickslip.records import EstimatorScore, EstimatorStudy, ParameterScore
from stickslip.scenario import StudyFile, read_study
from stickslip.tasks import compare_scenario
from studies.documentation.style import DOCS
from studies.markdown import table, with_table

RUNS = 400
SCENARIOS = DOCS.parent / "examples" / "comparisons"


@dataclass(frozen=True, kw_only=True)
class Case:
    """One scenario, what is known of its axis, and who is compared."""

    title: str
    file: str
    only: tuple[str, ...]
    task: EstimationTask = EstimationTask()
    delay: int = 0

    def scenario(self) -> StudyFile:
        """Return the scenario, with the delay of this case."""
        read = read_study(SCENARIOS / self.file)
        asked = read.scenario
        late = asked.input.model_copy(update={"effort_delay": self.delay})
        return replace(read, scenario=replace(asked, input=late))


CASES = (
    Case(
        title="velocity measured, white noise",
        file="velocity_noise.toml",
        only=("maximum-likelihood", "energy", "idim-iv"),
    ),
    Case(
        title="the same, mass known",
        file="velocity_noise.toml",
        task=EstimationTask(inertia=1.5),
        only=("maximum-likelihood", "ekf", "energy", "rls"),
    ),
    Case(
        title="encoder only",
        file="encoder_only.toml",
        only=("maximum-likelihood", "energy", "idim-ls", "rls"),
    ),
    Case(
        title="slow disturbance force",
        file="disturbance.toml",
        only=("energy", "idim-ls", "ekf", "maximum-likelihood"),
    ),
    *(
        Case(
            title=f"effort delayed by {delay}",
            file="velocity_noise.toml",
            task=EstimationTask(largest_delay=4),
            only=("maximum-likelihood", "energy"),
            delay=samples,
        )
        for samples, delay in ((1, "one sample"), (2, "two samples"))
    ),
)


def _trusted(score: EstimatorScore) -> str:
    found = score.delay_found
    delay = "" if found is None else f"; delay correct in {100 * found:.4g} %"
    return f"{100 * score.trusted:.4g} %{delay}"


def _cells(score: ParameterScore) -> list[str]:
    percent = 100.0 / abs(score.truth)
    return [
        score.name.replace("_", " "),
        f"{percent * score.bias:+.2g}",
        f"{percent * score.rmse:.2g}",
        "–" if score.bound_ratio is None else f"{score.bound_ratio:.2f}",
        "none" if score.coverage is None else f"{100 * score.coverage:.1f}",
    ]


def rows(title: str, study: EstimatorStudy) -> list[list[str]]:
    """Return the rows of one case, without the cells that repeat."""
    made: list[list[str]] = []
    for score in study.applied:
        name = score.name + (" \\*" if score.assumes_inertia else "")
        for parameter in score.scores.values():
            first = parameter is next(iter(score.scores.values()))
            made.append(
                [
                    title if not made else "",
                    name if first else "",
                    *_cells(parameter),
                    _trusted(score) if first else "",
                ]
            )
    return made


def main(runs: int) -> None:
    """Run every case, and write the page."""
    head = ["case", "estimator", "parameter", "bias [%]", "RMSE [%]", "RMSE / bound"]
    head += ["coverage [%]", "status ok"]
    body: list[list[str]] = []
    with Progress() as shown:
        for case in CASES:
            task = shown.add_task(case.title, total=runs)
            study = compare_scenario(
                case.scenario(),
                runs=runs,
                task=case.task,
                only=case.only,
                progress=lambda done, _, task=task: shown.update(task, completed=done),
            )
            body += rows(case.title, study)
    made = (
        f"{runs} runs each (`python -m studies.documentation.limits`). Errors are in % of the "
        "truth.\n\n" + table(head, body)
    )
    page = DOCS / "theory" / "limits.md"
    page.write_text(with_table(page.read_text(encoding="utf-8"), "table", made), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=RUNS, help="of every case")
    main(parser.parse_args().runs)
