"""The figure and the springs that a model of this program carries, so that they come back exactly.

A model holds its figure in another form: sites without roles, joints in rows, springs by
approximations and without references. The writers of MJCF and `.osim` therefore add the text of the
figure and of its springs, in elements that the other programs skip, with digests of the elements
that they stand for. A reader uses the texts while those elements are as they were written; masses
and shapes are read from the model in any case.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from generator.diagnostics import Diagnostics, MoverError, Source
from generator.figure import CENTRE_OF_MASS_SITE, Figure, Location, Segment, Site, SiteRef
from generator.figure_file import FIGURE_FILE
from generator.figure_file.write import write_figure
from generator.geometry.read import segment_colour
from generator.identifiers import plain_names
from generator.input_files.coordinates import (
    COORDINATE_NAMES,
    NO_COORDINATES,
    CoordinateMapping,
    Coordinates,
    names_in_models,
    write_coordinates,
)
from generator.kinematics.placement import Placement, forward_kinematics, initial_displacements
from generator.kinematics.tree import build_tree
from generator.losses import Losses
from generator.model import Model
from generator.model_files.body_tree.shapes import Colour, Shape, join_shapes, with_colours
from generator.model_files.body_tree.tree import Body, BodyTree
from generator.model_files.model_files import Imported
from generator.model_files.xml import Element, XmlElement, add_element, format_document, parse_xml
from generator.rotations import inverse_pose
from generator.springs_file.edit import format_besides_fields, springs_from_text
from generator.springs_file.parse import SPRINGS_FILE, SpringsFile
from generator.text_io import make_source
from springs import SpringSet

MARK = "exudyn_mover"
"""Element in an `.osim` file, and first part of the names of custom texts in MJCF."""

DIGESTED = ("model", "springs", "shapes", "others")
"""Groups of elements with a digest each: the figure, its springs, its shapes, and the rest."""

PARTS = ("figure", "springs", *(f"{group}_sha256" for group in DIGESTED))
"""The texts, and the digests of the elements that they stand for."""

_COORDINATES = "coordinates"
"""Text of the coordinates of the model that the figure is from, which is not always there."""

NO_SPRINGS = "none"
"""Text of the springs of a model that was written without any."""


@dataclass(frozen=True)
class ElementKinds:
    """Kinds of elements of a format.

    Attributes:
        spring_tags: elements of springs, damping and friction.
        spring_attributes: their attributes in other elements.
        shape_tags: elements of shapes, which are read from the model in any case.
        other_tags: elements that a figure does not have.
        ignored_tags: masses, which are read in any case, and settings without an effect.
    """

    spring_tags: frozenset[str]
    spring_attributes: frozenset[str]
    shape_tags: frozenset[str]
    other_tags: frozenset[str]
    ignored_tags: frozenset[str]

    def group(self, tag: str) -> str:
        """Return the group of an element with this tag; "" for the group of the one above."""
        groups = {"springs": self.spring_tags, "shapes": self.shape_tags, "others": self.other_tags}
        return next((group for group, tags in groups.items() if tag in tags), "")


KINDS: Mapping[str, ElementKinds] = {
    "mujoco": ElementKinds(
        frozenset({"tendon", "general"}),
        frozenset({"stiffness", "springref", "damping", "frictionloss", "springdamper"}),
        frozenset({"asset", "geom"}),
        frozenset(
            {"camera", "light", "sensor", "contact", "option", "motor", "position", "velocity"}
            | {"intvelocity", "damper", "cylinder", "muscle", "adhesion", "plugin"}
        ),
        frozenset({"custom", "inertial", "visual", "statistic", "size"}),
    ),
    "OpenSimDocument": ElementKinds(
        frozenset(
            {"ExpressionBasedCoordinateForce", "ExpressionBasedBushingForce"}
            | {"ExpressionBasedPathForce"}
            | {"SpringGeneralizedForce", "CoordinateLimitForce", "CoordinateLinearStopForce"}
            | {"ExponentialCoordinateLimitForce", "FunctionBasedBushingForce", "BushingForce"}
        ),
        frozenset(),
        frozenset({"attached_geometry", "Appearance", "Mesh"}),
        frozenset({"ControllerSet", "ContactGeometrySet", "ProbeSet"}),
        frozenset(
            {MARK, "mass", "mass_center", "inertia"}
            | {"credits", "publications", "length_units", "force_units"}
        ),
    ),
}
"""By root element."""


def embed(
    root: Element, figure: Figure, springs: SpringSet, coordinates: Coordinates = NO_COORDINATES
) -> None:
    """Add the texts of a figure and its springs to the model that a writer made of them.

    Nothing is added for springs that a springs file cannot state.

    Args:
        root: the complete model.
        figure: figure as the writer got it.
        springs: likewise.
        coordinates: coordinates of the model that the figure is from, whose names the model has.
    """
    try:
        texts = _format_texts(figure, springs)
    except (MoverError, ValueError):
        return
    parsed = parse_xml(Source("model", format_document(root, ())), Diagnostics())
    if parsed is None:
        return
    parts = dict(zip(PARTS, (*texts, *_digests(parsed)), strict=True))
    if coordinates:
        parts[_COORDINATES] = write_coordinates(coordinates, figure)
    if root.tag == "mujoco":
        custom = root.find("custom")
        custom = add_element(root, "custom") if custom is None else custom
        for name, text in parts.items():
            add_element(custom, "text", name=f"{MARK} {name}", data=text or " ")
    else:
        carrier = add_element(root, MARK)
        for name, text in parts.items():
            add_element(carrier, name, text)


def _format_texts(figure: Figure, springs: SpringSet) -> tuple[str, str]:
    """Return the texts of a figure and its springs. Raises ModelError."""
    figure = _with_plain_names(figure)
    if not springs.joints and not springs.coupled:
        joints = {
            name: replace(joint, stiff=None, rest=None, damp=None)
            for name, joint in figure.joints.items()
        }
        return write_figure(replace(figure, joints=joints)), NO_SPRINGS
    return write_figure(figure), format_besides_fields(figure, springs)


def _with_plain_names(figure: Figure) -> Figure:
    """Return a figure whose segments and sites have names of the figure language.

    The frame of a figure with a free root has another, which no figure file can have.
    """
    segments = plain_names(figure.segments)
    sites = {name: plain_names(one.sites) for name, one in figure.segments.items()}

    def renamed(ref: SiteRef) -> SiteRef:
        return SiteRef(segments[ref.segment], sites[ref.segment][ref.site])

    return replace(
        figure,
        segments={
            segments[name]: replace(
                one,
                name=segments[name],
                sites={new: replace(one.sites[old], name=new) for old, new in sites[name].items()},
            )
            for name, one in figure.segments.items()
        },
        joints={
            name: replace(joint, parent=renamed(joint.parent), child=renamed(joint.child))
            for name, joint in figure.joints.items()
        },
        root=renamed(figure.root),
    )


def _digests(root: XmlElement) -> tuple[str, ...]:
    """Return the digest of each group of elements."""
    kinds = KINDS[root.tag]
    digests = {group: sha256() for group in DIGESTED}
    waiting: list[tuple[XmlElement, str, str]] = [
        (child, "", "model") for child in reversed(root.children)
    ]
    while waiting:
        element, path, group = waiting.pop()
        if element.tag in kinds.ignored_tags:
            continue
        path, group = f"{path}/{element.tag}", kinds.group(element.tag) or group
        attributes = {name: written.text for name, written in element.attributes.items()}
        own = {name: attributes.pop(name) for name in kinds.spring_attributes & attributes.keys()}
        if attributes or element.text.text:  # sections without contents do not matter
            digests[group].update(_canonical_line(path, attributes, element.text.text))
        if own:
            digests["springs"].update(_canonical_line(f"{path} {element.get('name')}", own, ""))
        waiting += [(child, path, group) for child in reversed(element.children)]
    return tuple(digest.hexdigest() for digest in digests.values())


def canonical_element(element: XmlElement) -> bytes:
    """Return an element and what is in it as text that spaces and forms of numbers leave."""
    attributes = {name: written.text for name, written in element.attributes.items()}
    inside = b"".join(map(canonical_element, element.children))
    return _canonical_line(element.tag, attributes, element.text.text) + inside + b"end\n"


def _canonical_line(path: str, attributes: Mapping[str, str], text: str) -> bytes:
    """Return an element as a line that spaces and the forms of numbers do not change."""
    words = [f"{name}={_canonical_text(value)}" for name, value in sorted(attributes.items())]
    return f"{path} {' '.join(words)}|{_canonical_text(text)}\n".encode()


def _canonical_text(text: str) -> str:
    return " ".join(map(_canonical_word, text.split()))


def _canonical_word(word: str) -> str:
    try:
        return repr(float(word) + 0.0)
    except ValueError:
        return word


def imported_from_embedded(
    root: XmlElement, tree: BodyTree, read_losses: Losses
) -> Imported | None:
    """Return the figure and the springs that a model carries, with its masses and shapes.

    None for a model without them, or one that is not as it was written, which is a loss.

    Args:
        root: the element of the model.
        tree: the bodies of the model as they were read.
        read_losses: read losses of the reading.
    """
    parts = _read_parts(root)
    if parts is None:
        return None
    now = dict(zip(DIGESTED, _digests(root), strict=True))
    same = {group: now[group] == parts[f"{group}_sha256"] for group in DIGESTED}
    words = {"model": "bodies and joints", "springs": "springs and loads"}
    changed = [word for group, word in words.items() if not same[group]]
    figure = FIGURE_FILE.parse(make_source(parts["figure"], "the figure in the model")).value
    laws: SpringsFile | None = SpringsFile(())
    if parts["springs"] not in ("", NO_SPRINGS):
        source = make_source(parts["springs"], "the springs in the model")
        laws = SPRINGS_FILE.parse(source).value
    bodies = {body.name: body for body in tree.bodies}
    names = {} if figure is None else plain_names(figure.segments)
    updated = None
    if not (changed or figure is None or laws is None):
        updated = _with_masses(figure, names, bodies)
    if updated is None or laws is None:
        what = " and its ".join(changed) or "texts or inertias"
        read_losses.add(
            f"the figure that the model carries: its {what} were changed, so everything is read "
            "from the model itself, without the references of springs"
        )
        return None
    losses = Losses(read_losses.format)
    if not same["others"]:
        losses.add_description(
            "cameras, sensors, settings of a run and the like that were added or changed"
        )
    if parts["springs"] == NO_SPRINGS and any(
        joint.lower_limit or joint.upper_limit for joint in updated.joints.values()
    ):
        losses.add("a model without springs: limits are stops here")
    joint_tree = build_tree(updated)
    placement = forward_kinematics(joint_tree, initial_displacements(joint_tree))
    shapes = {
        name: bodies[names[name]].shapes
        for name, segment in updated.bodies.items()
        # A writer has stand-ins for the psurfs that a figure does not have.
        if segment.psurf is not None or not same["shapes"]
    }
    has_ground = any(updated.segments[name].psurf is not None for name in updated.ground)
    fixed = tree.shapes if has_ground or not same["shapes"] else ()  # a writer has props
    surfaces, colours = join_shapes({**_ground_shapes(placement, fixed), **shapes}, losses)
    painted = _with_new_colours(updated, colours)
    bare = {name: replace(one, psurf=None) for name, one in painted.segments.items()}
    return Imported(
        replace(painted, segments=bare),
        laws if laws != SpringsFile(()) else None,
        losses,
        _coordinates(updated, tree, parts.get(_COORDINATES, "")),
        surfaces,
    )


def edited_model(root: XmlElement) -> Model | None:
    """Return the figure and the springs that a model carries whose joints or springs were changed.

    None for a model that is as it was written, and as `carried_model`.
    """
    parts = _read_parts(root)
    if parts is None:
        return None
    now = dict(zip(DIGESTED, _digests(root), strict=True))
    if all(now[group] == parts[f"{group}_sha256"] for group in ("model", "springs")):
        return None
    return carried_model(root)


def carried_model(root: XmlElement) -> Model | None:
    """Return the figure and the springs that a model carries, whatever was changed in it since.

    None without them, or where they are damaged.
    """
    parts = _read_parts(root)
    if parts is None or parts["springs"] == NO_SPRINGS:
        return None
    figure = FIGURE_FILE.parse(make_source(parts["figure"], "the figure in the model")).value
    if figure is None:
        return None
    figure = replace(figure, path=None)
    try:
        file = Path(f"model{SPRINGS_FILE.suffix}")
        return Model(figure, springs_from_text(parts["springs"], figure, file))
    except MoverError:
        return None


def _read_parts(root: XmlElement) -> dict[str, str] | None:
    """Return the texts and digests that a model carries; None without all of them."""
    found: dict[str, str] = {}
    if root.tag == "mujoco":
        for custom in root.find_all("custom"):
            for text in custom.find_all("text"):
                name = text.get("name") or ""
                if name.startswith(f"{MARK} "):
                    found[name.removeprefix(f"{MARK} ")] = (text.get("data") or "").strip()
    elif (carrier := root.find(MARK)) is not None:
        found = {child.tag: child.text.text for child in carrier.children}
    return found if found.keys() >= set(PARTS) else None


def _with_masses(
    figure: Figure, names: Mapping[str, str], bodies: Mapping[str, Body]
) -> Figure | None:
    """Return the figure with the masses of the bodies; None where its segments cannot have them."""
    changed: list[Segment] = []
    for name, segment in figure.bodies.items():
        body = bodies.get(names[name])
        if body is None or body.mass is None or np.any(body.extra_inertia):
            return None
        tensor = body.mass.inertia
        if np.any(tensor - np.diag(np.diag(tensor))):
            return None
        x, y, z = np.diag(tensor).tolist()
        segment = replace(segment, mass=body.mass.mass, inertia=(x, y, z))
        if segment.centre_of_mass is None or np.any(segment.centre_of_mass != body.mass.centre):
            site = Site(CENTRE_OF_MASS_SITE, Location.at(*body.mass.centre.tolist()))
            segment = replace(segment, sites={**segment.sites, site.name: site})
        changed.append(segment)
    return figure.with_parts(*changed)


def _ground_shapes(placement: Placement, shapes: tuple[Shape, ...]) -> dict[str, tuple[Shape, ...]]:
    """Return the shapes of the world in the frames of the ground's segments.

    As many segments with psurfs have one shape each, in their order; otherwise the first has all.
    """
    figure = placement.tree.figure
    ground = [name for name in figure.segments if name in figure.ground]
    owners = [name for name in ground if figure.segments[name].psurf is not None]
    if len(owners) != len(shapes):
        owners = [(owners or ground)[0]] * len(shapes)
    found: dict[str, tuple[Shape, ...]] = {}
    for name, shape in zip(owners, shapes, strict=True):
        moved = shape.transformed(inverse_pose(placement.poses[name]))
        found[name] = (*found.get(name, ()), moved)
    return found


_COLOUR_TOLERANCE = 1e-6
"""Difference of colours that counts as rounding."""


def _with_new_colours(figure: Figure, colours: Mapping[str, Colour]) -> Figure:
    """Return the figure with the colours of the model, where they are others than its own."""
    new = {
        name: colour
        for name, colour in colours.items()
        if not np.allclose(
            segment_colour(figure, figure.segments[name]), colour, rtol=0.0, atol=_COLOUR_TOLERANCE
        )
    }
    return with_colours(figure, new) if new else figure


def _coordinates(figure: Figure, tree: BodyTree, text: str) -> dict[str, CoordinateMapping]:
    """Return the displacements by the names that the model has for them.

    `text` is that of the coordinates of the model that the figure is from, which may be empty.
    """
    known = {freedom.name for body in tree.bodies for freedom in body.dofs}
    source = make_source(text, "the coordinates in the model")
    carried = COORDINATE_NAMES.parse(source, figure).value or NO_COORDINATES
    chains = {name: joint.chain for name, joint in figure.joints.items()}
    listed = names_in_models(chains, carried)
    plain, found = plain_names(figure.joints), dict[str, CoordinateMapping]()
    for joint, names in listed.items():
        for k, name in enumerate(names):
            own = plain[joint] if len(names) == 1 and plain[joint] in known else name
            if own in known:
                found[own] = CoordinateMapping(joint, k)
    return found
