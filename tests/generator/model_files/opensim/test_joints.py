"""The functions of OpenSim's joints, against OpenSim's own."""

from typing import Any

import numpy as np
import pytest

from generator.diagnostics import Diagnostics, Source
from generator.model_files.opensim.joints import line_slope, parse_curve
from generator.model_files.xml import parse_xml

KNOTS = ((-2.0, -0.02), (-1.2, -0.011), (-0.4, -0.003), (0.0, 0.0), (0.5, 0.002), (1.4, -0.004))
PLACES = (-2.5, -2.0, -1.7, -0.4, 0.2, 1.39, 1.4, 2.0)


def motion(text: str, at: float) -> tuple[float | None, float]:
    """Slope of a straight function, and the value of any."""
    findings = Diagnostics()
    root = parse_xml(Source("f.xml", text), findings)
    assert root is not None
    found = parse_curve(root)
    assert found is not None, findings.entries
    return line_slope(found), float(found.at(at))


def curve(kind: str, knots=KNOTS) -> str:
    x, y = (" ".join(map(repr, row)) for row in zip(*knots, strict=True))
    return f"<{kind}><x>{x}</x><y>{y}</y></{kind}>"


@pytest.mark.verify
@pytest.mark.parametrize("kind", ["SimmSpline", "PiecewiseLinearFunction"])
@pytest.mark.parametrize("count", [3, 4, 6])
def test_curves_through_points_are_opensims(kind, count):
    api: Any = pytest.importorskip("opensim")
    theirs = getattr(api, kind)()
    for x, y in KNOTS[:count]:
        theirs.addPoint(x, y)
    for place in PLACES:
        expected = theirs.calcValue(api.Vector(1, place))
        slope, value = motion(curve(kind, KNOTS[:count]), place)
        assert value == pytest.approx(expected, abs=1e-12), place
        assert slope is None


def test_straight_functions_have_a_slope():
    line = "<LinearFunction><coefficients>-1.5 0.25</coefficients></LinearFunction>"
    assert motion(line, 2.0) == (-1.5, -2.75)
    assert motion("<Constant><value>0.3</value></Constant>", 2.0) == (0.0, 0.3)
    scaled = f"<MultiplierFunction><function>{line}</function><scale>2</scale></MultiplierFunction>"
    assert motion(scaled, 2.0) == (-3.0, -5.5)
    parabola = "<PolynomialFunction><coefficients>2 0 1</coefficients></PolynomialFunction>"
    assert motion(parabola, 3.0) == (None, 19.0)
    two = curve("SimmSpline", ((0.0, 1.0), (2.0, 5.0)))
    assert motion(two, 3.0) == (2.0, 7.0)
    assert motion(curve("SimmSpline", ((0.0, 1.0), (1.0, 3.0), (2.0, 5.0))), 3.0)[0] == 2.0


def test_a_curve_through_two_points_is_a_line():
    root = parse_xml(Source("f.xml", curve("SimmSpline", ((0.0, 1.0), (2.0, 5.0)))), Diagnostics())
    assert root is not None
    found = parse_curve(root)
    assert found is not None
    np.testing.assert_allclose(found.at(np.array([-1.0, 0.5, 3.0])), [-1.0, 2.0, 7.0])


def test_the_older_name_of_a_spline_means_the_same():
    """OpenSim 4.6 reads both as one; see `test_a_fall_is_that_of_opensim`."""
    for x in PLACES:
        assert motion(curve("NaturalCubicSpline"), x) == motion(curve("SimmSpline"), x)


@pytest.mark.parametrize(
    "text",
    [
        "<GCVSpline/>",
        "<SimmSpline><x>0 1</x><y>0</y></SimmSpline>",
        "<SimmSpline><x>1 0</x><y>0 1</y></SimmSpline>",
        "<MultiplierFunction/>",
    ],
)
def test_what_is_no_function_is_a_fault(text):
    findings = Diagnostics()
    root = parse_xml(Source("f.xml", text), findings)
    assert root is not None
    assert parse_curve(root) is None
    assert findings.has_errors
