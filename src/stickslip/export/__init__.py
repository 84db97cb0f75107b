"""Identified friction as files for simulators, drives, code and functional mock-up units."""

from stickslip.export.base import Exporter, ExportSettings, FileToEdit, Rendered
from stickslip.export.parameters import ExportParameters, Source
from stickslip.export.reading import EstimateReading, axes_of
from stickslip.export.registry import exporters, targets
from stickslip.export.transmission import Side, Transmission
from stickslip.export.writing import Export, render, write

__all__ = [
    "EstimateReading",
    "Export",
    "ExportParameters",
    "ExportSettings",
    "Exporter",
    "FileToEdit",
    "Rendered",
    "Side",
    "Source",
    "Transmission",
    "axes_of",
    "exporters",
    "render",
    "targets",
    "write",
]
