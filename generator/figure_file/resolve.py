"""From the syntax tree to the parts of a figure, in SI."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeGuard

from generator.diagnostics import (
    Diagnostics,
    ModelError,
    Span,
    closest_match,
    shorten,
    spelling_hint,
)
from generator.figure import (
    Attribute,
    Figure,
    Follower,
    Joint,
    JointAxis,
    Location,
    Segment,
    Site,
    SiteRef,
    Vector,
)
from generator.figure_file import values
from generator.figure_file.lexer import BLOCK_FIELDS, block_parent, keywords_in
from generator.figure_file.parser import (
    Block,
    Call,
    Connect,
    Field,
    ItemList,
    Number,
    SiteReference,
    Statement,
    String,
    Value,
    Word,
)
from generator.follower_curve import CurveKind, FollowerCurve
from generator.units import Dimension


@dataclass
class FigureDraft:
    """The parts of a figure. `span` is its keyword or name, None for a figure made in Python.

    `root` is None while unknown.

    `joints` holds those with a readable `connect`; `segments` holds all that are named.
    """

    span: Span | None
    name: str | None = None
    segments: dict[str, Segment] = field(default_factory=dict[str, Segment])
    joints: dict[str, Joint] = field(default_factory=dict[str, Joint])
    attributes: dict[str, Attribute] = field(default_factory=dict[str, Attribute])
    root: SiteRef | None = None
    origins: dict[str, Span] = field(default_factory=dict[str, Span])

    def build_figure(self, root: SiteRef) -> Figure:
        """The figure that stands on `root`."""
        return Figure(
            segments=self.segments,
            joints=self.joints,
            root=root,
            attributes=self.attributes,
            name=self.name,
            origins=self.origins,
        )


def origin_span(origins: Mapping[str, Span], *names: str) -> Span | None:
    """Span of the first of `names` that has one; else of the thing itself."""
    return next((origins[name] for name in (*names, "name") if name in origins), None)


_VELOCITY_WORDS = ("velocity", "velocities", "rate", "speed")

_LOAD_DIMENSIONS: Mapping[str, Dimension] = {
    "globalforce": Dimension.FORCE,
    "localforce": Dimension.FORCE,
    "globalmoment": Dimension.MOMENT,
    "localmoment": Dimension.MOMENT,
}

_DISPLACEMENT = Dimension.ANGLE, Dimension.LENGTH

_JOINT_FIELD_DIMENSIONS: Mapping[str, tuple[Dimension, Dimension]] = {
    "displacement": _DISPLACEMENT,
    "stiff": (Dimension.ANGULAR_STIFFNESS, Dimension.LINEAR_STIFFNESS),
    "rest": (Dimension.ANGLE, Dimension.LENGTH),
    "damp": (Dimension.ANGULAR_DAMPING, Dimension.LINEAR_DAMPING),
    "llimit": (Dimension.ANGLE, Dimension.LENGTH),
    "ulimit": (Dimension.ANGLE, Dimension.LENGTH),
}
"""Dimensions of a joint's field about and along an axis."""


def resolve_figure(tree: Block, diagnostics: Diagnostics) -> FigureDraft:
    """The parts of the figure that `tree` describes; errors go to `diagnostics`."""
    place = tree.name.span if tree.name else tree.kind.span
    draft = FigureDraft(place)
    draft.name = tree.name.text if tree.name else None
    draft.origins["name"] = place
    taken: dict[tuple[str, str], Word] = {}
    followers: dict[str, Value | None] = {}
    for block in _blocks(tree.body):
        if block.name is None or not _is_new(taken, block.kind.text, block.name, diagnostics):
            continue
        match block.kind.text:
            case "attribute":
                draft.attributes[block.name.text] = _resolve_attribute(
                    block, block.name, diagnostics
                )
            case "segment":
                draft.segments[block.name.text] = _resolve_segment(block, block.name, diagnostics)
            case _:
                joint = _resolve_joint(block, block.name, diagnostics)
                if joint is not None:
                    draft.joints[block.name.text] = joint
                    written = [one.value for one in block.body if _is_follow(one)]
                    followers |= dict.fromkeys([joint.name], next(filter(None, written), None))
    for name, written in followers.items():
        if written is not None:
            draft.joints[name] = _with_followers(draft.joints[name], written, draft, diagnostics)
    fields = _collect_fields(tree, diagnostics, draft.origins)
    if "root" in fields:
        draft.root = _resolve_root(fields["root"], diagnostics)
    return draft


def _blocks(body: Iterable[Statement]) -> list[Block]:
    return [statement for statement in body if isinstance(statement, Block)]


def _is_new(
    taken: dict[tuple[str, str], Word], kind: str, name: Word, diagnostics: Diagnostics
) -> bool:
    """Return whether the name is new for this kind; report it if not."""
    first = taken.setdefault((kind, name.text), name)
    if first is not name:
        _report_duplicate(
            f"{kind} named `{shorten(name.text)}`", first.span, name.span, diagnostics
        )
    return first is name


def _report_duplicate(what: str, first: Span, second: Span, diagnostics: Diagnostics) -> None:
    """Report a second occurrence of what may occur once."""
    diagnostics.error(f"a second {what}", second, f"the first is in line {first.line}")


def _collect_fields(
    block: Block, diagnostics: Diagnostics, origins: dict[str, Span]
) -> dict[str, Field]:
    """The fields of a block by name, each known in its kind and there once."""
    kind, found = block.kind.text, dict[str, Field]()
    known = BLOCK_FIELDS.get(kind, BLOCK_FIELDS["figure"])
    for statement in block.body:
        if not isinstance(statement, Field):
            continue
        name = statement.name
        if known and name.text not in known:
            _report_unknown_field(name, kind, diagnostics, origins)
        elif name.text in found:
            what = f"`{shorten(name.text)}` in one {kind}"
            _report_duplicate(what, found[name.text].name.span, name.span, diagnostics)
        else:
            found[name.text] = statement
            origins.setdefault(
                name.text, statement.value.span if statement.value else statement.name.span
            )
    return found


def _report_unknown_field(
    name: Word, kind: str, diagnostics: Diagnostics, origins: dict[str, Span]
) -> None:
    """Report the field; what it was probably meant to be is then not missing."""
    known = keywords_in(kind if kind in BLOCK_FIELDS else "figure")
    hint = spelling_hint(name.text, known)
    home = block_parent(name.text)
    if home is not None:
        hint = f"a {name.text} belongs in a {home} and is written `{name.text} NAME {{ ... }}`"
    elif kind == "joint" and name.text in _VELOCITY_WORDS:
        hint = "velocities are not part of a figure; set them when it is simulated"
    diagnostics.error(f"unknown field `{shorten(name.text)}` in a {kind}", name.span, hint)
    meant = closest_match(name.text, known)
    if meant is not None:
        origins.setdefault(meant, name.span)


def _resolve_root(field: Field, diagnostics: Diagnostics) -> SiteRef | None:
    """`root = segment.site;`."""
    if isinstance(field.value, SiteReference):
        return _site_ref(field.value)
    if field.value is not None:
        diagnostics.error("the root is a site", field.value.span, "write `root = SEGMENT.SITE;`")
    diagnostics.is_incomplete = True
    return None


def _resolve_attribute(block: Block, name: Word, diagnostics: Diagnostics) -> Attribute:
    origins: dict[str, Span] = {"name": name.span}
    read = {
        key: values.resolve_attribute_value(field.value, diagnostics)
        for key, field in _collect_fields(block, diagnostics, origins).items()
        if field.value is not None
    }
    fields = {key: value for key, value in read.items() if value is not None}
    return Attribute(name.text, fields, origins)


def _resolve_segment(block: Block, name: Word, diagnostics: Diagnostics) -> Segment:
    origins: dict[str, Span] = {"name": name.span}
    fields = _collect_fields(block, diagnostics, origins)
    psurf, mass, inertia, attributes, contact = (
        field.value if (field := fields.get(key)) else None
        for key in ("psurf", "mass", "inertia", "attribute", "contact")
    )
    words = values.resolve_names(attributes, diagnostics) if attributes else ()
    origins |= {f"attribute {word.text}": word.span for word in words}
    spheres = values.resolve_spheres(contact, diagnostics) if contact else ()
    origins |= {f"contact {index}": place for index, (_, place) in enumerate(spheres)}
    if psurf is not None and not isinstance(psurf, String | Word):
        diagnostics.error("the name of a file is expected here", psurf.span, 'as in `"floor.pss"`')
    return Segment(
        name=name.text,
        mass=mass and values.resolve_number(mass, Dimension.MASS, diagnostics),
        inertia=inertia and values.resolve_vector(inertia, Dimension.INERTIA, diagnostics),
        psurf=psurf.text if isinstance(psurf, String | Word) else None,
        attributes=tuple(word.text for word in words),
        sites=_resolve_sites(block, diagnostics),
        contact_spheres=tuple(sphere for sphere, _ in spheres),
        origins=origins,
    )


def _resolve_sites(segment: Block, diagnostics: Diagnostics) -> dict[str, Site]:
    """The sites of a segment; all `site NAME->...` lines of one name make one site."""
    gathered: dict[str, Block] = {}
    for block in _blocks(segment.body):
        if block.name is None:
            continue
        first = gathered.get(block.name.text)
        if first is None:
            gathered[block.name.text] = block
            continue
        if first.opening and block.opening:
            what = f"site named `{shorten(block.name.text)}`"
            _report_duplicate(what, first.kind.span, block.name.span, diagnostics)
            continue
        body, opening = (*first.body, *block.body), first.opening or block.opening
        gathered[block.name.text] = Block(first.kind, first.name, body, opening)
    return {
        key: _resolve_site(block, block.name or block.kind, diagnostics)
        for key, block in gathered.items()
    }


def _resolve_site(block: Block, name: Word, diagnostics: Diagnostics) -> Site:
    origins: dict[str, Span] = {"name": name.span}
    fields = _collect_fields(block, diagnostics, origins)
    place = fields.get("location")
    where = values.resolve_location(place.value, diagnostics) if place and place.value else None
    loads: dict[str, Vector | None] = {
        key: values.resolve_vector(field.value, dimension, diagnostics)
        for key, dimension in _LOAD_DIMENSIONS.items()
        if (field := fields.get(key)) and field.value
    }
    return Site(
        name=name.text,
        location=where or Location(),
        global_force=loads.get("globalforce"),
        local_force=loads.get("localforce"),
        global_moment=loads.get("globalmoment"),
        local_moment=loads.get("localmoment"),
        origins=origins,
    )


def _resolve_joint(block: Block, name: Word, diagnostics: Diagnostics) -> Joint | None:
    """A joint; None when nothing readable says what it connects."""
    origins: dict[str, Span] = {"name": name.span}
    connect = _find_connect(block, name, diagnostics)
    fields = _collect_fields(block, diagnostics, origins)
    kind = fields.get("type")
    chain = values.resolve_chain(kind.value, diagnostics) if kind and kind.value else None
    lost = "type" in origins and chain is None
    factors = chain or ()
    rows = {
        key: resolve_joint_field(fields[key], factors, diagnostics)
        for key in _JOINT_FIELD_DIMENSIONS
        if key in fields and not lost
    }
    if connect is None:
        return None
    origins |= {
        "connect": connect.span,
        "parent": connect.parent.span,
        "child": connect.child.span,
    }
    return Joint(
        name=name.text,
        parent=_site_ref(connect.parent),
        child=_site_ref(connect.child),
        chain=factors,
        displacement=rows.get("displacement") or (0.0,) * len(factors),
        stiff=rows.get("stiff"),
        rest=rows.get("rest"),
        damp=rows.get("damp"),
        lower_limit=rows.get("llimit"),
        upper_limit=rows.get("ulimit"),
        origins=origins,
    )


def _is_follow(statement: Statement) -> TypeGuard[Field]:
    return isinstance(statement, Field) and statement.name.text == "follow"


_CURVE_FORM = (
    "`free`, `polynomial(JOINT, 1, c0, c1, ...)` in rad and m, or `simm_spline(JOINT, 1, x, y, x, "
    "y, ...)`"
)


def _with_followers(
    joint: Joint, node: Value, draft: FigureDraft, diagnostics: Diagnostics
) -> Joint:
    """Return a joint with what its displacements follow, once all joints are known."""
    items = node.items if isinstance(node, ItemList) else (node,)
    if len(items) != len(joint.chain):
        if "type" not in joint.origins or joint.chain:
            diagnostics.error(
                f"{len(items)} entries instead of {len(joint.chain)}",
                node.span,
                "`follow` has one for each degree of freedom",
            )
        return joint
    followers = tuple(
        _resolve_follower(item, axis, draft, diagnostics)
        for item, axis in zip(items, joint.chain, strict=True)
    )
    return replace(joint, followers=followers)


def _resolve_follower(
    node: Value, axis: JointAxis, draft: FigureDraft, diagnostics: Diagnostics
) -> Follower | None:
    """Return the rule of a follower; None for a free one, or with an error reported."""
    if isinstance(node, Word) and node.text == "free":
        return None
    if not isinstance(node, Call) or node.name.text not in tuple(CurveKind):
        diagnostics.error("this is not what a displacement follows", node.span, _CURVE_FORM)
        return None
    control, place, *_ = (*node.arguments.items, node, node)
    if not isinstance(control, Word) or not isinstance(place, Number):
        diagnostics.error("a curve names the joint that it follows", node.span, _CURVE_FORM)
        return None
    joint = draft.joints.get(control.text)
    if joint is None:
        hint = spelling_hint(control.text, draft.joints)
        diagnostics.error(f"unknown joint `{shorten(control.text)}`", control.span, hint)
        return None
    count = len(joint.chain)
    if not place.text.isdecimal() or not 1 <= int(place.text) <= count or place.unit:
        what = f"`{shorten(joint.name)}` has {count} displacements"
        diagnostics.error(what, place.span, "counted from 1, in the order of its `type`")
        return None
    index, kind = int(place.text) - 1, CurveKind(node.name.text)
    written = ItemList(tuple(node.arguments.items[2:]), node.span)
    dimensions = [Dimension.NUMBER] * len(written.items)
    if kind is not CurveKind.POLYNOMIAL:
        pair = (joint.chain[index], axis)
        both = [values.axis_dimension(one.kind, *_DISPLACEMENT) for one in pair]
        dimensions = [both[k % 2] for k in range(len(written.items))]
    read = values.resolve_numbers(written, dimensions, "", diagnostics)
    if read is None:
        return None
    try:
        return Follower(joint.name, index, FollowerCurve(kind, read))
    except ModelError as failure:
        diagnostics.error(str(failure), node.span, _CURVE_FORM)
        return None


def _find_connect(block: Block, name: Word, diagnostics: Diagnostics) -> Connect | None:
    """The one `connect` of a joint."""
    found = [statement for statement in block.body if isinstance(statement, Connect)]
    for second in found[1:]:
        _report_duplicate("`connect` in one joint", found[0].span, second.span, diagnostics)
    wrong = [s for s in block.body if isinstance(s, Field) and s.name.text == "connect"]
    if not found and not diagnostics.has_syntax_errors:
        diagnostics.error(
            "this `connect` does not name two sites"
            if wrong
            else f"joint `{shorten(name.text)}` connects nothing",
            wrong[0].name.span if wrong else name.span,
            "write `connect SEGMENT.SITE to SEGMENT.SITE;`",
        )
    if not found:
        diagnostics.is_incomplete = True
    return found[0] if found else None


def resolve_joint_field(
    field: Field, chain: tuple[JointAxis, ...], diagnostics: Diagnostics
) -> tuple[float, ...] | None:
    """A field with one number for each degree of freedom."""
    if field.value is None:
        return None
    about, along = _JOINT_FIELD_DIMENSIONS[field.name.text]
    dimensions = [values.axis_dimension(factor.kind, about, along) for factor in chain]
    what = (
        f"`{field.name.text}` has a value for each degree of freedom; this joint has {len(chain)}"
    )
    if not chain:
        what = "a joint without `type` is rigid: it has no degrees of freedom"
    return values.resolve_numbers(field.value, dimensions, what, diagnostics)


def _site_ref(node: SiteReference) -> SiteRef:
    return SiteRef(node.segment.text, node.site.text)
