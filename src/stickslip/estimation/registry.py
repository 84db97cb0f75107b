"""The registry of the estimators, with their properties and factories.

``docs/contributing.md`` has the steps to add one. The table of the documentation is made from it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from importlib import import_module
from typing import Any

from stickslip.estimation.base import EstimationTask, Estimator
from stickslip.records import AxisKind, InputError, ReadOnlyMapping, mass_name


@dataclass(frozen=True, kw_only=True)
class EstimatorEntry:
    """An estimator of the registry, with its properties and its factory."""

    name: str  #: Name in Python, on the command line and in results.
    summary: str  #: One line on the method.
    build: Callable[[EstimationTask], Estimator]  #: Factory, without checks.
    #: Names of the optional settings of `EstimationTask` that it uses.
    settings: frozenset[str] = frozenset()
    needs_inertia: bool = False  #: Whether the mass or inertia must be known.
    rigid_only: bool = False  #: Whether it applies to rigid axes only.
    symmetric_only: bool = False  #: Whether friction is equal in both directions.
    gives_intervals: bool = True  #: Whether its estimates have confidence intervals.
    online: bool = False  #: Whether it obeys `OnlineEstimator`.
    #: Name of the estimator that adds static friction and Stribeck velocity; empty if there is
    #: none.
    with_stribeck: str = ""

    def make(self, task: EstimationTask, kind: AxisKind, inertia: float | None = None) -> Estimator:
        """Return the estimator for a task.

        Parameters
        ----------
        task
            Known parameters of the axis, and the terms to estimate.
        kind
            ``"linear"`` or ``"rotary"``.
        inertia
            Mass or inertia if the task has none [kg or kg m^2]: the known value for an estimator
            that needs it, the first guess for one that estimates it.

        Raises
        ------
        InputError
            If the estimator does not apply to the task, or has no use for one of its settings.
        """
        self._check_settings(task)
        if self.rigid_only and task.flexible:
            raise InputError(
                "estimator_of_rigid_axes",
                estimator=self.name,
                others=_those(lambda entry: not entry.rigid_only),
            )
        if self.symmetric_only and task.per_direction:
            raise InputError(
                "estimator_of_equal_friction",
                estimator=self.name,
                others=_those(lambda entry: not entry.symmetric_only),
            )
        task.check(kind)
        if self.needs_inertia and task.inertia is None:
            if inertia is None:
                body = mass_name(kind)
                raise InputError(
                    "estimator_needs_inertia",
                    estimator=self.name,
                    name=body,
                    others=_those(lambda entry: not entry.needs_inertia),
                )
            task = replace(task, inertia=inertia)
        elif task.inertia is None:
            task = replace(task, inertia_guess=inertia)
        return self.build(task)

    def usable(self, task: EstimationTask) -> EstimationTask:
        """Return a task without the optional settings that the estimator does not use.

        Parameters
        ----------
        task
            Known parameters of the axis, and the terms to estimate.
        """
        unused = set(task.settings) - self.settings
        return replace(task, **{name: getattr(_DEFAULT, name) for name in unused})

    def _check_settings(self, task: EstimationTask) -> None:
        for name, value in task.settings.items():
            if name in self.settings:
                continue
            raise InputError(
                "setting_unused",
                name=name,
                value="" if value is True else value,
                estimator=self.name,
                others=_those(lambda entry, name=name: name in entry.settings),
            )


_DEFAULT = EstimationTask()


def entry_of(name: str) -> EstimatorEntry:
    """Return the entry of an estimator; an unknown name is an InputError."""
    entry = ESTIMATORS.get(name)
    if entry is None:
        raise InputError("unknown_estimator", estimator=name, estimators=tuple(ESTIMATORS))
    return entry


def _those(applies: Callable[[EstimatorEntry], bool]) -> list[str]:
    """Return the names of the estimators for a remedy."""
    return [name for name, entry in ESTIMATORS.items() if applies(entry)]


def _selected(task: EstimationTask) -> Estimator:
    """Return the estimator that selects its model; of a flexible arm the energy estimator."""
    if task.flexible:
        known = task.effort_delay is not None or task.effort_kind is not None
        if task.include or task.exclude or not task.select or known:
            raise InputError("selection_of_arm")
        return _energy(task)
    from stickslip.estimation.selection.estimator import SelectedModelEstimator

    return SelectedModelEstimator(
        inertia=task.inertia,
        offset=task.offset is not False,
        include=(
            *(("direction",) if task.per_direction else ()),
            *(("stribeck",) if task.stribeck else ()),
            *task.include,
        ),
        exclude=task.exclude,
        select=task.select,
        effort_delay=task.effort_delay,
        effort_kind=task.effort_kind,
    )


def _made(module: str, name: str, task: EstimationTask, **settings: Any) -> Any:
    """Return an estimator of a class by its name, with the settings of a task that it has.

    Its module is imported only here.
    """
    cls = getattr(import_module(f"stickslip.estimation.{module}"), name)
    own = {each.name for each in fields(cls)} - {"stribeck"}  # in the classes a velocity
    values = {each.name: getattr(task, each.name) for each in fields(task) if each.name in own}
    given = {key: value for key, value in values.items() if value != getattr(_DEFAULT, key)}
    return cls(**given | settings)


_energy = partial(_made, "energy.estimator", "EnergyEstimator")
_idim = partial(_made, "regression.idim", "IdimLeastSquares")


def _stribeck(method: Callable[[EstimationTask], Any], task: EstimationTask) -> Estimator:
    from stickslip.estimation.regression.stribeck import StribeckEstimator

    return StribeckEstimator(method=method(task))


def _maximum_likelihood(task: EstimationTask) -> Estimator:
    guess = None
    if task.flexible and task.inertia is None:
        if task.inertia_guess is None:
            raise InputError("likelihood_needs_mass")
        guess = {"mass": task.inertia_guess, "inertia": task.inertia_guess}
    return _made("likelihood.estimator", "MaximumLikelihoodEstimator", task, initial_values=guess)


def _observer(module: str, name: str, task: EstimationTask, **settings: bool) -> Estimator:
    return _made(f"online.{module}", name, task, offset=task.has_offset, **settings)


_adaptive = partial(_observer, "observers.adaptive_observers")
_observer_entry = partial(
    EstimatorEntry,
    settings=frozenset({"offset", "cutoff"}),
    needs_inertia=True,
    symmetric_only=True,
    gives_intervals=False,
    online=True,
)

_ENTRIES = (
    EstimatorEntry(
        name="auto",
        summary="effort over windows of slip, with the terms that the log supports",
        build=_selected,
        settings=frozenset(
            {"offset", "stribeck", "include", "exclude", "select", "effort_delay", "effort_kind"}
        ),
        with_stribeck="auto",
    ),
    EstimatorEntry(
        name="energy",
        summary="energy balance, whitened by a Kalman filter",
        build=_energy,
        settings=frozenset({"offset", "cutoff"}),
        online=True,
        with_stribeck="stribeck-energy",
    ),
    EstimatorEntry(
        name="maximum-likelihood",
        summary="simulated motion with the greatest likelihood (output error)",
        build=_maximum_likelihood,
        settings=frozenset({"offset", "largest_delay"}),
    ),
    EstimatorEntry(
        name="maximum-likelihood-process-noise",
        summary="greatest likelihood under noise of the effort, of the sensors and of forces",
        build=partial(
            _made, "likelihood.process_noise.estimator", "ProcessNoiseLikelihoodEstimator"
        ),
        settings=frozenset({"offset", "largest_delay"}),
        rigid_only=True,
    ),
    EstimatorEntry(
        name="idim-ls",
        summary="inverse dynamic model by least squares",
        build=_idim,
        settings=frozenset({"offset", "cutoff"}),
        rigid_only=True,
        with_stribeck="stribeck-idim-ls",
    ),
    EstimatorEntry(
        name="idim-iv",
        summary="inverse dynamic model by instrumental variables",
        build=partial(_made, "regression.idim", "IdimInstrumentalVariables"),
        settings=frozenset({"offset", "cutoff"}),
        rigid_only=True,
    ),
    EstimatorEntry(
        name="stribeck-energy",
        summary="energy balance with static friction and Stribeck velocity",
        build=partial(_stribeck, _energy),
        settings=frozenset({"offset", "cutoff", "stribeck"}),
        with_stribeck="stribeck-energy",
    ),
    EstimatorEntry(
        name="stribeck-idim-ls",
        summary="inverse dynamic model with static friction and Stribeck velocity",
        build=partial(_stribeck, _idim),
        settings=frozenset({"offset", "cutoff", "stribeck"}),
        rigid_only=True,
        with_stribeck="stribeck-idim-ls",
    ),
    EstimatorEntry(
        name="ekf",
        summary="extended Kalman filter with exact stops and breakaways",
        build=partial(_observer, "kalman.extended_kalman", "ExtendedKalmanFilter"),
        settings=frozenset({"offset"}),
        needs_inertia=True,
        rigid_only=True,
        symmetric_only=True,
        online=True,
    ),
    EstimatorEntry(
        name="rls",
        summary="recursive least squares on the friction force",
        build=partial(_observer, "observers.least_squares_observer", "LeastSquaresObserver"),
        settings=frozenset({"offset", "cutoff"}),
        symmetric_only=True,
        online=True,
    ),
    _observer_entry(
        name="friedland-park",
        summary="reduced-order observer of Friedland and Park",
        build=partial(_adaptive, "FriedlandParkObserver", viscous=True),
    ),
    _observer_entry(
        name="yazdizadeh-khorasani",
        summary="adaptive observer of Yazdizadeh and Khorasani",
        build=partial(_adaptive, "YazdizadehKhorasaniObserver", viscous=True),
    ),
    _observer_entry(
        name="liao-chien",
        summary="adaptive observer of Liao and Chien",
        build=partial(_adaptive, "LiaoChienObserver", viscous=True),
    ),
    _observer_entry(
        name="gradient",
        summary="gradient descent on the prediction error (Slotine and Li)",
        build=partial(_adaptive, "GradientEstimator"),
    ),
    EstimatorEntry(
        name="published-energy",
        summary="energy balance as published by van de Wijdeven (2002)",
        build=partial(_made, "energy.published.estimator", "PublishedEnergyEstimator"),
        settings=frozenset({"cutoff", "forgetting_factor", "initial_variance"}),
        needs_inertia=True,
        symmetric_only=True,
        online=True,
    ),
    EstimatorEntry(
        name="free-decay",
        summary="decaying extremes of a free oscillation at the end of the log",
        build=partial(_made, "regression.free_decay", "FreeDecayEstimator"),
        needs_inertia=True,
        rigid_only=True,
        symmetric_only=True,
    ),
)

ESTIMATORS: Mapping[str, EstimatorEntry] = ReadOnlyMapping({e.name: e for e in _ENTRIES})
"""Every estimator by its name, in the order of tables."""
