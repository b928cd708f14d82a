"""The fall of the prototype with bent hips, shoulder and waist, in MuJoCo and here.

`python -m tests.generator.model_files.bent_fall` prints the largest distance of a segment's site.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from generator.figure import Figure
from generator.figure_file import read_figure
from generator.model_files.mjcf.passive import PassiveSprings
from springs import SphericalLaw, SpringSet
from tests.generator.model_files.engines import MuJoCo, moved
from tests.generator.model_files.model_cases import ours, own_springs, posed

BENT = {
    "left_hip_joint": (0.0, 0.0, 60.0),
    "right_hip_joint": (0.0, 0.0, -15.0),
    "right_shoulder": (0.0, 0.0, 110.0),
    "waist": (0.0, 0.0, 25.0),
}
"""Displacements [deg] as of `--set`; the third one of these joints is flexion."""

STOP = 0.4
"""Time of the fall [s]."""

Motion = Mapping[str, np.ndarray]


def bent_prototype() -> Figure:
    """The prototype in its pose at the start."""
    return posed(read_figure("prototype"), BENT)


@cache
def our_fall(law: SphericalLaw = SphericalLaw.CONSERVATIVE) -> Motion:
    """Our motion of the segments under a law, shape (frames, 4, 4)."""
    of = bent_prototype()
    return ours(of, replace(own_springs(of), law=law), STOP).poses


def fall_in_file(finer: int = 1) -> Motion:
    """The motion of the model under the law of coordinates, with a fraction of its time step."""
    of = bent_prototype()
    loaded = MuJoCo(of, replace(own_springs(of), law=SphericalLaw.COORDINATES))
    loaded.model.opt.timestep /= finer
    return moved(loaded, STOP)


def fall_with_callback() -> Motion:
    """The motion of the model written without springs, with the springs as a callback."""
    of = bent_prototype()
    loaded = MuJoCo(of, SpringSet())
    loaded.api.set_mjcb_passive(PassiveSprings(loaded.model, of, own_springs(of)))
    try:
        return moved(loaded, STOP)
    finally:
        loaded.api.set_mjcb_passive(None)


def site_distance(one: Motion, other: Motion) -> float:
    """Largest distance of any site of a moving segment at the frames of two motions [m]."""
    of = bent_prototype()
    distances = [
        np.linalg.norm(((one[name] - other[name]) @ site.pose_in_segment)[:, :3, 3], axis=1).max()
        for name, segment in of.bodies.items()
        for site in segment.sites.values()
    ]
    return float(max(distances))


def main() -> None:
    """Print the table."""
    print("| springs in MuJoCo | largest distance of a site |")
    print("|---|---|")
    coordinates, own = our_fall(SphericalLaw.COORDINATES), our_fall()
    for name, motion, expected in (
        ("of the file, law of coordinates", fall_in_file(), coordinates),
        ("of the file, a quarter of its step", fall_in_file(4), coordinates),
        ("callback", fall_with_callback(), own),
        ("none", moved(MuJoCo(bent_prototype(), SpringSet()), STOP), own),
    ):
        print(f"| {name} | {1000.0 * site_distance(motion, expected):.2f} mm |", flush=True)


if __name__ == "__main__":
    main()
