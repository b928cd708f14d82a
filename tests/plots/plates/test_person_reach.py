"""The plate of the reach: what it meets, and that its boundary is that of the law."""

import numpy as np
import pytest

from plots.plates.person_reach import POSITIONS, collect_arm, raised


@pytest.mark.slow
def test_outside_the_drawn_boundary_the_shoulder_drives_the_arm_back() -> None:
    """A step outwards from it costs energy; the positions of people are inside."""
    arm = collect_arm()
    for plane, elevation in arm.boundary[::6]:
        if elevation < 170.0:
            near, far = (arm.law.energy(raised(plane, elevation + d)) for d in (0.0, 5.0))
            assert far > near
            assert arm.reach.depth(raised(plane, elevation)) == pytest.approx(
                0.0, abs=np.radians(1.5)
            )
    for plane, elevation, _ in POSITIONS.values():
        assert arm.reach.depth(raised(plane, elevation)) < 0.0
