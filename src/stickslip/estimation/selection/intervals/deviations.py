"""Deviations of the parameters by errors beyond sampling, in fits of one log or several."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from stickslip.estimation.selection.intervals.widening import (
    between_windows,
    of_other_terms,
    of_unknown_asymmetry,
)
from stickslip.estimation.selection.model import Model
from stickslip.estimation.selection.model_rows import ModelRows
from stickslip.estimation.selection.terms import Term
from stickslip.estimation.selection.tuning import SelectionTuning
from stickslip.records import FrictionEstimate


def deviations(
    model: Model,
    rows: ModelRows,
    estimate: FrictionEstimate,
    terms: Sequence[Term],
    rows_of: Callable[[Model], ModelRows],
    unknown_delay: Float[np.ndarray, " p"] | None,
    tuning: SelectionTuning,
) -> list[Float[np.ndarray, " p"]]:
    """Return deviations of the parameters by windows, terms, delay and asymmetry [SI].

    ``terms`` are those that were tried, ``rows_of`` returns the rows of a model.
    ``unknown_delay`` is the change by a delay that the log does not determine.
    """
    every = (
        between_windows(model, rows, estimate, rows_of, tuning.intervals),
        of_other_terms(model, rows, terms, tuning.search.largest_p_value, tuning.intervals),
        unknown_delay,
        of_unknown_asymmetry(model, rows, terms, tuning.intervals),
    )
    return [shift for shift in every if shift is not None]
