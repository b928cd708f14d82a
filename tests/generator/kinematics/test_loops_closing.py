"""Loops that are closed: the nearest pose, and of each joint the nearest winding."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.kinematics.loops import close_loops
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree

FOURBAR = read_figure(Path(str(files("figures"))) / "fourbar.fig")


@pytest.mark.parametrize("crank", [-170.0, -90.0, 0.0, 10.0, 60.0, 120.0, 270.0, 359.0])
def test_no_joint_goes_round_that_need_not(crank) -> None:
    """The others end within half a turn of where they are drawn, and the loop is closed."""
    tree = build_tree(FOURBAR)
    drawn = initial_displacements(tree)
    asked = {**drawn, "crank_bearing": np.radians([crank])}
    placement = close_loops(tree, asked, fixed={"crank_bearing"})
    for name in ("crank_pin", "rocker_bearing", "rocker_pin"):
        assert abs(placement.displacements[name][0] - drawn[name][0]) <= np.pi + 1e-9
    ends = (
        (placement.poses[segment] @ FOURBAR.segments[segment].sites["far"].pose_in_segment)[:3, 3]
        for segment in ("coupler", "rocker")
    )
    assert next(ends) == pytest.approx(next(ends), abs=1e-8)
    assert placement.displacements["crank_bearing"][0] == pytest.approx(np.radians(crank))
