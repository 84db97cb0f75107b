"""The errors a user can meet. Each message says what, where and how to mend it."""

__all__ = ["EventBudgetError", "InputError", "MissingExtraError", "StickslipError"]


class StickslipError(Exception):
    """Root of every error this package raises on purpose."""


class InputError(StickslipError, ValueError):
    """Something handed in cannot be used.

    Parameters
    ----------
    what
        The quantity or thing at fault, with its value, unit and limit.
    where
        File, row, column or key where it was found; empty when there is no such place.
    remedy
        What to do about it, as an instruction.

    Examples
    --------
    >>> str(InputError("mass is -1 kg, it must be positive", remedy="give the moving mass"))
    'mass is -1 kg, it must be positive; give the moving mass'
    """

    def __init__(self, what: str, *, where: str = "", remedy: str) -> None:
        self.what = what
        self.where = where
        self.remedy = remedy
        place = f"{where}: " if where else ""
        super().__init__(f"{place}{what}; {remedy}")

    def at(self, where: str) -> "InputError":
        """Return the same error placed at ``where``: a reader knows the file, a record does not."""
        place = f"{where}, {self.where}" if self.where else where
        return InputError(self.what, where=place, remedy=self.remedy)


class MissingExtraError(StickslipError, ImportError):
    """An optional dependency is needed and not installed."""

    def __init__(self, purpose: str, *, extra: str) -> None:
        self.extra = extra
        super().__init__(
            f"{purpose} needs an optional dependency; "
            f"install it with: pip install 'stickslip[{extra}]'"
        )


class EventBudgetError(StickslipError, RuntimeError):
    """More sticks and slips inside one sample than the simulator's budget allows."""
