"""Figures and their motion: the public names of exudyn-mover.

Each name is imported at its first use, so that a script which does not simulate does not wait for
Exudyn.
"""

import sys
from importlib import import_module
from importlib.util import find_spec
from os.path import basename, dirname, realpath, splitext
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from generator.contact_record import (
        ContactRecord,
        centre_of_pressure,
        head_injury_criterion,
    )
    from generator.conversion import convert
    from generator.diagnostics import InputError, ModelError, MoverError, UsageError
    from generator.figure import (
        Attribute,
        AxisKind,
        ContactSphere,
        Figure,
        Joint,
        JointAxis,
        Location,
        Rotation,
        Segment,
        Site,
        SiteRef,
        Translation,
    )
    from generator.figure_file import read_figure
    from generator.figure_file.write import write_figure, write_pose
    from generator.identification.fit import FitOptions, fit_springs
    from generator.identification.measured_angles import read_measured_angles
    from generator.input_files.pose import read_pose
    from generator.input_files.scene import read_scene
    from generator.kinematics.centre_of_mass import centre_of_mass, centre_of_mass_jacobian
    from generator.kinematics.placement import forward_kinematics, initial_displacements
    from generator.kinematics.stability import stability
    from generator.kinematics.tree import build_tree
    from generator.kinematics.tree import build_tree as hang
    from generator.motion_files import ActionFile, read_action, read_npz, write_recording
    from generator.named_mapping import UnknownNameError, by_name
    from generator.person.measures import estimate_measures
    from generator.person.person import Person, build_person
    from generator.person.survey import Sex
    from generator.recording import Ending, Integrator, Outcome, Recording, RecordingPart
    from generator.scene import Box, Plane, Prop, Scene
    from generator.simulation.model import ExudynModel, build_model
    from generator.simulation.plan import Plan
    from generator.simulation.run import Progress, simulate
    from generator.simulation.statics import static_torques
    from generator.simulation.stepper import Stepper
    from generator.springs_file.read import read_springs
    from generator.study.designs import design_points
    from generator.study.parameter_paths import Case
    from generator.study.run_case import run_case
    from generator.study.study_file import read_study
    from generator.study.sweep import run_sweep

    Assembly = ExudynModel
    drawn_displacements = initial_displacements
    place = forward_kinematics

_MODULES = {
    "ActionFile": "generator.motion_files",
    "Attribute": "generator.figure",
    "AxisKind": "generator.figure",
    "Box": "generator.scene",
    "Case": "generator.study.parameter_paths",
    "ContactRecord": "generator.contact_record",
    "ContactSphere": "generator.figure",
    "Ending": "generator.recording",
    "ExudynModel": "generator.simulation.model",
    "Figure": "generator.figure",
    "FitOptions": "generator.identification.fit",
    "InputError": "generator.diagnostics",
    "Integrator": "generator.recording",
    "Joint": "generator.figure",
    "JointAxis": "generator.figure",
    "Location": "generator.figure",
    "ModelError": "generator.diagnostics",
    "MoverError": "generator.diagnostics",
    "Outcome": "generator.recording",
    "Person": "generator.person.person",
    "Plan": "generator.simulation.plan",
    "Plane": "generator.scene",
    "Progress": "generator.simulation.run",
    "Prop": "generator.scene",
    "Recording": "generator.recording",
    "RecordingPart": "generator.recording",
    "Rotation": "generator.figure",
    "Scene": "generator.scene",
    "Segment": "generator.figure",
    "Sex": "generator.person.survey",
    "Site": "generator.figure",
    "SiteRef": "generator.figure",
    "Stepper": "generator.simulation.stepper",
    "Translation": "generator.figure",
    "UnknownNameError": "generator.named_mapping",
    "UsageError": "generator.diagnostics",
    "build_model": "generator.simulation.model",
    "build_person": "generator.person.person",
    "build_tree": "generator.kinematics.tree",
    "by_name": "generator.named_mapping",
    "centre_of_mass": "generator.kinematics.centre_of_mass",
    "centre_of_mass_jacobian": "generator.kinematics.centre_of_mass",
    "centre_of_pressure": "generator.contact_record",
    "convert": "generator.conversion",
    "design_points": "generator.study.designs",
    "estimate_measures": "generator.person.measures",
    "fit_springs": "generator.identification.fit",
    "forward_kinematics": "generator.kinematics.placement",
    "head_injury_criterion": "generator.contact_record",
    "initial_displacements": "generator.kinematics.placement",
    "read_action": "generator.motion_files",
    "read_figure": "generator.figure_file",
    "read_measured_angles": "generator.identification.measured_angles",
    "read_npz": "generator.motion_files",
    "read_pose": "generator.input_files.pose",
    "read_scene": "generator.input_files.scene",
    "read_springs": "generator.springs_file.read",
    "read_study": "generator.study.study_file",
    "run_case": "generator.study.run_case",
    "run_sweep": "generator.study.sweep",
    "simulate": "generator.simulation.run",
    "stability": "generator.kinematics.stability",
    "static_torques": "generator.simulation.statics",
    "write_figure": "generator.figure_file.write",
    "write_pose": "generator.figure_file.write",
    "write_recording": "generator.motion_files",
}

_EARLIER_NAMES = {
    "Assembly": "ExudynModel",
    "drawn_displacements": "initial_displacements",
    "hang": "build_tree",
    "place": "forward_kinematics",
}
"""Names of an earlier version, which scripts may still use."""

__all__ = [
    "ActionFile",
    "Assembly",
    "Attribute",
    "AxisKind",
    "Box",
    "Case",
    "ContactRecord",
    "ContactSphere",
    "Ending",
    "ExudynModel",
    "Figure",
    "FitOptions",
    "InputError",
    "Integrator",
    "Joint",
    "JointAxis",
    "Location",
    "ModelError",
    "MoverError",
    "Outcome",
    "Person",
    "Plan",
    "Plane",
    "Progress",
    "Prop",
    "Recording",
    "RecordingPart",
    "Rotation",
    "Scene",
    "Segment",
    "Sex",
    "Site",
    "SiteRef",
    "Stepper",
    "Translation",
    "UnknownNameError",
    "UsageError",
    "build_model",
    "build_person",
    "build_tree",
    "by_name",
    "centre_of_mass",
    "centre_of_mass_jacobian",
    "centre_of_pressure",
    "convert",
    "design_points",
    "drawn_displacements",
    "estimate_measures",
    "fit_springs",
    "forward_kinematics",
    "hang",
    "head_injury_criterion",
    "initial_displacements",
    "place",
    "read_action",
    "read_figure",
    "read_measured_angles",
    "read_npz",
    "read_pose",
    "read_scene",
    "read_springs",
    "read_study",
    "run_case",
    "run_sweep",
    "simulate",
    "stability",
    "static_torques",
    "write_figure",
    "write_pose",
    "write_recording",
]


def _require_own_packages() -> None:
    """Raise ImportError when another module hides a package that is installed beside this one."""
    installed = dirname(dirname(realpath(__file__)))
    for name in ("springs", "plots", "figures"):
        spec = find_spec(name)
        origin = None if spec is None else spec.origin
        if origin is None or dirname(dirname(realpath(origin))) == installed:
            continue
        hiding = dirname(origin) if basename(origin) == "__init__.py" else origin
        message = (
            f"{hiding} hides the {name} package of exudyn-mover ({installed}): "
            "rename it or run from another folder"
        )
        # The command shows no traceback; `python -m generator.cli` is called `-m` while it starts.
        if splitext(basename("".join(sys.argv[:1])))[0] in ("mover", "-m"):
            sys.exit(f"error: {message}")
        raise ImportError(message)


_require_own_packages()


def __getattr__(name: str) -> object:
    """Import a public name from the module that defines it."""
    target = _EARLIER_NAMES.get(name, name)
    if target not in _MODULES:
        from difflib import get_close_matches

        near = get_close_matches(name, _MODULES, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")
    value = getattr(import_module(_MODULES[target]), target)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names, imported or not."""
    return sorted({*globals(), *__all__})
