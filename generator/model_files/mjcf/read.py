"""MJCF, the models of MuJoCo: the passive tree of one as a figure."""

from pathlib import Path
from typing import Final

import numpy as np

from generator.diagnostics import Diagnostics, shorten
from generator.losses import LossReport
from generator.model_files.body_tree.names import gravity_losses, rotation_to_y_up
from generator.model_files.body_tree.to_figure import figure_from_tree
from generator.model_files.body_tree.tree import BodyTree
from generator.model_files.imported import Imported
from generator.model_files.mjcf.bodies import BodyReader
from generator.model_files.mjcf.document import Document, parse_document
from generator.model_files.xml_read import XmlElement, parse_numbers
from generator.rotations import Array

STANDARD_GRAVITY = (0.0, 0.0, -9.81)

_LOST: Final = {
    "actuator": "actuators",
    "tendon": "tendons",
    "equality": "equality constraints",
    "contact": "contact pairs and exclusions",
    "sensor": "sensors",
    "keyframe": "key frames",
    "asset": "meshes, textures and other assets",
    "custom": "custom fields",
    "extension": "plugins",
    "deformable": "flexible bodies and skins",
    "visual": "settings of the picture",
    "statistic": "settings of the picture",
    "size": "sizes of tables",
}
_READ_SECTIONS: Final = ("compiler", "option", "default", "worldbody")

_COMPILER: Final = {
    "angle",
    "eulerseq",
    "coordinate",
    "autolimits",
    "inertiafromgeom",
    "inertiagrouprange",
    "boundmass",
    "boundinertia",
    "balanceinertia",
    "settotalmass",
}


def figure_from_mjcf(
    root: XmlElement, directory: Path | None, diagnostics: Diagnostics, *, separate: bool = False
) -> Imported | None:
    """The figure of an MJCF document; None, with the faults noted, when it makes none.

    Args:
        root: the element `mujoco`.
        directory: in which included files are looked for.
        diagnostics: for faults.
        separate: see `figure_of`.
    """
    report = LossReport("MJCF")
    document = parse_document(root, directory, diagnostics)
    up = _up_rotation(document, diagnostics, report)
    reader = BodyReader(document, diagnostics, report)
    worlds = list(document.root.find_all("worldbody"))
    if not worlds:
        diagnostics.error("this model has no `worldbody`", root.span, "its bodies stand in one")
    for world in worlds:
        reader.read_world(world)
    _add_section_losses(document, report)
    tree = BodyTree(
        tuple(reader.scaled_bodies()), reader.sites, up, document.root.get("model"), root.span
    )
    return figure_from_tree(tree, diagnostics, report, separate=separate)


def _up_rotation(document: Document, diagnostics: Diagnostics, report: LossReport) -> Array:
    """The rotation that makes y up, from the direction of gravity; what it is is told."""
    gravity = np.array(STANDARD_GRAVITY)
    for option in document.root.find_all("option"):
        written = option.attributes.get("gravity")
        read = None if written is None else parse_numbers(written, diagnostics, 3)
        gravity = gravity if read is None else np.array(read)
        flag = option.find("flag")
        if flag is not None and flag.get("gravity") == "disable":
            gravity = np.zeros(3)
        for name in option.attributes:
            if name != "gravity":
                report.add("settings of a run", name)
        for name in () if flag is None else flag.attributes:
            report.add("settings of a run", f"flag {name}")
    up = rotation_to_y_up(gravity)
    for sentence in gravity_losses(gravity, up):
        report.add(sentence)
    return up


def _add_section_losses(document: Document, report: LossReport) -> None:
    """Sections and settings that a figure does not have."""
    for section in document.root.children:
        if section.tag in _READ_SECTIONS:
            continue
        what = _LOST.get(section.tag)
        if what is None:
            report.add("sections that are not known here", section.tag)
        elif section.tag == "visual" or not section.children:
            report.add(what, section.tag)
        else:
            names = [child.get("name") or child.tag for child in section.children]
            report.add(what, *(shorten(name) for name in names))
    for name in document.compiler:
        if name not in _COMPILER:
            report.add("attributes without a meaning here", f"compiler {name}")
