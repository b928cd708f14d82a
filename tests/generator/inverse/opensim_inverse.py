"""Inverse dynamics by OpenSim's own tool, and the difference of `mover inverse` from it.

    python -m tests.generator.inverse.opensim_inverse MODEL.osim WALK.sto GRF.xml

prints the largest and the root-mean-square difference of each moment, half a second from both ends,
each program with its own filter at 6 Hz.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np
import pytest

from generator.conversion import read_motion_with_warnings
from generator.inverse.external_loads import read_external_loads
from generator.inverse.moments import joint_moments
from generator.model_files.formats import read_model
from generator.motion_files import COORDINATES_FILE
from generator.motion_files.opensim_table import write_sto
from generator.rotations import Array
from tests.generator.inverse.walking import LOADS


def opensim() -> Any:
    osim: Any = pytest.importorskip("opensim")
    osim.Logger.setLevelString("Error")
    osim.Logger.removeFileSink()
    return osim


def inverse_dynamics(
    model: Path, motion: Path, folder: Path, cutoff: float | None = None, loads: Path = LOADS
) -> tuple[Array, dict[str, Array]]:
    """Times and moments of OpenSim's tool by the titles of their columns."""
    osim = opensim()
    tool = osim.InverseDynamicsTool()
    tool.setModelFileName(str(model))
    tool.setCoordinatesFileName(str(motion))
    tool.setLowpassCutoffFrequency(-1.0 if cutoff is None else cutoff)
    table = COORDINATES_FILE.read(motion)
    tool.setStartTime(float(table.times[0]))
    tool.setEndTime(float(table.times[-1]))
    excluded = osim.ArrayStr()
    excluded.append("Muscles")
    tool.setExcludedForces(excluded)
    tool.setExternalLoadsFileName(str(loads))
    tool.setResultsDir(str(folder))
    tool.setOutputGenForceFileName("opensim.sto")
    assert tool.run()
    found = COORDINATES_FILE.read(folder / "opensim.sto")
    titles = [title.text for title in found.titles]
    return found.times, dict(zip(titles, found.numbers.T, strict=True))


def main() -> None:
    """Print the differences of a walk."""
    model, motion, loads = (Path(word).resolve() for word in sys.argv[1:4])
    imported, cutoff = read_model(model), 6.0
    figure, coordinates = imported.figure, imported.coordinates
    walk, _ = read_motion_with_warnings(motion, figure, coordinates)
    forces, _ = read_external_loads(loads, figure)
    gravity = tuple(float(x) for x in opensim().Model(str(model)).getGravity().to_numpy())
    started = perf_counter()
    ours = joint_moments(walk, coordinates, forces, cutoff, gravity)
    own_time = perf_counter() - started
    with TemporaryDirectory() as name:
        folder = Path(name)
        started = perf_counter()
        write_sto(walk, folder / "plain.sto")  # OpenSim's tool does not find columns by paths
        times, theirs = inverse_dynamics(model, folder / "plain.sto", folder, cutoff, loads)
        their_time = perf_counter() - started
    kept = ours.kept
    print("coordinate                  largest     rms")
    for one in ours.coordinates.values():
        difference = one.forces - np.interp(ours.times, times, theirs[one.label])
        rms = np.sqrt(np.mean(difference[kept] ** 2))
        print(f"{one.label:26s} {np.abs(difference[kept]).max():8.4f} {rms:8.4f}")
    count = len(ours.times)
    own, their = (1e6 * time / count for time in (own_time, their_time))
    print(f"{own:.0f} us a frame, OpenSim {their:.0f} with reading and writing files")


if __name__ == "__main__":
    main()
