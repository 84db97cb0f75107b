"""Sphinx configuration; also writes the tables read from the code, and reports to look at."""

from pathlib import Path

from stickslip import __version__, write_positioning_page
from stickslip.estimation import ESTIMATORS
from stickslip.jobs import demonstrate, position
from stickslip.records import PARAMETER_NAMES, QUANTITIES, Ending, Status

project = "stickslip"
author = "the stickslip developers"
project_copyright = "2026, the stickslip developers"
release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx-mathjax-offline",
    "sphinx_copybutton",
]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "_generated", "evidence/mismatch-table.md"]
html_extra_path = ["_generated/pages"]
html_theme = "furo"
html_title = "stickslip"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_preprocess_types = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"
default_role = "code"


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in (head, tuple("---" for _ in head), *rows)]
    return "\n".join(lines) + "\n"


def _write_tables() -> None:
    folder = Path(__file__).parent / "_generated"
    folder.mkdir(exist_ok=True)
    quantities = [
        (q.name, f"${q.symbol}$", q.linear, q.rotary)
        for key, q in QUANTITIES.items()
        if key != "inertia"
    ]
    (folder / "quantities.md").write_text(
        _table(("quantity", "symbol", "linear axis", "rotary axis"), quantities)
    )
    (folder / "estimators.md").write_text(
        _table(
            ("name", "method", "axis", "friction", "mass or inertia", "intervals", "online"),
            [
                (
                    f"`{entry.name}`",
                    entry.summary,
                    "rigid" if entry.rigid_only else "rigid, flexible",
                    "equal" if entry.symmetric_only else "equal, per direction",
                    "must be known" if entry.needs_inertia else "estimated or known",
                    "yes" if entry.gives_intervals else "no",
                    "yes" if entry.online else "no",
                )
                for entry in ESTIMATORS.values()
            ],
        )
    )
    (folder / "statuses.md").write_text(
        _table(
            ("status", "exit code", "meaning and remedy"),
            [(f"`{s.value}`", "0" if s.trusted else "1", s.text) for s in Status],
        )
    )
    (folder / "endings.md").write_text(
        _table(
            ("ending", "exit code", "meaning and remedy"),
            [(f"`{e.value}`", "0" if e.reached else "1", e.text) for e in Ending],
        )
    )
    (folder / "parameters.md").write_text("\n".join(f"- `{n}`" for n in PARAMETER_NAMES) + "\n")


def _write_demonstration() -> None:
    docs = Path(__file__).parent
    folder = docs / "_generated" / "pages" / "demo"
    demonstrate(folder)
    for scenario, page in (("gravity", "positioning"), ("arm", "arm")):
        task = position(docs.parent / "examples" / "scenarios" / f"{scenario}.toml")
        write_positioning_page(task, folder / f"{page}.html")


_write_tables()
_write_demonstration()
