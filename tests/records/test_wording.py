"""Names and units as they are written in messages and results."""

from stickslip.records import PARAMETER_NAMES, parameter_label, unit_text


def test_every_parameter_has_a_distinct_label() -> None:
    labels = {parameter_label(name) for name in PARAMETER_NAMES}
    assert len(labels) == len(PARAMETER_NAMES)
    assert "Coulomb friction, forward" in labels


def test_units_are_printed_with_their_exponents_raised() -> None:
    assert unit_text("kg m^2") == "kg m²"
