"""Mass properties of a ball of 100,000 triangles, beside trimesh's own on the same mesh.

Run with `python -m benchmarks.geometry`. Best of several runs, turn by turn; the ratios count. Both
start from plain arrays each time, since both keep what they have found.
"""

import platform
import time
from collections.abc import Callable, Mapping
from fractions import Fraction
from importlib.metadata import version

import numpy as np
import trimesh

from generator.geometry import PSURF_FILE, Surface, format_psurf, mass_properties
from generator.geometry.surface import build_tetrahedra

ROUNDS = 9


def main() -> None:
    """Print the table."""
    ball = trimesh.creation.uv_sphere(count=[160, 160])
    vertices, faces = np.array(ball.vertices), np.array(ball.faces)
    print(f"Python {platform.python_version()}, trimesh {version('trimesh')}, {platform.machine()}")
    print(f"a ball of {len(faces):,} triangles, best of {ROUNDS} runs")

    def mesh() -> trimesh.Trimesh:
        return trimesh.Trimesh(vertices, faces, process=False)

    def checked_mesh() -> object:
        one = mesh()
        return one.is_volume, one.body_count, one.mass_properties

    rows = {
        "integrals": (
            lambda: build_tetrahedra(Surface.from_faces(vertices, faces)).mass_properties(1000.0),
            lambda: mesh().mass_properties,
        ),
        "soundness and integrals": (
            lambda: mass_properties(Surface.from_faces(vertices, faces), 1000.0),
            checked_mesh,
        ),
    }
    for name, (ours, theirs) in rows.items():
        times = best({"here": ours, "trimesh": theirs})
        print(
            f"  {name:<24} {1e3 * times['here']:6.1f} ms; trimesh "
            f"{1e3 * times['trimesh']:6.1f} ms; ratio {times['here'] / times['trimesh']:.2f}"
        )
    text = format_psurf(Surface.from_faces(vertices, faces), Fraction(1))
    reading = best({"psurf": lambda: PSURF_FILE.parse_text(text, unit=Fraction(1))}, rounds=2)[
        "psurf"
    ]
    print(f"  reading it as a psurf of {len(text) / 1e6:.1f} MB: {reading:.2f} s")


def best(runs: Mapping[str, Callable[[], object]], rounds: int = ROUNDS) -> dict[str, float]:
    """Best time of each [s]; they take turns, so that a slow moment hits all of them."""
    times = dict.fromkeys(runs, np.inf)
    for _ in range(rounds):
        for name, run in runs.items():
            began = time.perf_counter()
            run()
            times[name] = min(times[name], time.perf_counter() - began)
    return times


if __name__ == "__main__":
    main()
