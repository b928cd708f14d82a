"""The public names and the modules that define them, from which they are imported when used."""

from .comparison.comparison import Comparison, compare
from .comparison.difference import Difference
from .contact.box import Box
from .contact.plane import Plane
from .contact.record import (
    ContactRecord,
    centre_of_pressure,
    head_injury_criterion,
)
from .contact.scene import Prop, Scene
from .contact_file.file import read_contact, write_contact
from .contact_file.parts import BodyContact, BodyPart
from .conversion import convert
from .diagnostics import InputError, ModelError, MoverError, UnknownNameError, UsageError, by_name
from .figure import (
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
from .figure_file import read_figure
from .figure_file.write import write_figure, write_pose
from .hold.posture import Holder, Posture
from .identification.fit import FitOptions, fit_springs
from .identification.measured_angles import read_measured_angles
from .input_files.pose import read_pose
from .input_files.scene import read_scene
from .kinematics.centre_of_mass import centre_of_mass, centre_of_mass_jacobian
from .kinematics.effective_mass import effective_mass
from .kinematics.placement import forward_kinematics, initial_displacements
from .kinematics.stability import stability
from .kinematics.tree import build_tree
from .model import Model
from .motion_files import ActionFile, read_action, read_npz
from .notebook import PageView
from .passive_curve import PassiveCurve, passive_curves
from .person.measures import estimate_measures
from .person.person import Person, build_person
from .person.survey import Sex
from .recording import Ending, Integrator, Outcome, Recording, RecordingPart
from .simulation.exudyn_model.model import ExudynModel, build_model
from .simulation.falls import fall_plan
from .simulation.live.stepper import Stepper
from .simulation.plan import Plan
from .simulation.run import Progress, simulate
from .simulation.statics.static_forces import static_torques
from .springs_file.read import read_springs
from .study.designs import design_points
from .study.falls import Falls, run_falls
from .study.parameter_paths import Case
from .study.run_case import run_case
from .study.sensitivity import estimate_indices
from .study.study_file import read_study
from .study.sweep import run_sweep
from .tone import Tone

__all__ = [
    "ActionFile",
    "Attribute",
    "AxisKind",
    "BodyContact",
    "BodyPart",
    "Box",
    "Case",
    "Comparison",
    "ContactRecord",
    "ContactSphere",
    "Difference",
    "Ending",
    "ExudynModel",
    "Falls",
    "Figure",
    "FitOptions",
    "Holder",
    "InputError",
    "Integrator",
    "Joint",
    "JointAxis",
    "Location",
    "Model",
    "ModelError",
    "MoverError",
    "Outcome",
    "PageView",
    "PassiveCurve",
    "Person",
    "Plan",
    "Plane",
    "Posture",
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
    "Tone",
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
    "compare",
    "convert",
    "design_points",
    "effective_mass",
    "estimate_indices",
    "estimate_measures",
    "fall_plan",
    "fit_springs",
    "forward_kinematics",
    "head_injury_criterion",
    "initial_displacements",
    "passive_curves",
    "read_action",
    "read_contact",
    "read_figure",
    "read_measured_angles",
    "read_npz",
    "read_pose",
    "read_scene",
    "read_springs",
    "read_study",
    "run_case",
    "run_falls",
    "run_sweep",
    "simulate",
    "stability",
    "static_torques",
    "write_contact",
    "write_figure",
    "write_pose",
]
