"""What a MuJoCo model has beside its bodies and joints: sites, surfaces, loops, loads."""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from generator.diagnostics import InputError
from generator.figure import Figure, Segment, SiteRef
from generator.geometry.read import read_segment_surface
from generator.geometry.surface import Surface
from generator.losses import LossReport
from generator.model_files.export_model import ExportModel, loop_closures
from generator.model_files.xml_write import Element, add_element, format_numbers
from generator.names import plain_names
from generator.rotations import Array, pose_matrix

WORLD = "world"
"""Name of the site whose axes are those of the world; the others have a dot in theirs."""

_SOLVER = {"solref": "0.002 1", "solimp": "0.999 0.9999 0.001 0.5 2"}
"""How hard loops are held: as hard as the file's time step allows."""

_MIN_VERTICES = 4


def quaternion(matrix: Array) -> Array:
    """Scalar first, shape (4,)."""
    return Rotation.from_matrix(matrix).as_quat()[[3, 0, 1, 2]]


def site_name(model: ExportModel, ref: SiteRef) -> str:
    """`SEGMENT.SITE`."""
    return f"{model.segments[ref.segment]}.{ref.site}"


def add_sites(model: ExportModel, body: Element, segment: str, pose: Array) -> None:
    """The sites of a segment; `pose` is that of the segment in the body, shape (4, 4)."""
    for name, site in model.figure.segments[segment].sites.items():
        _add_site(body, site_name(model, SiteRef(segment, name)), pose @ site.pose_in_segment)


def _add_site(body: Element, name: str, pose: Array) -> None:
    turn = format_numbers(quaternion(pose[:3, :3]))
    add_element(body, "site", name=name, pos=format_numbers(pose[:3, 3]), quat=turn, size="0.005")


def add_surfaces(
    model: ExportModel, assets: Element, bodies: Mapping[str, Element], report: LossReport
) -> None:
    """The segments' psurfs, to be looked at: they neither touch nor weigh anything."""
    figure = model.figure
    files = [segment.psurf for segment in figure.segments.values() if segment.psurf is not None]
    names = plain_names(files)
    made: set[str] = set()
    for name, segment in figure.segments.items():
        if segment.psurf is None:
            continue
        mesh = names[segment.psurf]
        if mesh not in made:
            try:
                surface = read_segment_surface(figure, segment)
            except InputError as failure:
                report.add(f"psurfs that cannot be read ({failure.diagnostics[0].message})", name)
                continue
            if not _add_mesh(assets, mesh, surface):
                report.add("psurfs without four corners or without any face", name)
                continue
            made.add(mesh)
        pose = model.placement.poses[name] if name in figure.ground else np.eye(4)
        geom = add_element(bodies[name], "geom", type="mesh", mesh=mesh)
        geom.set("pos", format_numbers(pose[:3, 3]))
        geom.set("quat", format_numbers(quaternion(pose[:3, :3])))
        geom.set("rgba", format_numbers([*_colour(figure, segment), 1.0]))
        geom.attrib |= {"contype": "0", "conaffinity": "0", "mass": "0"}
    others = [name for name, one in figure.attributes.items() if set(one.fields) - {"rgb"}]
    if others:
        report.add("attributes other than a colour", *others)


def _add_mesh(assets: Element, name: str, surface: Surface) -> bool:
    """A surface as triangles; False for one that MuJoCo refuses."""
    fans, _ = surface.fan_triangles
    points = surface.vertices[fans]
    areas = np.linalg.norm(np.cross(points[1] - points[0], points[2] - points[0]), axis=1)
    kept = fans[:, areas > 0.0]
    if len(surface.vertices) < _MIN_VERTICES or not kept.size:
        return False
    mesh = add_element(assets, "mesh", name=name, inertia="shell")
    mesh.set("vertex", format_numbers(surface.vertices))
    mesh.set("face", " ".join(map(str, kept.T.ravel().tolist())))
    return True


def _colour(figure: Figure, segment: Segment) -> tuple[float, ...]:
    """The `rgb` of the first of a segment's attributes that has one; else grey."""
    for name in segment.attributes:
        attribute = figure.attributes.get(name)
        given = None if attribute is None else attribute.fields.get("rgb")
        if isinstance(given, tuple) and len(given) == 3:
            return given
    return 0.7, 0.7, 0.7


def add_loops(
    model: ExportModel, equality: Element, bodies: Mapping[str, Element], report: LossReport
) -> None:
    """What the joints that close loops hold: their sites, and a second point on a hinge's axis."""
    for loop in loop_closures(model, report):
        name = model.joints[loop.joint.name]
        ends = [site_name(model, ref) for ref in loop.joint.ends]
        kind = "connect" if loop.points else "weld"
        add_element(equality, kind, name=name, site1=ends[0], site2=ends[1], **_SOLVER)
        for point in loop.points[1:]:
            names = [f"{name}.axis in {model.segments[ref.segment]}" for ref in loop.joint.ends]
            for own, ref in zip(names, loop.joint.ends, strict=True):
                pose = model.site(ref) @ pose_matrix(np.eye(3), point)
                if ref.segment in model.figure.ground:
                    pose = model.placement.poses[ref.segment] @ pose
                _add_site(bodies[ref.segment], own, pose)
            given = {"site1": names[0], "site2": names[1], **_SOLVER}
            add_element(equality, "connect", name=f"{name}.axis", **given)


def add_loads(model: ExportModel, actuators: Element) -> None:
    """The constant forces and moments at sites, as actuators that take no control."""
    for name in model.figure.bodies:
        for site in model.figure.segments[name].sites.values():
            own = site.pose_in_segment[:3, :3].T
            zero = (0.0, 0.0, 0.0)
            loads = {
                "global": [*(site.global_force or zero), *(site.global_moment or zero)],
                "local": [
                    *(own @ (site.local_force or zero)),
                    *(own @ (site.local_moment or zero)),
                ],
            }
            for kind, load in loads.items():
                if any(load):
                    _add_load(actuators, site_name(model, SiteRef(name, site.name)), kind, load)


def _add_load(actuators: Element, site: str, kind: str, load: list[float]) -> None:
    frame = {"refsite": WORLD} if kind == "global" else {}
    given = {"gear": format_numbers(load), "gainprm": "0", "biastype": "affine", "biasprm": "1 0 0"}
    add_element(actuators, "general", name=f"{site} {kind} load", site=site, **frame, **given)
