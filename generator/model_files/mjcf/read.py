"""MJCF, the models of MuJoCo: the passive tree of one as a figure."""

from pathlib import Path
from typing import Final

import numpy as np

from generator.diagnostics import Findings, shorten
from generator.losses import Report
from generator.model_files.body_tree.names import gravity_words, turned_up
from generator.model_files.body_tree.to_figure import figure_of
from generator.model_files.body_tree.tree import PassiveTree
from generator.model_files.imported import Imported
from generator.model_files.mjcf.bodies import BodyReader
from generator.model_files.mjcf.document import Document, document_of
from generator.model_files.xml_read import Element, numbers
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
    root: Element, directory: Path | None, findings: Findings, *, apart: bool = False
) -> Imported | None:
    """The figure of an MJCF document; None, with the faults noted, when it makes none.

    Args:
        root: the element `mujoco`.
        directory: in which included files are looked for.
        findings: for faults.
        apart: see `figure_of`.
    """
    report = Report("MJCF")
    document = document_of(root, directory, findings)
    up = _up(document, findings, report)
    reader = BodyReader(document, findings, report)
    worlds = list(document.root.all("worldbody"))
    if not worlds:
        findings.error("this model has no `worldbody`", root.span, "its bodies stand in one")
    for world in worlds:
        reader.read_world(world)
    _tell_sections(document, report)
    tree = PassiveTree(
        tuple(reader.scaled()), reader.sites, up, document.root.get("model"), root.span
    )
    return figure_of(tree, findings, report, apart=apart)


def _up(document: Document, findings: Findings, report: Report) -> Array:
    """The rotation that makes y up, from the direction of gravity; what it is is told."""
    gravity = np.array(STANDARD_GRAVITY)
    for option in document.root.all("option"):
        written = option.attributes.get("gravity")
        read = None if written is None else numbers(written, findings, 3)
        gravity = gravity if read is None else np.array(read)
        flag = option.first("flag")
        if flag is not None and flag.get("gravity") == "disable":
            gravity = np.zeros(3)
        for name in option.attributes:
            if name != "gravity":
                report.lose("settings of a run", name)
        for name in () if flag is None else flag.attributes:
            report.lose("settings of a run", f"flag {name}")
    up = turned_up(gravity)
    for sentence in gravity_words(gravity, up):
        report.lose(sentence)
    return up


def _tell_sections(document: Document, report: Report) -> None:
    """Sections and settings that a figure does not have."""
    for section in document.root.children:
        if section.tag in _READ_SECTIONS:
            continue
        what = _LOST.get(section.tag)
        if what is None:
            report.lose("sections that are not known here", section.tag)
        elif section.tag == "visual" or not section.children:
            report.lose(what, section.tag)
        else:
            names = [child.get("name") or child.tag for child in section.children]
            report.lose(what, *(shorten(name) for name in names))
    for name in document.compiler:
        if name not in _COMPILER:
            report.lose("attributes without a meaning here", f"compiler {name}")
