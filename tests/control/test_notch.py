import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses
from scipy import signal

from stickslip.control import Notch
from stickslip.control.feedback.linear_parts import notch_step

ROUNDING = 1e-8  # a few 2e-16 over the denominator at the centre, 2 damping (w T)^2 >= 1e-7
NOTCHES = st.builds(
    Notch,
    angular_frequency=st.floats(0.5, 50.0),
    depth=st.floats(0.0, 0.99),
    damping=st.floats(0.05, 2.0),
)
TIMES = st.floats(0.002, 0.05)


def continuous(notch, w):
    """H(j w), as the class documents it."""
    s, w0 = 1j * np.asarray(w), notch.angular_frequency
    pole = 2 * notch.damping * w0 * s
    return (s**2 + notch.depth * pole + w0**2) / (s**2 + pole + w0**2)


def sampled(notch, T, w):
    c = notch.coefficients(T)
    return signal.freqz([c.b0, c.b1, c.b2], [1.0, c.a1, c.a2], worN=np.asarray(w) * T)[1]


@given(notch=NOTCHES, T=TIMES)
def test_the_response_is_that_of_scipys_pre_warped_bilinear_transform(notch, T):
    w0, zeta = notch.angular_frequency, notch.damping
    b, a = signal.bilinear(
        [1.0, 2 * notch.depth * zeta * w0, w0**2],
        [1.0, 2 * zeta * w0, w0**2],
        fs=w0 / (2 * np.tan(w0 * T / 2)),
    )
    w = np.linspace(0.0, np.pi / T, 200)[:-1]
    expected = signal.freqz(b, a, worN=w * T)[1]
    np.testing.assert_allclose(sampled(notch, T, w), expected, rtol=0, atol=ROUNDING)


@given(notch=NOTCHES, T=TIMES)
def test_the_response_is_the_continuous_one_at_warped_frequencies(notch, T):
    w = np.linspace(0.0, 0.99 * np.pi / T, 50)
    w0 = notch.angular_frequency
    warped = w0 / np.tan(w0 * T / 2) * np.tan(w * T / 2)
    np.testing.assert_allclose(
        sampled(notch, T, w), continuous(notch, warped), rtol=0, atol=ROUNDING
    )


@given(notch=NOTCHES, T=TIMES)
def test_the_centre_is_where_and_as_deep_as_asked(notch, T):
    centre, ends = notch.angular_frequency, [0.0, np.pi / T]
    np.testing.assert_allclose(sampled(notch, T, [centre]), notch.depth, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(sampled(notch, T, ends), 1.0, rtol=0, atol=ROUNDING)


def test_a_notch_to_zero_is_scipys_iirnotch():
    # Its quality is a ratio of digital frequencies; tan of half the width is zeta sin(w T)
    notch, T = Notch(angular_frequency=40.0, depth=0.0, damping=0.3), 0.01
    angle = notch.angular_frequency * T
    width = 2 * np.arctan(notch.damping * np.sin(angle))
    b, a = signal.iirnotch(angle / np.pi, angle / width)
    c = notch.coefficients(T)
    np.testing.assert_allclose([c.b0, c.b1, c.b2], b, rtol=1e-12)
    np.testing.assert_allclose([1.0, c.a1, c.a2], a, rtol=1e-12)


def test_a_fast_sampled_notch_is_the_continuous_one():
    notch, w = Notch(angular_frequency=3.0, depth=0.2, damping=0.5), np.geomspace(0.1, 30.0, 50)
    errors = [
        np.abs(sampled(notch, T, w) - continuous(notch, w)).max() for T in (0.02, 0.01, 0.005)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.1)  # Tustin: second order


def test_the_kernel_filters_as_scipy_does():
    c = Notch(angular_frequency=20.0, depth=0.1, damping=0.4).coefficients(0.01)
    e = np.random.default_rng(1).normal(size=500)
    z1 = z2 = 0.0
    y = np.empty_like(e)
    for k, value in enumerate(e):
        y[k], z1, z2 = notch_step(c, z1, z2, value)
    expected = signal.lfilter([c.b0, c.b1, c.b2], [1.0, c.a1, c.a2], e)
    np.testing.assert_allclose(y, expected, rtol=0, atol=1e-12)


def test_the_resonance_is_where_the_arm_swings():
    m1, m2, k = 2.0, 0.7, 30.0
    notch = Notch.at_resonance(mass_1=m1, mass_2=m2, stiffness=k, depth=0.0, damping=0.5)
    arm = np.array([[-k / m1, k / m1], [k / m2, -k / m2]])  # x'' = arm x
    assert notch.angular_frequency == pytest.approx(np.sqrt(-np.linalg.eigvals(arm).min()))


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"angular_frequency": 0.0}, "not_positive"),
        ({"depth": 1.0}, "not_below"),
        ({"depth": -0.1}, "negative"),
        ({"damping": np.nan}, "not_finite"),
    ],
)
def test_refuses_what_is_no_notch(change, code):
    good = {"angular_frequency": 10.0, "depth": 0.1, "damping": 0.5}
    with refuses(code, of=change):
        Notch(**(good | change))


def test_refuses_a_notch_beyond_half_the_sampling_rate():
    notch = Notch(angular_frequency=400.0, depth=0.1, damping=0.5)
    with refuses("frequency_above_nyquist", value=400.0, sampling_time=0.01):
        notch.coefficients(0.01)
    with refuses("not_positive", value=0.0):
        notch.coefficients(0.0)


def test_refuses_an_arm_without_mass():
    with refuses("not_positive", value=0.0):
        Notch.at_resonance(mass_1=1.0, mass_2=0.0, stiffness=1.0, depth=0.1, damping=0.5)
