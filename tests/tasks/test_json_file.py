"""Results as JSON: what any reader of JSON reads back, a list of numbers in a line."""

import json
import math
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from stickslip.tasks import json_text, write_json

NUMBERS = st.none() | st.booleans() | st.integers() | st.floats() | st.text()
DOCUMENTS = st.dictionaries(
    st.text(),
    st.recursive(
        NUMBERS,
        lambda inner: st.lists(inner) | st.tuples(inner, inner) | st.dictionaries(st.text(), inner),
    ),
)


def plain(value: object) -> object:
    """Return what JSON can hold of a value."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    return [plain(each) for each in value] if isinstance(value, list | tuple) else value


@given(DOCUMENTS)
def test_what_is_written_is_read_back(document: dict[str, object]) -> None:
    text = json_text(document)
    assert text.endswith("\n")
    assert json.loads(text, parse_constant=lambda name: f"{name} is no JSON") == plain(document)


def test_series_take_a_line_each(tmp_path: Path) -> None:
    series = [0.1 * k for k in range(1000)]
    document = {"runs": [{"time": series, "error": series}], "levels": [[1.0, 2.0], []], "no": {}}
    text = json_text(document)
    assert len(text.splitlines()) == 13
    assert f'      "time": {json.dumps(series)},\n' in text
    # Nothing but a comma and a space beside each number
    assert len(text) < 2 * sum(len(repr(each)) + 2 for each in series) + 200
    assert write_json(document, tmp_path / "a.json").read_text() == text
