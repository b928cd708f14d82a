"""Axes of joints: their labels."""

from generator.springs_file.axes import axis_label
from tests.chains import chain


def test_labels_of_axes() -> None:
    labels = [axis_label(factor.axis) for factor in chain("Rx R-y Tz Rs")]
    assert labels == ["x", "-y", "z", "(0.666667, -0.333333, 0.666667)"]
    assert axis_label((0.0, -1.0, 1e-12)) == "-y"
    assert axis_label((0.6, 0.8, -0.0)) == "(0.6, 0.8, 0)"
