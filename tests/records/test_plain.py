"""Records as plain JSON types."""

import json
from dataclasses import fields

from stickslip.records import JointLog, JointLogs, LogDeviation, ModelSelection, TermScore

SCORE = TermScore(
    term="spring", text="a spring", selected=True, p_value=0.01, gain=0.2, gain_std=0.1, share=0.3
)
DEVIATION = LogDeviation(
    log="noon",
    parameter="mass",
    difference=0.1,
    std=0.01,
    relative=0.05,
    p_value=1e-4,
    material=True,
)
LOG = JointLog(name="noon", samples=10, duration=1.0, sampling_time=0.1, residual=0.02)


def test_a_selection_has_all_fields_of_its_terms() -> None:
    found = ModelSelection(summary="plain", scores=(SCORE,), effort_delay=0.002).to_dict()
    assert json.loads(json.dumps(found)) == {
        "summary": "plain",
        "scores": [{field.name: getattr(SCORE, field.name) for field in fields(TermScore)}],
        "effort_delay": 0.002,
        "reference_time": 0.0,
        "reference_position": 0.0,
        "effort_kind": "held",
    }


def test_logs_of_a_joint_fit_have_all_fields_and_whether_they_are_consistent() -> None:
    found = JointLogs(logs=(LOG,), p_value=None, error_rate=0.01, deviations=(DEVIATION,)).to_dict()
    assert json.loads(json.dumps(found)) == {
        "logs": [{field.name: getattr(LOG, field.name) for field in fields(JointLog)}],
        "p_value": None,
        "error_rate": 0.01,
        "deviations": [
            {field.name: getattr(DEVIATION, field.name) for field in fields(LogDeviation)}
        ],
        "consistent": False,
    }
