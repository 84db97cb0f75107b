"""Ranges of friction parameters for domain randomisation, from 95 % intervals."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from stickslip.export.base import ExportSettings
from stickslip.export.parameters import ExportParameters
from stickslip.export.template_exporter import TemplateExporter
from stickslip.records import PARAMETER_NAMES, quantity_name, unit_of

Range = tuple[float, float]

_UNCERTAINTY = (
    "The ranges are the 95 % intervals of one axis in one state; temperature, wear and other axes "
    "vary more"
)
_FRICTION = ("coulomb_friction", "viscous_friction", "static_friction")


@dataclass(frozen=True, kw_only=True)
class RangesExporter(TemplateExporter):
    """YAML with value, 95 % interval and standard deviation of every parameter, and correlations.

    Parameters of one joint are correlated: draw them from the normal distribution of the values,
    standard deviations and correlations, and clip them to the intervals.
    """

    name: str = "ranges"
    title: str = "Ranges of domain randomisation"
    group: Literal["randomisation"] = "randomisation"
    template: str = "ranges.yaml.jinja"
    ending: str = ".yaml"
    represents: tuple[str, ...] = tuple(dict.fromkeys(map(quantity_name, PARAMETER_NAMES)))

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        del name, settings
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


@dataclass(frozen=True, kw_only=True)
class IsaacLabEventsExporter(TemplateExporter):
    """Event terms ``randomize_joint_parameters`` of Isaac Lab, which scale the friction.

    The term applies one range to static, dynamic and viscous friction alike, so absolute values
    cannot be given: with ``operation="abs"`` the viscous friction would be drawn from the range of
    the Coulomb friction. The relative range is the widest of theirs. Source:
    ``randomize_joint_parameters`` in
    https://isaac-sim.github.io/IsaacLab/main/_modules/isaaclab/envs/mdp/events.html.
    """

    name: str = "isaac-lab-events"
    title: str = "Isaac Lab event terms"
    group: Literal["randomisation"] = "randomisation"
    template: str = "isaac_lab_events.py.jinja"
    represents: tuple[str, ...] = _FRICTION

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        del settings
        relative = {
            each: (low / value, high / value)
            for each in _FRICTION
            if (value := parameters.mean(each)) and (found := mean_range(parameters, each))
            for low, high in [found]
        }
        low = max(0.0, min((low for low, _ in relative.values()), default=1.0))
        high = max((high for _, high in relative.values()), default=1.0)
        return {"expression": re.escape(name), "low": low, "high": high}, [
            "The range scales the friction of the robot, which must be that of this estimate "
            "(target isaac-lab); it is the widest of the relative ranges",
            _UNCERTAINTY,
        ]


@dataclass(frozen=True, kw_only=True)
class MjlabEventsExporter(TemplateExporter):
    """Event terms ``dr.joint_friction`` and ``dr.joint_damping`` of mjlab, in SI units.

    Source: https://mujocolab.github.io/mjlab/main/source/randomization.html (joint fields).
    """

    name: str = "mjlab-events"
    title: str = "mjlab event terms"
    group: Literal["randomisation"] = "randomisation"
    template: str = "mjlab_events.py.jinja"
    represents: tuple[str, ...] = ("coulomb_friction", "viscous_friction")

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        del settings
        terms = {
            function: found
            for function, quantity in (
                ("joint_friction", "coulomb_friction"),
                ("joint_damping", "viscous_friction"),
            )
            if (found := mean_range(parameters, quantity))
        }
        return {"expression": re.escape(name), "terms": terms}, [_UNCERTAINTY]


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


_LEFT = "is left out: a joint has no constant effort"
_MEAN = "is replaced by the mean of both directions"
RANGES = RangesExporter()
ISAAC_LAB_EVENTS = IsaacLabEventsExporter(cannot={"direction": _MEAN, "offset": _LEFT})
MJLAB_EVENTS = MjlabEventsExporter(
    cannot={
        "direction": _MEAN,
        "offset": _LEFT,
        "static_friction": "is left out: the model has one friction value, and it gets the Coulomb "
        "friction",
    }
)
