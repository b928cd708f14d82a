"""Frames of sites and joints, and the surroundings of a figure."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from generator import read_figure
from generator.viewer import surroundings


def test_frames_of_sites_are_those_of_the_figure():
    figure = read_figure("clavicles")
    frames = surroundings.site_frames(figure)
    assert sum(map(len, frames.values())) == sum(
        len(each.sites) for each in figure.segments.values()
    )
    segment = figure.segments["left_upper_arm"]
    for site, frame in zip(segment.sites.values(), frames["left_upper_arm"], strict=True):
        assert np.array_equal(frame, site.pose_in_segment)


def test_frames_of_joints_are_those_of_both_sites():
    figure = read_figure("fourbar")
    frames = surroundings.joint_frames(figure)
    assert sum(map(len, frames.values())) == 8
    crank = figure.segments["crank"].sites
    assert np.array_equal(
        frames["crank"], [crank["near"].pose_in_segment, crank["far"].pose_in_segment]
    )


@given(points=st.lists(st.tuples(*[st.floats(-50.0, 50.0)] * 3), min_size=1, max_size=4))
def test_the_ground_has_whole_sections_and_reaches_beyond_the_figure(
    points: list[tuple[float, float, float]],
):
    width = surroundings.ground_width(np.array(points))
    assert (width / (8.0 * surroundings.GRID_CELL)).is_integer()
    assert width >= 2.0 * surroundings.MIN_GROUND_REACH
    assert width >= 4.0 * np.abs(np.array(points)[:, [0, 2]]).max()
