"""The plate of the two-joint hip: its claims, against the equations written out as published."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from tests.plots.drawn import plate

SILDER_EXTENDED = {15: 28.357, 60: 35.031, 90: 47.587, 110: 64.064}
SILDER_FLEXED = {15: -42.423, 60: -9.219, 90: -6.803, 110: -5.969}


def hip(h: float, k: float) -> float:
    """Riener & Edrich 1999, angles in deg, moment in N m, towards flexion."""
    return (
        np.exp(1.4655 - 0.0034 * k - 0.0750 * h) - np.exp(1.3403 - 0.0226 * k + 0.0305 * h) + 8.072
    )


@pytest.fixture(scope="module")
def drawn():
    return plate("two_joint_hip")


def test_moments_read_out_of_exudyn_are_the_equations(drawn) -> None:
    table = drawn.tables["exudyn"]
    for knee in (15, 60, 90, 110):
        expected = hip(table["hip flexion [deg]"], knee)
        assert table[f"Exudyn, knee {knee} deg [N m]"] == pytest.approx(expected, abs=1e-9)
    assert drawn.claims[0].measured < 1e-9


def test_margins_of_the_footnote(drawn) -> None:
    """Silder's points: 64.1 over 47.6, 35.0 over 28.4; 6.8 over 6.0, 42.4 over 9.2 N m."""
    extended, flexed = SILDER_EXTENDED, SILDER_FLEXED
    silder = [
        min(extended[110] - extended[90], extended[60] - extended[15]),
        min(flexed[110] - flexed[90], flexed[60] - flexed[15]),
    ]
    assert [claim.measured for claim in drawn.claims[1:3]] == pytest.approx(silder, abs=1e-9)
    knees = (0.0, 15.0, 60.0, 90.0)
    riener = [
        min(hip(-15.0, 110.0) - hip(-15.0, knee) for knee in knees),
        min(hip(80.0, 110.0) - hip(80.0, knee) for knee in knees),
    ]
    assert [claim.measured for claim in drawn.claims[3:5]] == pytest.approx(riener, abs=1e-9)


def test_the_work_of_the_loop_is_the_curl_within_it(drawn) -> None:
    """Green's theorem: dM_knee/dh - dM_hip/dk over the rectangle, the angles in deg."""

    def curl(k: float, h: float) -> float:
        of_hip = -0.0034 * np.exp(1.4655 - 0.0034 * k - 0.0750 * h) + 0.0226 * np.exp(
            1.3403 - 0.0226 * k + 0.0305 * h
        )
        of_knee = 0.0217 * np.exp(1.800 - 0.0352 * k + 0.0217 * h) + 0.0128 * np.exp(
            -3.971 + 0.0495 * k - 0.0128 * h
        )
        return of_knee - of_hip

    expected = np.radians(1.0) * dblquad(curl, -15.0, 100.0, 0.0, 135.0)[0]
    assert expected == pytest.approx(-12.67, abs=0.01)
    assert f"{expected:.2f} J" in drawn.claims[5].sentence
    assert drawn.claims[5].measured < 1e-9


def test_the_nearest_gradient_does_no_work_and_is_near(drawn) -> None:
    work, rms = drawn.claims[6], drawn.claims[7]
    assert abs(work.measured) < 1e-9
    assert 0.1 < rms.measured < 1.0
    assert rms.at_most == 2.5
