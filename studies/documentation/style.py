"""The look that all figures of the documentation share, and its folders."""

import argparse
from pathlib import Path

import matplotlib as mpl

mpl.use("agg")

import matplotlib.pyplot as plt  # the backend is chosen first

DOCS = Path(__file__).parents[2] / "docs"
FIGURES = DOCS / "figures"
BLUE, ORANGE, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "#6b7280"


def no_arguments(description: str | None) -> None:
    """Refuse arguments of the command line; end with the description where help is asked for."""
    argparse.ArgumentParser(description=description).parse_args()


def style() -> None:
    """Set the look that all figures share."""
    plt.rcParams.update(
        {
            "font.size": 9,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.titlesize": 10,
            "axes.titlelocation": "left",
            "axes.titleweight": "bold",
            "axes.grid": True,
            "grid.color": "#e5e7eb",
            "grid.linewidth": 0.6,
            "legend.frameon": False,
            "figure.dpi": 150,
            "savefig.bbox": "tight",
        }
    )


def save(figure: plt.Figure, name: str) -> None:
    """Write one figure; no date inside, so that the same picture is the same file."""
    FIGURES.mkdir(exist_ok=True)
    figure.savefig(FIGURES / name, metadata={"Software": None})
    plt.close(figure)
