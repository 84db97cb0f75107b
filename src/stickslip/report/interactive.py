"""What pages need whose figures a script draws: the drawings, their frames, and the scripts."""

import base64
import gzip
import html
import json
from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from stickslip.outputs import check_output, whole_file
from stickslip.report.drawing import Plot
from stickslip.report.sheet import template

__all__ = ["SCRIPT_POLICY", "ending_with", "figure", "packed_plotly", "write_page"]

SCRIPT_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'"
)
"""Content security policy: the browser itself refuses to fetch anything for such a page."""


def write_page(parts: Iterable[str], path: Path | str) -> Path:
    """Write the parts of a page, once it is known that they can be, and return where.

    Raises
    ------
    InputError
        If nothing can be written there.
    """
    target = Path(path)
    check_output(target, what="the report")
    with whole_file(target, what="the report") as stream:
        stream.writelines(parts)
    return target


def figure(plot: Plot, its_key: str) -> str:
    """Return the place of a drawing on the page, with its heading, key and caption."""
    caption = f"<figcaption>{html.escape(plot.caption)}</figcaption>" if plot.caption else ""
    heading = f"<h3>{plot.heading}</h3>" if plot.heading else ""
    return (
        f'<figure>{heading}{its_key}<div class="plot" id="{plot.anchor}" role="img" '
        f'aria-label="{html.escape(plot.alternative)}" style="height:{plot.height}px"></div>'
        f"{caption}</figure>\n"
    )


def ending_with(plots: Iterable[Plot]) -> Iterable[str]:
    """Yield the end of a page: its drawings, and the scripts that draw them."""
    yield (
        "<noscript><p>The figures are drawn by a script inside this file; allow scripts to see "
        "them. The tables need none.</p></noscript>\n"
    )
    yield f'<script type="text/plain" id="plots">{_drawings(plots)}</script>\n'
    yield f'<script type="text/plain" id="plotly">{packed_plotly()}</script>\n'
    yield f"<script>{template('page.js')}</script>\n</body>\n</html>\n"


def packed_plotly() -> str:
    """Return the basic bundle of plotly.js (scatter, bar and pie), as base64 of its gzip file.

    The browser unpacks it, as it does the drawings, which makes a page a third of the size.
    """
    packed = files("stickslip.report").joinpath("plotly", "plotly-basic.min.js.gz").read_bytes()
    return base64.b64encode(packed).decode()


def _drawings(plots: Iterable[Plot]) -> str:
    """Return the drawings as JSON, as base64 of its gzip file."""
    data: Mapping[str, Any] = {
        plot.anchor: {"data": plot.traces, "layout": plot.layout} for plot in plots
    }
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()
