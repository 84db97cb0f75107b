"""Every number that part B prints of its own results, beside ours."""

from stickslip.planning import PulseLaw
from studies.van_de_wijdeven.part_b.cases import PAPWC, PWC, papwc, pwc
from studies.van_de_wijdeven.part_b.setting import LONGEST_PULSE, PULSE_EFFORT, SAMPLING_TIME
from studies.van_de_wijdeven.records import PrintedNumber

FAR = 0.01
"""The displacement of Figure 1's example [m]."""
NEAR = 0.002
"""The residual error of section 3.1's example [m]."""

_ROUNDED = 0.6  # as the source prints b_hat over b


def width_by_gain(displacement: float, gain: float) -> float:
    """Return the width by Eq. 4 for a displacement [m], with b or an estimate of it [s]."""
    return (displacement / gain) ** 0.5


def printed_numbers(law: PulseLaw) -> tuple[PrintedNumber, ...]:
    """Return the numbers of sections 3 and 4, in the source's order."""
    b = law.gain(PULSE_EFFORT)
    exact = float(law.width_for(FAR, effort=PULSE_EFFORT))
    fitted = FAR / exact**2
    long = width_by_gain(NEAR, fitted)
    smallest = float(law.displacement(PULSE_EFFORT, LONGEST_PULSE)) / (b * LONGEST_PULSE**2)
    by_rounded = float(law.displacement(PULSE_EFFORT, width_by_gain(NEAR, _ROUNDED * b)))
    first = {
        PWC: pwc(longest_width=None).first_gain / b,
        PAPWC: papwc(longest_width=None).estimates(papwc(longest_width=None).init())["pulse_gain"]
        / b,
    }
    return (
        PrintedNumber(
            place="3.1, Fig. 1",
            quantity="width for 10 mm by Eq. 3",
            printed="0.092",
            value=exact,
            unit="s",
            how="Eq. 3, inverted",
        ),
        PrintedNumber(
            place="3.1, Fig. 1",
            quantity="width for 10 mm by Eq. 4",
            printed="0.070",
            value=width_by_gain(FAR, b),
            unit="s",
            how="Eq. 4, inverted; the source's last digit is cut off",
        ),
        PrintedNumber(
            place="3.1, Fig. 1",
            quantity="b̂/b with which Eq. 4 meets Eq. 3 at 10 mm",
            printed="0.6",
            value=fitted / b,
            unit="1",
            how="10 mm over the square of the first width",
        ),
        PrintedNumber(
            place="3.1",
            quantity="least b̂/b for widths up to 0.03 s",
            printed="0.81",
            value=smallest,
            unit="1",
            how="Eq. 3 over the width's square, at 0.03 s",
        ),
        PrintedNumber(
            place="3.1",
            quantity="width for 2.0 mm with that b̂",
            printed="0.041",
            value=long,
            unit="s",
            how="Eq. 4 with the b̂ of 10 mm",
        ),
        PrintedNumber(
            place="3.1",
            quantity="width for 2.0 mm by Eq. 3",
            printed="0.036",
            value=float(law.width_for(NEAR, effort=PULSE_EFFORT)),
            unit="s",
            how="Eq. 3, inverted",
        ),
        PrintedNumber(
            place="3.1",
            quantity="displacement instead of 2.0 mm",
            printed="2.5e-3",
            value=float(law.displacement(PULSE_EFFORT, long)),
            unit="m",
            how=f"Eq. 3 with the longer width; with b̂ rounded to {_ROUNDED:g} b it is "
            f"{1e3 * by_rounded:.2f} mm, which is what the source prints",
        ),
        PrintedNumber(
            place="4",
            quantity="b̂(0)/b of PWC for a first guess of 0.8 f_c",
            printed="1.375",
            value=first[PWC],
            unit="1",
            how="the controller's first estimate",
        ),
        PrintedNumber(
            place="4",
            quantity="b̂(0)/b of PAPWC for a first guess of 0.8 f_c",
            printed="1.375",
            value=first[PAPWC],
            unit="1",
            how="the controller's first estimate",
        ),
        PrintedNumber(
            place="4, Eq. 23",
            quantity="smallest displacement of PWC",
            printed="1.9e-4",
            value=float(law.displacement(PULSE_EFFORT, SAMPLING_TIME)),
            unit="m",
            how="Eq. 3 at full effort for one sample",
        ),
        PrintedNumber(
            place="4, Eq. 24",
            quantity="smallest displacement of PAPWC",
            printed="1.3e-5",
            value=float(law.smallest_displacement(SAMPLING_TIME)),
            unit="m",
            how="Eq. 3 at the static friction for one sample",
        ),
    )
