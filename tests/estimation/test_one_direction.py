"""Selection of terms on an axis that moves one way only, as a spindle."""

import numpy as np
import pytest
from axis_logs import axis_log

from stickslip import identify

T, DELAY = 1e-3, 2.4e-3
TRUE = {"mass": 2.0, "viscous_friction": 1.5, "effort_delay": -DELAY}


def test_a_delay_is_selected_beside_coulomb_friction_and_offset() -> None:
    """Offset and Coulomb friction are one column then; a delay of the effort is another.

    Speed and acceleration are those of sines, and the log of the effort has a delay of 2.4 samples.
    """
    time, generator = T * np.arange(8000), np.random.default_rng(1)
    moved = time - DELAY
    speed = 1.0 + 0.4 * np.sin(2.0 * moved) + 0.3 * np.sin(7.0 * moved)
    acceleration = 0.8 * np.cos(2.0 * moved) + 2.1 * np.cos(7.0 * moved)
    position = time - 0.2 * np.cos(2.0 * time) - 0.3 / 7.0 * np.cos(7.0 * time)
    log = axis_log(
        time,
        2.0 * acceleration + 3.0 + 1.5 * speed + 0.02 * generator.normal(size=time.size),
        position + 1e-6 * generator.normal(size=time.size),
    )
    estimate = identify(log, effort_kind="sampled").estimate
    assert "delay" in estimate.selection.selected
    verdicts = {each.parameter: each.identifiable for each in estimate.diagnostics.verdicts}
    assert not verdicts["coulomb_friction"]
    for name, true in TRUE.items():
        found = estimate.parameters[name]
        assert verdicts[name]
        assert found.value == pytest.approx(true, abs=4.0 * found.std)
        assert found.std < 0.02 * abs(true)
