"""From the syntax tree to the parts of a figure: every word gets its meaning, in SI.

A figure in the making: what could be read, before it is known to be whole.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from generator.diagnostics import Findings, Span, closest, nearest, shorten
from generator.figure import (
    Attribute,
    Factor,
    Figure,
    Joint,
    Location,
    Segment,
    Site,
    SiteRef,
    Vector,
)
from generator.figure_file import values
from generator.figure_file.lexer import FIELDS, block_home, known_in
from generator.figure_file.parser import Block, Connect, Field, Reference, Statement, Text, Word
from generator.units import Dimension


@dataclass
class Draft:
    """The parts of a figure. `place` is its keyword or name; `root` is None while unknown.

    `joints` holds those with a readable `connect`; `segments` holds all that are named.
    """

    place: Span
    name: str | None = None
    segments: dict[str, Segment] = field(default_factory=dict[str, Segment])
    joints: dict[str, Joint] = field(default_factory=dict[str, Joint])
    attributes: dict[str, Attribute] = field(default_factory=dict[str, Attribute])
    root: SiteRef | None = None
    origins: dict[str, Span] = field(default_factory=dict[str, Span])

    def figure(self, root: SiteRef) -> Figure:
        """The figure that stands on `root`."""
        return Figure(
            segments=self.segments,
            joints=self.joints,
            root=root,
            attributes=self.attributes,
            name=self.name,
            origins=self.origins,
        )


def place_of(origins: Mapping[str, Span], *names: str) -> Span | None:
    """Where the first of `names` is written that is written anywhere; else the thing itself."""
    return next((origins[name] for name in (*names, "name") if name in origins), None)


_VELOCITY_WORDS = ("velocity", "velocities", "rate", "speed")

_LOADS: Mapping[str, Dimension] = {
    "globalforce": Dimension.FORCE,
    "localforce": Dimension.FORCE,
    "globalmoment": Dimension.MOMENT,
    "localmoment": Dimension.MOMENT,
}

_PER_AXIS: Mapping[str, tuple[Dimension, Dimension]] = {
    "displacement": (Dimension.ANGLE, Dimension.LENGTH),
    "stiff": (Dimension.ANGULAR_STIFFNESS, Dimension.LINEAR_STIFFNESS),
    "rest": (Dimension.ANGLE, Dimension.LENGTH),
    "damp": (Dimension.ANGULAR_DAMPING, Dimension.LINEAR_DAMPING),
    "llimit": (Dimension.ANGLE, Dimension.LENGTH),
    "ulimit": (Dimension.ANGLE, Dimension.LENGTH),
}
"""What a joint's field measures about and along an axis."""


def resolve(tree: Block, findings: Findings) -> Draft:
    """The parts of the figure that `tree` describes; faults go to `findings`."""
    draft = Draft(tree.name.span if tree.name else tree.kind.span)
    draft.name = tree.name.text if tree.name else None
    draft.origins["name"] = draft.place
    taken: dict[tuple[str, str], Word] = {}
    for block in _blocks(tree.body):
        if block.name is None or not _is_new(taken, block.kind.text, block.name, findings):
            continue
        match block.kind.text:
            case "attribute":
                draft.attributes[block.name.text] = _attribute(block, block.name, findings)
            case "segment":
                draft.segments[block.name.text] = _segment(block, block.name, findings)
            case _:
                joint = _joint(block, block.name, findings)
                if joint is not None:
                    draft.joints[block.name.text] = joint
    fields = _fields(tree, findings, draft.origins)
    if "root" in fields:
        draft.root = _root(fields["root"], findings)
    return draft


def _blocks(body: Iterable[Statement]) -> list[Block]:
    return [statement for statement in body if isinstance(statement, Block)]


def _is_new(taken: dict[tuple[str, str], Word], kind: str, name: Word, findings: Findings) -> bool:
    """Whether nothing of this kind has the name yet; a second one is a fault."""
    first = taken.setdefault((kind, name.text), name)
    if first is not name:
        _second(f"{kind} named `{shorten(name.text)}`", first.span, name.span, findings)
    return first is name


def _second(what: str, first: Span, second: Span, findings: Findings) -> None:
    """Something stands twice that may stand once."""
    findings.error(f"a second {what}", second, f"the first stands in line {first.line}")


def _fields(block: Block, findings: Findings, origins: dict[str, Span]) -> dict[str, Field]:
    """The fields of a block by name, each known in its kind and there once."""
    kind, found = block.kind.text, dict[str, Field]()
    known = FIELDS.get(kind, FIELDS["figure"])
    for statement in block.body:
        if not isinstance(statement, Field):
            continue
        name = statement.name
        if known and name.text not in known:
            _unknown_field(name, kind, findings, origins)
        elif name.text in found:
            what = f"`{shorten(name.text)}` in one {kind}"
            _second(what, found[name.text].name.span, name.span, findings)
        else:
            found[name.text] = statement
            origins.setdefault(
                name.text, statement.value.span if statement.value else statement.name.span
            )
    return found


def _unknown_field(name: Word, kind: str, findings: Findings, origins: dict[str, Span]) -> None:
    """Report the field; what it was probably meant to be is then not missing."""
    known = known_in(kind if kind in FIELDS else "figure")
    hint = nearest(name.text, known)
    home = block_home(name.text)
    if home is not None:
        hint = f"a {name.text} stands in a {home} and is written `{name.text} NAME {{ ... }}`"
    elif kind == "joint" and name.text in _VELOCITY_WORDS:
        hint = "velocities are no part of a figure; they are given when it is simulated"
    findings.error(f"unknown field `{shorten(name.text)}` in a {kind}", name.span, hint)
    meant = closest(name.text, known)
    if meant is not None:
        origins.setdefault(meant, name.span)


def _root(field: Field, findings: Findings) -> SiteRef | None:
    """`root = segment.site;`."""
    if isinstance(field.value, Reference):
        return _site_ref(field.value)
    if field.value is not None:
        findings.error("the root is a site", field.value.span, "write `root = SEGMENT.SITE;`")
    findings.partial = True
    return None


def _attribute(block: Block, name: Word, findings: Findings) -> Attribute:
    origins: dict[str, Span] = {"name": name.span}
    read = {
        key: values.free_value(field.value, findings)
        for key, field in _fields(block, findings, origins).items()
        if field.value is not None
    }
    fields = {key: value for key, value in read.items() if value is not None}
    return Attribute(name.text, fields, origins)


def _segment(block: Block, name: Word, findings: Findings) -> Segment:
    origins: dict[str, Span] = {"name": name.span}
    fields = _fields(block, findings, origins)
    psurf, mass, inertia, attributes = (
        field.value if (field := fields.get(key)) else None
        for key in ("psurf", "mass", "inertia", "attribute")
    )
    words = values.words(attributes, findings) if attributes else ()
    origins |= {f"attribute {word.text}": word.span for word in words}
    if psurf is not None and not isinstance(psurf, Text | Word):
        findings.error("the name of a file is expected here", psurf.span, 'as in `"floor.pss"`')
    return Segment(
        name=name.text,
        mass=mass and values.number(mass, Dimension.MASS, findings),
        inertia=inertia and values.vector(inertia, Dimension.INERTIA, findings),
        psurf=psurf.text if isinstance(psurf, Text | Word) else None,
        attributes=tuple(word.text for word in words),
        sites=_sites(block, findings),
        origins=origins,
    )


def _sites(segment: Block, findings: Findings) -> dict[str, Site]:
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
            _second(what, first.kind.span, block.name.span, findings)
            continue
        body, opening = (*first.body, *block.body), first.opening or block.opening
        gathered[block.name.text] = Block(first.kind, first.name, body, opening)
    return {
        key: _site(block, block.name or block.kind, findings) for key, block in gathered.items()
    }


def _site(block: Block, name: Word, findings: Findings) -> Site:
    origins: dict[str, Span] = {"name": name.span}
    fields = _fields(block, findings, origins)
    place = fields.get("location")
    where = values.location(place.value, findings) if place and place.value else None
    loads: dict[str, Vector | None] = {
        key: values.vector(field.value, dimension, findings)
        for key, dimension in _LOADS.items()
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


def _joint(block: Block, name: Word, findings: Findings) -> Joint | None:
    """A joint; None when nothing readable says what it connects."""
    origins: dict[str, Span] = {"name": name.span}
    connect = _connect(block, name, findings)
    fields = _fields(block, findings, origins)
    kind = fields.get("type")
    chain = values.chain(kind.value, findings) if kind and kind.value else None
    lost = "type" in origins and chain is None
    factors = chain or ()
    rows = {
        key: per_axis(fields[key], factors, findings)
        for key in _PER_AXIS
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


def _connect(block: Block, name: Word, findings: Findings) -> Connect | None:
    """The one `connect` of a joint."""
    found = [statement for statement in block.body if isinstance(statement, Connect)]
    for second in found[1:]:
        _second("`connect` in one joint", found[0].span, second.span, findings)
    wrong = [s for s in block.body if isinstance(s, Field) and s.name.text == "connect"]
    if not found and not findings.malformed:
        findings.error(
            "this `connect` names no two sites"
            if wrong
            else f"joint `{shorten(name.text)}` connects nothing",
            wrong[0].name.span if wrong else name.span,
            "write `connect SEGMENT.SITE to SEGMENT.SITE;`",
        )
    if not found:
        findings.partial = True
    return found[0] if found else None


def per_axis(
    field: Field, chain: tuple[Factor, ...], findings: Findings
) -> tuple[float, ...] | None:
    """A field with one number for each degree of freedom."""
    if field.value is None:
        return None
    about, along = _PER_AXIS[field.name.text]
    dimensions = [about if factor.kind == "R" else along for factor in chain]
    what = (
        f"`{field.name.text}` has a value for each degree of freedom; this joint has {len(chain)}"
    )
    if not chain:
        what = "a joint without `type` is rigid: it has no degrees of freedom"
    return values.numbers(field.value, dimensions, what, findings)


def _site_ref(node: Reference) -> SiteRef:
    return SiteRef(node.segment.text, node.site.text)
