"""Expected errors of a test: code and quantities."""

from collections.abc import Iterable
from typing import Any

import pytest

from stickslip.errors import InputError, StickslipError


def refuses(
    code: str,
    error: type[StickslipError] = InputError,
    *,
    where: str | None = None,
    of: Iterable[str] | None = None,
    **quantities: Any,
) -> "pytest.RaisesExc[StickslipError]":
    """Expect an error of this code, place (if given) and quantities, which can be shown.

    A setting that it names is one of ``of``, if given.
    """

    def is_expected(caught: StickslipError) -> bool:
        assert caught.code == code, f"{caught.code}, {caught}"
        assert where is None or caught.where == where, caught.where
        assert of is None or caught.quantities.get("name") in {None, *of}, str(caught)
        assert str(caught).endswith(f"{caught.what}; {caught.remedy}")
        held = {name: caught.quantities[name] for name in quantities}
        assert held == quantities, f"{held}, {caught}"
        return True

    return pytest.raises(error, check=is_expected)
