"""Ranges of friction parameters for domain randomisation, from 95 % intervals."""

from collections.abc import Mapping

import numpy as np

from stickslip.export.base import IN_A_JOINT, one_friction
from stickslip.export.parameters import ExportParameters
from stickslip.export.template_exporter import AxisToFill, Filling, TemplateExporter
from stickslip.records import PARAMETER_NAMES, quantity_name, unit_of

Range = tuple[float, float]

_UNCERTAINTY = (
    "The ranges are the 95 % intervals of one axis in one state; temperature, wear and other axes "
    "vary more"
)
_FRICTION = ("coulomb_friction", "viscous_friction", "static_friction")


def _ranges(axis: AxisToFill) -> Filling:
    """YAML with value, 95 % interval and standard deviation of every parameter, and correlations.

    Parameters of one joint are correlated: draw them from the normal distribution of the values,
    standard deviations and correlations, and clip them to the intervals.
    """
    parameters = axis.parameters
    names = [
        each for each in parameters.values if each in parameters.ci95 and each in parameters.std
    ]
    rows = [
        {
            "name": each,
            "value": parameters.values[each],
            "unit": unit_of(each, parameters.kind),
            "std": parameters.std[each],
            "low": parameters.ci95[each][0],
            "high": parameters.ci95[each][1],
        }
        for each in names
    ]
    return {"rows": rows, "correlations": _correlations(parameters, names)}, [_UNCERTAINTY]


def _isaac_lab_events(axis: AxisToFill) -> Filling:
    """Event terms ``randomize_joint_parameters`` of Isaac Lab, which scale the friction.

    The term applies one range to static, dynamic and viscous friction alike, so absolute values
    cannot be given: with ``operation="abs"`` the viscous friction would be drawn from the range of
    the Coulomb friction. The relative range is the widest of theirs. Source:
    ``randomize_joint_parameters`` in
    https://isaac-sim.github.io/IsaacLab/main/_modules/isaaclab/envs/mdp/events.html.
    """
    relative = [
        (found[0] / value, found[1] / value)
        for each in _FRICTION
        if (value := axis.parameters.mean(each)) and (found := mean_range(axis.parameters, each))
    ]
    low = max(0.0, min((low for low, _ in relative), default=1.0))
    high = max((high for _, high in relative), default=1.0)
    return {"low": low, "high": high}, [
        "The range scales the friction of the robot, which must be that of this estimate "
        "(target isaac-lab); it is the widest of the relative ranges",
        _UNCERTAINTY,
    ]


def _mjlab_events(axis: AxisToFill) -> Filling:
    """Event terms ``dr.joint_friction`` and ``dr.joint_damping`` of mjlab, in SI units.

    Source: https://mujocolab.github.io/mjlab/main/source/randomization.html (joint fields).
    """
    quantities = {"joint_friction": "coulomb_friction", "joint_damping": "viscous_friction"}
    terms = {
        function: found
        for function, quantity in quantities.items()
        if (found := mean_range(axis.parameters, quantity))
    }
    return {"terms": terms}, [_UNCERTAINTY]


def mean_range(parameters: ExportParameters, quantity: str) -> Range | None:
    """Return the 95 % interval of a quantity, of both directions their mean, from 0 [SI]."""
    intervals = [
        interval for name, interval in parameters.ci95.items() if quantity_name(name) == quantity
    ]
    if not intervals:
        return None
    low, high = np.mean(intervals, axis=0).tolist()
    return max(0.0, low), max(0.0, high)


def _correlations(parameters: ExportParameters, names: list[str]) -> Mapping[str, list[float]]:
    """Return the rows of the correlation matrix by name; empty without a covariance."""
    if not set(names) <= set(parameters.uncertain) or not names:
        return {}
    places = [parameters.uncertain.index(name) for name in names]
    covariance = parameters.covariance[np.ix_(places, places)]
    scale = np.sqrt(np.diag(covariance))
    if not np.all(scale > 0.0):
        return {}
    matrix = covariance / np.outer(scale, scale)
    return dict(zip(names, matrix.round(6).tolist(), strict=True))


RANGES = TemplateExporter(
    name="ranges",
    title="Ranges of domain randomisation",
    group="randomisation",
    values=_ranges,
    template="ranges.yaml.jinja",
    represents=tuple(dict.fromkeys(map(quantity_name, PARAMETER_NAMES))),
    ending=".yaml",
)
ISAAC_LAB_EVENTS = TemplateExporter(
    name="isaac-lab-events",
    title="Isaac Lab event terms",
    group="randomisation",
    values=_isaac_lab_events,
    template="isaac_lab_events.py.jinja",
    represents=_FRICTION,
    cannot=IN_A_JOINT,
)
MJLAB_EVENTS = TemplateExporter(
    name="mjlab-events",
    title="mjlab event terms",
    group="randomisation",
    values=_mjlab_events,
    template="mjlab_events.py.jinja",
    represents=("coulomb_friction", "viscous_friction"),
    cannot=IN_A_JOINT | {"static_friction": one_friction("the model")},
)
