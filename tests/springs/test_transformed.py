import pytest

from springs import Stop
from springs.exponential import Exponential
from springs.transformed import Transformed


def test_breakpoints_and_range_move_with_the_curve():
    moved = Transformed(Stop(-0.6, 1.1, onset=0.1), 2.0, 0.2)
    assert moved.breakpoints == pytest.approx((-0.5, -0.4, 1.3, 1.4))
    assert moved.valid_range is None
    law = Transformed(Exponential((), valid_range=(-1.0, 2.0)), offset=0.5)
    assert law.valid_range == (-0.5, 2.5)
