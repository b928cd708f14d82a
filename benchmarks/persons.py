"""Random persons from their measures to a run: `python -m benchmarks.persons [PERSONS]`.

Statures and masses cover ANSUR II's range and 20 % beyond; every other person has some measured
dimensions. Each is written, read again, checked, brought to equilibrium with the pelvis fixed, and
simulated for 0.2 s. Two processes share the work, half an hour for 1,000 persons.
"""

import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from generator import Plan, read_figure, read_springs, simulate
from generator.diagnostics import MoverError
from generator.figure_file import FIGURE_FILE
from generator.geometry.intersections import triangulate
from generator.geometry.validate import build_solid, winding_numbers
from generator.model import Model
from generator.person.measures import Measures, estimate_measures
from generator.person.person import Person, build_person
from generator.person.person_files import person_files
from generator.person.survey import Sex, survey
from generator.simulation.preconditions import import_exudyn, simulation_obstacles
from generator.simulation.statics.equilibrium import find_equilibrium

PERSONS = 1000
BEYOND = 0.2
"""Share by which statures and masses leave the survey's range at either end."""

SPREAD = 2.0
"""Largest difference of a measured dimension from the expected one, in standard errors."""

MEASURABLE = (
    "acromion_radiale_length",
    "biacromial_breadth",
    "calf_circumference",
    "foot_length",
    "hand_length",
    "neck_circumference",
    "thigh_circumference",
    "trochanterion_height",
    "waist_circumference",
)
"""Dimensions of which some are measured."""

PROGRESS_INTERVAL = 50
"""Persons between two lines of progress."""

STOP = 0.2
"""Duration of a run [s]."""


def draw_measures(seed: int) -> Measures:
    """Return the measures of a random person, a man for even seeds."""
    random = np.random.default_rng(seed)
    sex = Sex.FEMALE if seed % 2 else Sex.MALE
    sample = survey().samples[sex]
    stature = random.uniform(
        (1.0 - BEYOND) * sample.stature.smallest, (1.0 + BEYOND) * sample.stature.largest
    )
    usual = sample.mass.mean * (stature / sample.stature.mean) ** 2
    mass = usual * random.uniform(
        (1.0 - BEYOND) * sample.mass.smallest / sample.mass.mean,
        (1.0 + BEYOND) * sample.mass.largest / sample.mass.mean,
    )
    expected = estimate_measures(sex, stature, mass).dimensions
    count = random.integers(1, 4) if random.random() < 0.5 else 0
    measured = {
        name: expected[name].expected
        + random.uniform(-SPREAD, SPREAD) * expected[name].standard_error
        for name in random.choice(MEASURABLE, count, replace=False)
    }
    return estimate_measures(sex, stature, mass, measured)


def find_faults(person: Person, folder: Path, stop: float = STOP) -> Iterator[str]:
    """Yield a sentence for each thing that is wrong with a person.

    Args:
        person: to be written, read, checked, brought to equilibrium and simulated.
        folder: where its files are written.
        stop: duration of the run [s].
    """
    yield from _body_faults(person)
    path = folder / "person.fig"
    person_files(person, path).write()
    yield from (fault.message for fault in FIGURE_FILE.parse_file(path).diagnostics)
    figure = read_figure(path)
    springs = read_springs(None, figure)
    yield from (fault.message for fault in simulation_obstacles(Model.of(figure)))
    rest = find_equilibrium(figure, Plan(springs=springs, locked=("root_torso",)))
    if rest.has_growing_motions:
        yield f"the equilibrium {rest.state}"
    recording = simulate(figure, Plan(stop=stop, springs=springs))
    if not recording.outcome.succeeded:
        yield recording.outcome.message


def _body_faults(person: Person) -> Iterator[str]:
    """Yield what is wrong with masses, inertias and surfaces."""
    figure = person.figure
    if abs(figure.total_mass - person.measures.mass) > 1e-9:
        yield f"the segments weigh {figure.total_mass!r} kg"
    for part in person.body.segments.values():
        a, b, c = sorted(part.inertia)
        if not (part.mass > 0.0 and a > 0.0 and c <= a + b):
            yield f"{part.name}: mass {part.mass:g} kg, inertia {part.inertia} kg m2"
    triangles: dict[str, np.ndarray] = {}
    for name, surface in person.surfaces.items():
        try:
            solid = build_solid(surface)
        except MoverError as failure:
            yield f"{name}: {failure}"
            continue
        if not solid.volume > 0.0:
            yield f"{name}: volume {solid.volume:g} m3"
        corners, _ = triangulate(surface)
        triangles[name] = corners
    for joint in figure.joints.values():
        for end in joint.ends:
            name = end.segment.removeprefix("left_").removeprefix("right_")
            if name in triangles:
                centre = figure.site(end).pose_in_segment[:3, 3]
                if winding_numbers(triangles[name], centre[None])[0] < 0.5:
                    yield f"{joint.name} is outside the surface of {end.segment}"


def _try_person(seed: int, folder: Path) -> list[str]:
    """Return the faults of the person of a seed, with any exception among them."""
    try:
        measures = draw_measures(seed)
        own = folder / str(seed)
        own.mkdir()
        return list(find_faults(build_person(measures), own))
    except Exception as failure:  # it belongs to the report
        return [f"{type(failure).__name__}: {failure}"]


def main() -> None:
    """Print the number of persons with faults, and the first of each kind."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else PERSONS
    import_exudyn()
    with TemporaryDirectory() as folder, ProcessPoolExecutor(2) as pool:
        faults: list[list[str]] = []
        for found in pool.map(partial(_try_person, folder=Path(folder)), range(count)):
            faults.append(found)
            if len(faults) % PROGRESS_INTERVAL == 0:
                print(f"{len(faults)} persons, {sum(map(bool, faults))} with faults", flush=True)
    wrong = [seed for seed in range(count) if faults[seed]]

    print(f"{count} persons, {len(wrong)} with faults")
    kinds = Counter(fault.split(":")[0] for each in faults for fault in dict.fromkeys(each))
    for kind, number in kinds.most_common(20):
        first = next(seed for seed in wrong if any(f.split(":")[0] == kind for f in faults[seed]))
        text = next(f for f in faults[first] if f.split(":")[0] == kind)
        print(f"  {number} x, first of seed {first}: {text}")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
