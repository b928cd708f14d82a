"""Shapes of segments in MJCF: psurfs as meshes, capsules of segments without a readable psurf."""

from collections.abc import Mapping

import numpy as np

from generator.diagnostics import InputError
from generator.figure import Figure, Segment
from generator.geometry.appearance import mass_capsule
from generator.geometry.read import read_segment_surface, segment_colour
from generator.geometry.surface import Surface
from generator.identifiers import plain_names
from generator.losses import Losses
from generator.model_files.export_model import ExportModel
from generator.model_files.xml import Element, add_element, format_numbers
from generator.rotations import quaternion_from_matrix

_MIN_VERTICES = 4

_MIN_LENGTH = 1e-9
"""Length below which a line of a capsule is a sphere [m]."""


def add_visuals(
    model: ExportModel, assets: Element, bodies: Mapping[str, Element], losses: Losses
) -> None:
    """Add the segments' psurfs or mass capsules as visual geoms, without contact and mass."""
    figure = model.figure
    files = [segment.psurf for segment in figure.segments.values() if segment.psurf is not None]
    names = plain_names(files)
    written: set[str] = set()
    for name, segment in figure.segments.items():
        mesh = "" if segment.psurf is None else names[segment.psurf]
        if mesh and mesh not in written:
            try:
                surface = read_segment_surface(figure, segment)
            except InputError as failure:
                reason = failure.diagnostics[0].message
                losses.add_description(
                    f"psurfs that cannot be read ({reason}): capsules instead", name
                )
            else:
                if _add_mesh(assets, mesh, surface):
                    written.add(mesh)
                else:
                    what = "psurfs without four corners or without any face: capsules instead"
                    losses.add_description(what, name)
        if mesh not in written:
            _add_capsules(figure, segment, bodies[name])
            continue
        pose = model.placement.poses[name] if name in figure.ground else np.eye(4)
        geom = add_element(bodies[name], "geom", type="mesh", mesh=mesh)
        geom.set("pos", format_numbers(pose[:3, 3]))
        geom.set("quat", format_numbers(quaternion_from_matrix(pose[:3, :3])))
        _set_appearance(geom, figure, segment)


def _add_capsules(figure: Figure, segment: Segment, body: Element) -> None:
    """Add a segment's mass capsule, one geom for each of its lines."""
    capsule = mass_capsule(figure, segment)
    if capsule is None:
        return
    for end in capsule.ends:
        if np.linalg.norm(end - capsule.centre) < _MIN_LENGTH:
            geom = add_element(body, "geom", type="sphere", pos=format_numbers(end))
        else:
            line = [*capsule.centre, *end]
            geom = add_element(body, "geom", type="capsule", fromto=format_numbers(line))
        geom.set("size", format_numbers(capsule.radius))
        _set_appearance(geom, figure, segment)


def _set_appearance(geom: Element, figure: Figure, segment: Segment) -> None:
    """Colour a geom, and leave it without contact and mass."""
    geom.set("rgba", format_numbers([*segment_colour(figure, segment), 1.0]))
    geom.attrib |= {"contype": "0", "conaffinity": "0", "mass": "0"}


def _add_mesh(assets: Element, name: str, surface: Surface) -> bool:
    """A surface as triangles; False for one that MuJoCo refuses."""
    fans, _ = surface.fan_triangles
    points = surface.vertices[fans]
    areas = np.linalg.norm(np.cross(points[1] - points[0], points[2] - points[0]), axis=1)
    triangles = fans[:, areas > 0.0]
    if len(surface.vertices) < _MIN_VERTICES or not triangles.size:
        return False
    mesh = add_element(assets, "mesh", name=name, inertia="shell")
    mesh.set("vertex", format_numbers(surface.vertices))
    mesh.set("face", " ".join(map(str, triangles.T.ravel().tolist())))
    return True
