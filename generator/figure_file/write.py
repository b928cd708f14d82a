"""Writing a figure: the inverse of reading."""

import re
from collections.abc import Iterable, Mapping, Sequence

from generator.figure import (
    Attribute,
    AxisKind,
    Figure,
    Follower,
    Joint,
    JointAxis,
    Location,
    Rotation,
    Segment,
    Site,
    SiteRef,
)
from generator.figure_file.check import require_valid_figure
from generator.figure_file.lexer import MAX_WORD_LENGTH
from generator.figure_file.values import axis_dimension
from generator.follower_curve import CurveKind
from generator.units import Dimension, format_quantities, format_quantity

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def write_figure(figure: Figure) -> str:
    """The text of a figure file; reading it gives a figure equal to `figure`, to the last bit.

    The springs that a figure brings along, as a person does, belong into a springs file beside it;
    `generator.convert(figure, "NAME.fig")` writes both.

    Raises InputError, with all errors, for a figure made in Python that is wrong, and ValueError
    for what the language cannot say: a name with odd characters, a quote in a string, a number that
    is not finite.
    """
    require_valid_figure(figure)
    lines = [f"figure {_checked_name(figure.name)} {{" if figure.name is not None else "figure {"]
    for attribute in figure.attributes.values():
        lines += _block(f"attribute {_checked_name(attribute.name)}", _attribute(attribute))
    for segment in figure.segments.values():
        lines += _block(f"segment {_checked_name(segment.name)}", _segment(segment))
    for joint in figure.joints.values():
        lines += _block(f"joint {_checked_name(joint.name)}", _joint(joint, figure.joints))
    return "\n".join([*lines, f"  root = {_site_ref(figure.root)};", "}", ""])


def write_pose(figure: Figure, displacements: Mapping[str, Sequence[float]]) -> str:
    """The text of a pose file; reading it gives the same displacements, to the last bit.

    Args:
        figure: figure whose joints they are.
        displacements: displacements by joint, a value for each factor of its chain [rad or m].
            Rigid joints and those that are left out are not written.

    Raises ValueError for what the language cannot say, as `write_figure` does.
    """
    lines: list[str] = []
    for name, joint in figure.joints.items():
        if joint.chain and name in displacements:
            row = [float(value) for value in displacements[name]]
            values = _format_joint_values(row, joint.chain, Dimension.ANGLE, Dimension.LENGTH)
            lines += _block(f"joint {_checked_name(name)}", [f"displacement = {values};"])
    return "\n".join([*(line.removeprefix("  ") for line in lines), ""])


def _block(head: str, body: Iterable[str]) -> list[str]:
    return _indented([f"{head} {{", *_indented(body), "}"])


def _indented(lines: Iterable[str]) -> list[str]:
    return [f"  {line}" for line in lines]


def _attribute(attribute: Attribute) -> list[str]:
    return [
        f"{_checked_name(key)} = {text};"
        for key, value in attribute.fields.items()
        for text in [_quote(value) if isinstance(value, str) else _format_numbers(value)]
    ]


def _segment(segment: Segment) -> list[str]:
    lines: list[str] = []
    if segment.psurf is not None:
        lines.append(f"psurf = {_quote(segment.psurf)};")
    names = [_checked_name(name) for name in segment.attributes]
    if names:
        lines.append(f"attribute = {names[0] if len(names) == 1 else _format_list(names)};")
    if segment.mass is not None:
        lines.append(f"mass = {format_quantity(segment.mass, Dimension.MASS)};")
    if segment.inertia is not None:
        lines.append(f"inertia = {_format_vector(segment.inertia, Dimension.INERTIA)};")
    for sphere in segment.contact_spheres:
        if sphere.part:
            raise ValueError(f"the figure language has no parts of segments: {sphere.part!r}")
    spheres = [
        f"sphere{_format_vector((*each.centre, each.radius), Dimension.LENGTH)}"
        for each in segment.contact_spheres
    ]
    if spheres:
        lines.append(f"contact = {spheres[0] if len(spheres) == 1 else _format_list(spheres)};")
    for site in segment.sites.values():
        lines += _site(site)
    return lines


def _site(site: Site) -> list[str]:
    """One line for a site of one field, else a block."""
    loads = (
        ("globalforce", site.global_force, Dimension.FORCE),
        ("localforce", site.local_force, Dimension.FORCE),
        ("globalmoment", site.global_moment, Dimension.MOMENT),
        ("localmoment", site.local_moment, Dimension.MOMENT),
    )
    fields = [f"location = {_location(site.location)};"] if site.location.factors else []
    fields += [
        f"{key} = {_format_vector(load, dim)};" for key, load, dim in loads if load is not None
    ]
    if len(fields) == 1:
        return [f"site {_checked_name(site.name)}->{fields[0]}"]
    return [f"site {_checked_name(site.name)} {{", *_indented(fields), "}"]


def _location(location: Location) -> str:
    return " * ".join(
        f"xyz{_format_vector(factor.angles, Dimension.ANGLE)}"
        if isinstance(factor, Rotation)
        else f"trans{_format_vector(factor.offset, Dimension.LENGTH)}"
        for factor in location.factors
    )


def _joint(joint: Joint, joints: Mapping[str, Joint]) -> list[str]:
    rows = (
        ("stiff", joint.stiff, Dimension.ANGULAR_STIFFNESS, Dimension.LINEAR_STIFFNESS),
        ("rest", joint.rest, Dimension.ANGLE, Dimension.LENGTH),
        ("damp", joint.damp, Dimension.ANGULAR_DAMPING, Dimension.LINEAR_DAMPING),
        ("llimit", joint.lower_limit, Dimension.ANGLE, Dimension.LENGTH),
        ("ulimit", joint.upper_limit, Dimension.ANGLE, Dimension.LENGTH),
    )
    lines = [f"connect {_site_ref(joint.parent)} to {_site_ref(joint.child)};"]
    if joint.chain:
        lines.append(
            f"type = {'*'.join(f.kind.value + _format_numbers(f.axis) for f in joint.chain)};"
        )
    if any(joint.displacement):
        values = _format_joint_values(
            joint.displacement, joint.chain, Dimension.ANGLE, Dimension.LENGTH
        )
        lines.append(f"displacement = {values};")
    lines += [
        f"{key} = {_format_joint_values(row, joint.chain, about, along)};"
        for key, row, about, along in rows
        if row is not None
    ]
    if joint.followers:
        pairs = zip(joint.followers, joint.chain, strict=True)
        texts = [_follower(one, axis, joints) for one, axis in pairs]
        lines.append(f"follow = {_format_list(texts)};")
    return lines


def _follower(follower: Follower | None, axis: JointAxis, joints: Mapping[str, Joint]) -> str:
    """Format what a displacement follows; a spline with the units of both."""
    if follower is None:
        return "free"
    curve, control = follower.curve, joints[follower.joint].chain[follower.index]
    numbers = format_quantities(curve.numbers, Dimension.NUMBER)
    if curve.kind is not CurveKind.POLYNOMIAL:
        for k, one in enumerate((control, axis)):
            dimension = axis_dimension(one.kind, Dimension.ANGLE, Dimension.LENGTH)
            numbers[k::2] = format_quantities(curve.numbers[k::2], dimension)
    place = [_checked_name(follower.joint), str(follower.index + 1)]
    return curve.kind + _format_list([*place, *numbers])


def _format_joint_values(
    row: Sequence[float], chain: Sequence[JointAxis], about: Dimension, along: Dimension
) -> str:
    """Format a row with one unit for its angles and one for its lengths."""
    texts = [""] * len(row)
    for kind in AxisKind:
        places = [k for k, factor in enumerate(chain) if factor.kind is kind]
        dimension = axis_dimension(kind, about, along)
        found = format_quantities([row[k] for k in places], dimension)
        for k, text in zip(places, found, strict=True):
            texts[k] = text
    return _format_list(texts)


def _format_vector(values: Sequence[float], dimension: Dimension) -> str:
    return _format_list(format_quantities(values, dimension))


def _format_numbers(values: Sequence[float]) -> str:
    return _format_vector(values, Dimension.NUMBER)


def _format_list(texts: Iterable[str]) -> str:
    return f"({','.join(texts)})"


def _site_ref(ref: SiteRef) -> str:
    return f"{_checked_name(ref.segment)}.{_checked_name(ref.site)}"


def _checked_name(name: str) -> str:
    if not _NAME.fullmatch(name) or len(name) > MAX_WORD_LENGTH:
        raise ValueError(f"the figure language has no such name: {name!r}")
    return name


def _quote(text: str) -> str:
    if set(text) & {'"', "\n", "\r"} or len(text) + 2 > MAX_WORD_LENGTH:
        raise ValueError(f"the figure language has no such string: {text!r}")
    return f'"{text}"'
