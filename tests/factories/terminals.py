"""Output on a terminal of some width."""

import io
from collections.abc import Callable
from typing import Any

from rich.console import Console


def printed_on(width: int, show: Callable[[Console, Any], None], found: Any) -> str:
    file = io.StringIO()
    show(Console(file=file, width=width, markup=False, highlight=False), found)
    return file.getvalue()
