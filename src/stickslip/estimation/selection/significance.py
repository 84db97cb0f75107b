"""Whether columns belong to a model: a robust test, and prediction of moves left out of the fit."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.special import fdtrc

from stickslip.estimation.fit.intervals import robust_uncertainty

_COSINES = (12, 6)  # of the two tests [-]: many and few
_COLLINEAR = 1e-6  # share of a column's norm below which it is a combination of the others [-]
_DEPENDENT = 0.015  # smallest over largest singular value [-], as for a term
_DEGENERATE = 1e-4  # smallest over largest singular value of further columns [-]: rounding errors


@dataclass(frozen=True, kw_only=True)
class Basis:
    """A model's columns in orthonormal coordinates, with the residual of the target."""

    vectors: Float[np.ndarray, "n p"]  #: Shape (n, p) [-].
    target: Float[np.ndarray, " n"]  #: Shape (n,) [any unit].
    residual: Float[np.ndarray, " n"]  #: Shape (n,), in the unit of the target.
    #: Number of the log that each row is from [-]; None for one log.
    log: Int[np.ndarray, " n"] | None = None

    @classmethod
    def of(
        cls,
        columns: Float[np.ndarray, "n p"],
        target: Float[np.ndarray, " n"],
        log: Int[np.ndarray, " n"] | None = None,
    ) -> "Basis":
        """Return the basis of columns of any scale."""
        norms = np.linalg.norm(columns, axis=0)
        vectors, _ = np.linalg.qr(columns / np.where(norms > 0, norms, 1.0))
        residual = target - vectors @ (vectors.T @ target)
        return cls(vectors=vectors, target=target, residual=residual, log=log)

    def share(self, partial: "Partial") -> float:
        """Return the share of the target that further columns explain, in rms [-]."""
        size = float(np.linalg.norm(partial.coordinates))
        return size / max(float(np.linalg.norm(self.target)), np.finfo(float).tiny)

    def partial(self, further: Float[np.ndarray, "n q"]) -> "Partial | None":
        """Return further columns less their projection on the basis; None if they depend on it."""
        rest = further - self.vectors @ (self.vectors.T @ further)
        norms, whole = np.linalg.norm(rest, axis=0), np.linalg.norm(further, axis=0)
        if np.any(norms <= _COLLINEAR * whole):
            return None
        left, singular, right = np.linalg.svd(rest / norms, full_matrices=False)
        if singular[-1] < _DEGENERATE * singular[0]:
            return None
        coordinates = left.T @ self.residual
        return Partial(
            vectors=left,
            coordinates=coordinates,
            values=(right.T @ (coordinates / singular)) / norms,
        )


@dataclass(frozen=True, kw_only=True)
class Partial:
    """Further columns beyond a basis."""

    vectors: Float[np.ndarray, "n q"]  #: In orthonormal coordinates, shape (n, q) [-].
    coordinates: Float[np.ndarray, " q"]  #: Of the residual along them, shape (q,) [any unit].
    values: Float[np.ndarray, " q"]  #: Coefficients of the columns, shape (q,) [SI].


def significance(
    basis: Basis, partial: Partial, further: Float[np.ndarray, "n q"] | None = None
) -> float:
    """Return the p-value of the hypothesis that coefficients are zero (robust F test) [-].

    The long-run covariance is that of `robust_uncertainty` with nu equal-weighted cosines, so that
    (nu - q + 1) / (nu q) times the Wald statistic follows F(q, nu - q + 1) (Lazarus, Lewis, Stock
    and Watson 2018). A residual whose slowest variations are its strongest, such as a drifting
    force, is not flat over many cosines: the larger p-value of many and of few is returned.

    Columns that act in one log each are tested log by log; the smallest p-value counts, times the
    number of logs (Bonferroni).

    ``further`` are the same columns, if some may act in one log only.
    """
    blocks = [] if further is None or basis.log is None else _blocks(further, basis.log)
    if len(blocks) > 1:
        parts = [basis.partial(block) for block in blocks]
        p_values = [1.0 if part is None else significance(basis, part) for part in parts]
        return min(len(blocks) * min(p_values), 1.0)
    p, q = basis.vectors.shape[1], partial.vectors.shape[1]
    residual = basis.residual - partial.vectors @ partial.coordinates
    vectors = np.column_stack([basis.vectors, partial.vectors])
    p_values = []
    for most in _COSINES:
        found = robust_uncertainty(vectors, np.eye(p + q)[p:], residual, most, log=basis.log)
        nu = float(np.min(found.degrees_of_freedom))
        degrees = nu - q + 1.0
        if degrees <= 0 or not np.any(found.covariance):
            return 1.0
        wald = float(partial.coordinates @ np.linalg.pinv(found.covariance) @ partial.coordinates)
        p_values.append(float(fdtrc(q, degrees, wald * degrees / (nu * q))))
    return max(p_values)


def significant_value(
    basis: Basis, partial: Partial | None, largest_p_value: float, smallest_share: float = 0.0
) -> float | None:
    """Return the coefficient of a further column [SI]; None if it is not significant.

    ``smallest_share`` is the share of the target that the column must explain [-].
    """
    if partial is None or basis.share(partial) < smallest_share:
        return None
    if significance(basis, partial) > largest_p_value:
        return None
    return float(partial.values[0])


def _blocks(
    columns: Float[np.ndarray, "n q"], log: Int[np.ndarray, " n"]
) -> list[Float[np.ndarray, "n _"]]:
    """Return the columns of each log, if each acts in one log only; else all of them at once."""
    acts = np.stack([np.any(columns[log == each] != 0.0, axis=0) for each in np.unique(log)])
    if acts.shape[0] == 1 or np.any(np.sum(acts, axis=0) > 1):
        return [columns]
    return [columns[:, own] for own in acts if np.any(own)]


def held_out_errors(
    columns: Float[np.ndarray, "n p"],
    target: Float[np.ndarray, " n"],
    group: Int[np.ndarray, " n"],
) -> Float[np.ndarray, " groups"]:
    """Return the sum of squared errors on each group of rows of the fit to all the others.

    ``group`` is the number of the group of each row, from 0 and without decrease.
    """
    products, values, _ = _left_out(columns, target, group)
    own, cross = products[:, :-1, :-1], products[:, :-1, -1:]
    squares = products[:, -1, -1] - 2.0 * (np.swapaxes(values, 1, 2) @ cross)[:, 0, 0]
    squares += (np.swapaxes(values, 1, 2) @ own @ values)[:, 0, 0]
    return np.maximum(squares, 0.0)


def jackknife(
    columns: Float[np.ndarray, "n p"],
    target: Float[np.ndarray, " n"],
    group: Int[np.ndarray, " n"],
) -> Float[np.ndarray, "groups p"]:
    """Return rows J with the jackknife covariance J^T J of the coefficients.

    J has the changes of the coefficients without each group (B. Efron 1982, "The jackknife, the
    bootstrap and other resampling plans"), scaled so that J^T J has the expectation of the
    covariance under white residuals, which the plain factor sqrt((g - 1)/g) gives for g groups of
    equal information only: with the Gramians A of all rows and A_k of a group,
    ``E (b_(k) - b)^2 = s^2 [(A - A_k)^-1 - A^-1]``. Groups without which the columns are dependent
    do not count.
    """
    products, values, norms = _left_out(columns, target, group)
    gram = products[:, :-1, :-1]
    whole = np.sum(gram, axis=0)
    strength = np.linalg.eigvalsh(whole - gram)
    known = strength[:, 0] > _DEPENDENT**2 * strength[:, -1]
    values = values[known, :, 0] / np.where(norms > 0, norms, 1.0)
    if values.shape[0] == 0:
        return values
    variance = np.diag(np.linalg.inv(whole))
    without = np.diagonal(np.linalg.inv((whole - gram)[known]), axis1=1, axis2=2)
    expected = np.sum(without - variance, axis=0) / variance
    # A coefficient that no group changes has no differences
    scale = np.sqrt(np.where(expected > _COLLINEAR, expected, np.inf))
    return (values - np.mean(values, axis=0)) / scale


def _left_out(
    columns: Float[np.ndarray, "n p"],
    target: Float[np.ndarray, " n"],
    group: Int[np.ndarray, " n"],
) -> tuple[
    Float[np.ndarray, "groups q q"], Float[np.ndarray, "groups p 1"], Float[np.ndarray, " p"]
]:
    """Return the products of columns and target in each group, and the fits to all other groups.

    The columns are taken at unit norm; their norms are returned too.
    """
    norms = np.linalg.norm(columns, axis=0)
    table = np.column_stack([columns / np.where(norms > 0, norms, 1.0), target])
    parts = np.split(table, np.flatnonzero(np.diff(group)) + 1)
    products = np.stack([part.T @ part for part in parts])
    rest = np.sum(products, axis=0) - products
    values = np.linalg.pinv(rest[:, :-1, :-1], rcond=1e-10, hermitian=True) @ rest[:, :-1, -1:]
    return products, values, norms
