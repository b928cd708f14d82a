"""Flip one sign, unit, sense, bound or format detail at a time: some test must fail each time.

Run by hand in the project's folder:

    python tests/flip.py             # all flips, 5 to 10 minutes on one core
    python tests/flip.py mirror cm   # those whose description contains one of the words

Each flip replaces a text that occurs once in a room of the packages, in a temporary copy, and runs
the tests that should notice, the slow ones and those that need other programs last. The first test
that fails is printed. A flip that survives, a text that is not found and a pattern that no file of
tests matches make the exit code 1.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
COPIED = ("generator", "springs", "plots", "figures", "tests", "docs", "benchmarks")
COPIED_FILES = ("pyproject.toml", "README.md", "CHANGELOG.md", "LICENSE")


class Flip(NamedTuple):
    """A change that some test must notice.

    Attributes:
        what: the detail.
        room: the file or folder in which `old` stands exactly once.
        old: text before.
        new: text after.
        tests: files, folders or patterns below `tests` to run, separated by blanks.
    """

    what: str
    room: str
    old: str
    new: str
    tests: str


LAWS = "properties/test_laws.py springs/test_{}*.py"
SPRINGS = "springs properties/test_laws.py"
KINEMATICS = "generator/kinematics"
MOTIONS = "generator/motion_files properties/test_round_trips.py"
MODELS = "generator/model_files"
MODEL_TESTS = "generator/model_files properties/test_round_trips.py"
SIMULATION = "generator/simulation"
EXUDYN_MODEL = "generator/simulation/exudyn_model"
COMPILED = "generator/simulation/compiled"
COMPILED_TESTS = COMPILED + "/test_{}.py"
STUDY = "generator/study"
STUDY_TESTS = "generator/study/test_{}.py"
MOTION_FILES = "generator/motion_files"
HOLD = "generator/hold"
HOLD_TESTS = "generator/hold generator/cli/test_hold.py"

FLIPS = (
    # Laws
    Flip("sign of a linear spring", "springs", "(self.rest - angle) * self.stiffness",
         "(angle - self.rest) * self.stiffness", LAWS.format("linear")),
    Flip("sense in which a cubic restores", "springs", "return -1 if c3 > 0.0 else 1",
         "return 1 if c3 > 0.0 else -1", LAWS.format("cubic")),
    Flip("lower edge of a dead zone", "springs", "return ops.where(a < low, below",
         "return ops.where(a > low, below", LAWS.format("cubic")),
    Flip("mirror image of a cubic", "springs", "Cubic((-c0, c1, -c2, c3)", "Cubic((c0, c1, c2, c3)",
         LAWS.format("cubic")),
    Flip("energy of a cubic", "springs", "return -antiderivative(", "return antiderivative(", LAWS.format("cubic")),
    Flip("sign of viscous damping", "springs", "-self.viscous * rate", "self.viscous * rate",
         "springs/test_damping.py springs"),
    Flip("sign of Coulomb friction", "springs", "torque - self.coulomb * ops.tanh",
         "torque + self.coulomb * ops.tanh", "springs/test_damping.py springs"),
    Flip("sign of the lower stop", "springs/stop.py", "return below - above", "return -below - above", LAWS.format("stop")),
    Flip("onset of a stop in degrees", "springs", "DEFAULT_STOP_ONSET = radians(1.0)",
         "DEFAULT_STOP_ONSET = 1.0", "springs/test_stop.py springs generator/springs_file"),
    Flip("energy of an exponential", "springs", "-t.amplitude / t.rate", "t.amplitude / t.rate",
         LAWS.format("exponential")),
    Flip("stiffness below a smooth limit", "springs",
         "self.lower_stiffness and function(", "self.upper_stiffness and -function(", LAWS.format("smooth_limit")),
    Flip("mirror image of an interpolated curve", "springs", "((-angle, -torque) for",
         "((-angle, torque) for", LAWS.format("interpolated")),
    Flip("half-way factor of a spherical joint", "springs", "1.0 + excess * a * a",
         "1.0 - excess * a * a", "springs/test_spherical*.py properties/test_laws.py"),
    # Strength
    Flip("sign of the moments of a posture", HOLD, "forces -= rows", "forces += rows", HOLD_TESTS),
    Flip("passive share of a moment", HOLD, "active = total - own", "active = total + own", HOLD_TESTS),
    Flip("shift of the supports", HOLD, "0.0, -residual[0] / weight", "0.0, residual[0] / weight",
         HOLD_TESTS),
    Flip("angle of an opposite motion", "springs/strength", "self.own.torque(-np.asarray(angle",
         "self.own.torque(np.asarray(angle", "springs/strength"),
    Flip("people above a demand", "springs/strength", "(capacity - demand) / deviation",
         "(demand - capacity) / deviation", "springs/strength"),
    # Units
    Flip("radians in a degree", "generator/units.py", '"deg": Unit(PI / 180', '"deg": Unit(PI / 200',
         "generator/test_units.py"),
    Flip("newtons in a dyne", "generator/units.py", '"dyn": Unit(Fraction(1, 100_000)',
         '"dyn": Unit(Fraction(1, 10_000)', "generator/test_units.py"),
    Flip("a unit after `/` divides", "generator/units.py", "sign = -1 if place else 1",
         "sign = 1 if place else 1", "generator/test_units.py"),
    # Rotations and mass properties
    Flip("order of xyz()", "generator/rotations.py",
         "matrix_from_axis_angle(x, a) @ matrix_from_axis_angle(y, b)",
         "matrix_from_axis_angle(y, b) @ matrix_from_axis_angle(x, a)", "generator/test_rotations.py"),
    Flip("order of a joint's chain", "generator/rotations.py",
         "matrix = matrix_from_axis_angle(axis, values[..., index]) @ matrix",
         "matrix = matrix @ matrix_from_axis_angle(axis, values[..., index])",
         "generator/test_rotations.py"),
    Flip("translation of an inverse pose", "generator/rotations.py", "-(turned @ x[..., :3, 3:])",
         "(turned @ x[..., :3, 3:])", "generator/test_rotations.py"),
    Flip("parallel axis theorem", "generator/inertia.py",
         "self.inertia + self.mass * _unit_point_inertia", "self.inertia - self.mass * _unit_point_inertia",
         "generator/test_inertia.py"),
    Flip("rotation of an inertia tensor", "generator/inertia.py", "@ self.inertia @", ".T @ self.inertia.T @",
         "generator/test_inertia.py"),
    # Kinematics
    Flip("sense of a rotation in the mirror", KINEMATICS, "concatenate([-_MIRROR_SIGNS, _MIRROR_SIGNS])",
         "concatenate([_MIRROR_SIGNS, _MIRROR_SIGNS])",
         KINEMATICS + "/test_links_mirror.py " + KINEMATICS),
    Flip("side of the tree that moves", KINEMATICS, "sense = 1.0 if branch.parent_is_inboard else -1.0",
         "sense = -1.0 if branch.parent_is_inboard else 1.0", KINEMATICS + "/test_tree*.py " + KINEMATICS),
    Flip("weights of the centre of mass", KINEMATICS, "return self.masses / self.total",
         "return 0.0 * self.masses + 1.0 / len(self.masses)", KINEMATICS + "/test_centre_of_mass.py"),
    Flip("sign of the stability margin", KINEMATICS, "Balance.INSIDE if margin > 0.0",
         "Balance.INSIDE if margin < 0.0", KINEMATICS + "/test_stability*.py"),
    Flip("width of the support's edge", KINEMATICS, "EDGE_TOLERANCE = 1e-6", "EDGE_TOLERANCE = 1e-2",
         KINEMATICS + "/test_stability*.py generator/cli"),
    Flip("zero of the longitude of an arm", KINEMATICS, "abduction = QUARTER_TURN - theta",
         "abduction = theta - QUARTER_TURN", KINEMATICS + "/test_shoulder*.py"),
    Flip("mirror plane of the shoulder", KINEMATICS, "np.array([1.0, -1.0, 1.0])",
         "np.array([-1.0, 1.0, 1.0])", KINEMATICS + "/test_shoulder*.py"),
    # Geometry
    Flip("volume of a tetrahedron", "generator/geometry", "self.determinants.sum()) / 6.0",
         "self.determinants.sum()) / 3.0", "generator/geometry"),
    # Motion files
    Flip("length unit of action files", "generator/units.py", '"cm", 100.0, "m"',
         '"mm", 100.0, "m"', MOTIONS),
    Flip("normalised time of action files", "generator/motion_files", "(times - times[0]) / (whole",
         "times / (whole", MOTIONS),
    Flip("degrees in .mot files", "generator/motion_files", "np.degrees(values) if in_degrees",
         "np.degrees(values) if not in_degrees", MOTIONS),
    Flip("radians of .mot files that are read", "generator/motion_files",
         "np.radians(values) if self.in_degrees", "np.radians(values) if not self.in_degrees", MOTIONS),
    Flip("order of rotations in .bvh files", "generator/motion_files", "near[::-1]", "near", MOTIONS),
    Flip("length unit of .bvh files", "generator/motion_files", "CENTIMETRES_PER_METRE = 100.0",
         "CENTIMETRES_PER_METRE = 1000.0", MOTIONS),
    Flip("metres in .glb files", "generator/motion_files", "places = (bone.offset + shifts)",
         "places = 100.0 * (bone.offset + shifts)", MOTIONS),
    Flip("order of a quaternion in .glb files", "generator/motion_files",
         "Rotation.from_matrix(matrices).as_quat()",
         "Rotation.from_matrix(matrices).as_quat(scalar_first=True)", MOTIONS),
    # Model files
    Flip("damping of MJCF joints", MODELS,
         'element.set("damping", format_numbers(spring.damping.viscous))',
         'element.set("damping", format_numbers(2.0 * spring.damping.viscous))', MODEL_TESTS),
    Flip("order of a quaternion in MJCF", "generator/rotations.py", "w, x, y, z = quaternion",
         "x, y, z, w = quaternion", MODELS + "/mjcf " + MODEL_TESTS),
    Flip("axis of a reversed URDF joint", MODELS, "axis = sign * unit_vector(",
         "axis = unit_vector(", MODEL_TESTS),
    Flip("degrees of OpenSim's limit forces", MODELS, "lower / _DEGREES_PER_RADIAN - dof.offset",
         "lower - dof.offset", MODEL_TESTS),
    Flip("range of OpenSim coordinates", MODELS, "(min(low, start), max(high, start))",
         "(max(low, start), min(high, start))", MODEL_TESTS),
    Flip("rows of DYSPAM's springs", MODELS, "{spring.joint} {stiffness} {damping} {rest}",
         "{spring.joint} {damping} {stiffness} {rest}", MODEL_TESTS),
    # Simulation
    Flip("direction of gravity", SIMULATION, "(0.0, -9.81, 0.0)", "(0.0, 9.81, 0.0)",
         SIMULATION + "/test_plan.py " + EXUDYN_MODEL),
    Flip("frame of local loads", SIMULATION, "bodyFixed=load.kind.is_local",
         "bodyFixed=not load.kind.is_local", EXUDYN_MODEL + "/test_bodies.py " + SIMULATION),
    Flip("initial velocity of a body", SIMULATION, "motion[3:] + np.cross(motion[:3]",
         "motion[3:] - np.cross(motion[:3]", EXUDYN_MODEL + "/test_bodies.py " + SIMULATION),
    Flip("sign of the potential energy", SIMULATION, "gravity = -np.sum(masses", "gravity = np.sum(masses",
         SIMULATION + "/test_joint_motion*.py physics/test_energy_balance.py physics"),
    Flip("sign of a constraint's reaction", SIMULATION, "force = -(first @ multipliers",
         "force = (first @ multipliers", SIMULATION + "/test_joint_motion*.py " + SIMULATION),
    Flip("comparison with the tolerance", SIMULATION, "if estimate <= asked", "if estimate >= asked",
         SIMULATION + "/test_exudyn_run_accuracy.py " + SIMULATION),
    Flip("until when the tolerance holds", SIMULATION, "= times[errors <= tolerance]",
         "= times[errors >= tolerance]", SIMULATION + "/test_exudyn_run_accuracy.py " + SIMULATION),
    # Compiled integration
    Flip("sign of a switching function", COMPILED,
         '"{} - {}", comparison.larger, comparison.smaller',
         '"{} - {}", comparison.smaller, comparison.larger', COMPILED_TESTS.format("recorder")),
    Flip("Coriolis acceleration of a slide", COMPILED, "times(2.0, cross(spin, along))",
         "times(1.0, cross(spin, along))", COMPILED_TESTS.format("recursion")),
    Flip("end of an elastic ball at a half turn", COMPILED, "                return TURNED_OVER",
         "                pass", COMPILED_TESTS.format("marching")),
    Flip("first of several breakpoints in a step", COMPILED,
         "> 0.0\n                ):\n                    continue",
         "< 0.0\n                ):\n                    continue", COMPILED_TESTS.format("marching")),
    Flip("error estimate of compiled runs", COMPILED, "errors[: len(known)] = known",
         "errors[: len(known)] = 0.1 * known", COMPILED_TESTS.format("refinement")),
    Flip("agreement of compiled runs", COMPILED, "bool(errors[-1] <= tolerance)",
         "bool(errors[-1] <= 100.0 * tolerance)", COMPILED_TESTS.format("refinement")),
    Flip("gravity in accelerations of compiled runs", SIMULATION,
         "accelerations + np.asarray(gravity", "accelerations - np.asarray(gravity",
         SIMULATION + "/test_compiled_run.py"),
    # Commands and claims
    Flip("exit code of a failed run", "generator/cli", "RUN_FAILED = 3", "RUN_FAILED = 4", "generator/cli"),
    Flip("bounds of a claim", "plots/plate.py", "self.at_least <= value <= self.at_most",
         "self.at_least <= value", "plots/test_plate*.py plots"),
    # Studies
    Flip("study: factor of an elastic torque", "springs/axis.py", "return (transform(law, elastic),)",
         "return (transform(law, 1.0),)", STUDY_TESTS.format("parameters")),
    Flip("study: side to which an offset goes", STUDY,
         "by = target.sign * parallel_sign(spring.direction, target.direction) * offset",
         "by = parallel_sign(spring.direction, target.direction) * offset",
         STUDY_TESTS.format("parameters")),
    Flip("study: mirror image of a pose", STUDY, "values[target.index] = target.sign * value",
         "values[target.index] = value", STUDY_TESTS.format("parameters")),
    Flip("study: half of a directional law", "springs/axis.py", "rest = 0.5 * (elastic - friction)",
         "rest = elastic - friction", STUDY_TESTS.format("parameters")),
    Flip("study: radius of gyration", STUDY, "mass, factor = value, value / mass",
         "mass, factor = value, 1.0", STUDY_TESTS.format("parameters")),
    Flip("study: mass of a mass index", STUDY, "mass *= stature**2", "mass *= stature",
         STUDY_TESTS.format("parameters")),
    Flip("study: measures in the key", STUDY, 'name="", model=model, sensitivity=None)',
         'name="", model=model, sensitivity=None, measures={})', STUDY_TESTS.format("content_key")),
    Flip("study: surfaces in the key", STUDY, "_surfaces(model.figure), versions))",
         "versions))", STUDY_TESTS.format("content_key")),
    Flip("study: runs that a folder has", STUDY, "np.flatnonzero(~results.finished), folder",
         "np.arange(len(points)), folder",
         STUDY_TESTS.format("sweep")),
    Flip("study: failed runs that are repeated", STUDY, "if again_failed:", "if not again_failed:", STUDY_TESTS.format("sweep")),
    Flip("study: torn line of a journal", STUDY, 'if line.endswith(b"\\n"))', 'if line)',
         STUDY_TESTS.format("journal")),
    Flip("study: exact numbers of a table", STUDY, "repr(float(cell))", 'f"{cell:.9g}"',
         STUDY_TESTS.format("run_table")),
    Flip("study: second start of a run", STUDY, "if worker.retry is None:\n            self._tasks",
         "if worker.retry is not None:\n            self._tasks",
         STUDY_TESTS.format("worker_pool")),
    Flip("study: column of the radial design", STUDY, "points[:, 2 + k, k] = b[:, k]",
         "points[:, 2 + k, k] = b[:, 0]", STUDY_TESTS.format("designs")),
    Flip("study: total index", STUDY, "0.5 * square / variance", "square / variance",
         STUDY_TESTS.format("sensitivity")),
    Flip("study: peak of the ground force", MOTION_FILES, "if contact.extreme_forces is None:",
         "if True:", STUDY_TESTS.format("measures")),
    Flip("study: peak force on a segment", MOTION_FILES,
         "    if sign > 0:\n        return contact.seg", "    if sign > 9:\n        return contact.seg",
         STUDY_TESTS.format("measures")),
    Flip("study: sign of a smallest number", MOTION_FILES, "return time, sign * size",
         "return time, size", STUDY_TESTS.format("measures")),
    Flip("study: runs one after the other", COMPILED, "    if threads > 1:\n        thread.start()",
         "    tolerances[-2] *= 1.0 if threads > 1 else 0.9\n    if threads > 1:\n"
         "        thread.start()", "generator/simulation/test_run.py"),
)  # fmt: skip


def sources(folder: Path, room: str) -> list[Path]:
    """The modules of a room."""
    place = folder / room
    return [place] if place.is_file() else sorted(place.rglob("*.py"))


def place_of(folder: Path, flip: Flip) -> Path | None:
    """The one module in which the text stands, once; None where it does not."""
    texts = [(path, path.read_text(encoding="utf-8")) for path in sources(folder, flip.room)]
    found = [path for path, text in texts for _ in range(text.count(flip.old))]
    return found[0] if len(found) == 1 else None


def stages(folder: Path, flip: Flip) -> list[list[str]]:
    """The tests of a flip, one run for each word of `tests`."""
    tests = folder / "tests"
    return [sorted(map(str, tests.glob(pattern))) for pattern in flip.tests.split()]


def stale(folder: Path, flip: Flip) -> list[str]:
    """What a row names that is no longer there: a text of the packages, files of tests."""
    missing = [] if place_of(folder, flip) else [f"not once in {flip.room}: {flip.old!r}"]
    patterns = zip(flip.tests.split(), stages(folder, flip), strict=True)
    return missing + [f"no file: tests/{pattern}" for pattern, paths in patterns if not paths]


def failing_test(folder: Path, paths: list[str], marks: str) -> str:
    """Run tests until the first failure, also one of collection; its name, "" where all pass."""
    options = ["-q", "-x", "-rfE", "--no-header", "-m", marks]
    options += ["-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:cov"]
    environment = {**os.environ, "PYTHONPATH": str(folder), "CI": "true", "PYTEST_ADDOPTS": ""}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # else each run compiles all modules again
    command = [sys.executable, "-m", "pytest", *options, *paths]
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode not in (1, 2):
        return ""
    told = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", done.stdout, re.MULTILINE)
    return told[1] if told else "collection"


def first_notice(folder: Path, flip: Flip) -> str:
    """Apply a flip to the copy, run its tests, restore the copy; the first test that fails."""
    path = place_of(folder, flip)
    assert path is not None
    before = path.read_text(encoding="utf-8")
    path.write_text(before.replace(flip.old, flip.new), encoding="utf-8")
    try:
        runs = (failing_test(folder, paths, marks)
                for marks in ("not slow and not verify", "slow or verify")
                for paths in stages(folder, flip))  # fmt: skip
        return next(filter(None, runs), "")
    finally:
        path.write_text(before, encoding="utf-8")


def main(words: list[str]) -> int:
    """Print a row for each chosen flip; 1 unless all are noticed."""
    outdated = [f"{flip.what}: {fault}" for flip in FLIPS for fault in stale(ROOT, flip)]
    if outdated:
        sys.exit("\n".join(outdated))
    chosen = [flip for flip in FLIPS if not words or any(word in flip.what for word in words)]
    noticed = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        ignored = shutil.ignore_patterns("__pycache__", ".hypothesis")
        for name in COPIED:
            shutil.copytree(ROOT / name, folder / name, ignore=ignored)
        for name in COPIED_FILES:
            shutil.copy(ROOT / name, folder / name)
        everything = {path for flip in chosen for paths in stages(folder, flip) for path in paths}
        if failing_test(folder, ["--collect-only", *sorted(everything)], ""):
            sys.exit("the tests cannot be collected")
        for flip in chosen:
            began = time.monotonic()
            test = first_notice(folder, flip)
            noticed += bool(test)
            took = time.monotonic() - began
            print(f"{flip.what:<42} {took:4.0f} s  {test or 'SURVIVED'}", flush=True)
    print(f"{noticed} of {len(chosen)} flips noticed")
    return 0 if noticed == len(chosen) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
