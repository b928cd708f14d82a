"""The springs file, `STEM.springs.toml`.

It has one `[[spring]]` for each curve, one `[[coupled]]` for each law over several joints and one
`[[reach]]` for the directions of each limb that has them. The unit of every number is part of its
key. Several joints may share a curve: its angle is that of each joint's declared axis, so the
mirror image needs no second table.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from generator.diagnostics import Diagnostics, Source, Span, shorten
from generator.file_kind import FileKind
from generator.springs_file.axes import (
    AXIS_NAMES,
    ONLY_AXIS,
    SLIDE_NAMES,
    is_slide,
    names_other_joint,
)
from generator.springs_file.coupled import PROVENANCE_ROWS, CoupledEntry, parse_coupled_entry
from generator.springs_file.laws import (
    DECREASING_KEY,
    ELASTIC_KEYS,
    INCREASING_KEY,
    LAW_FORMS,
    LAW_ROWS,
    SLIDE_FORM,
    EntryLaw,
    LawForm,
    parse_law,
    write_law,
)
from generator.springs_file.published import PublishedLaw
from generator.springs_file.reach import ReachEntry, parse_reach_entry
from generator.text_io import once_per_source
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.rows import (
    ENERGY_HINT,
    Choice,
    Names,
    Number,
    TableRows,
    Text,
    lines_of_rows,
    read_rows,
)
from springs import Damping, SphericalLaw
from springs.damping import DEFAULT_SLIP_RATE
from springs.short_repr import short_repr
from springs.stop import DEFAULT_STOP_ONSET, DEFAULT_STOP_STIFFNESS

SPRING_TABLE = "spring"
"""Name of the tables of springs about one axis."""

COUPLED_TABLE = "coupled"
"""Name of the tables of laws over several joints."""

REACH_TABLE = "reach"
"""Name of the tables of the directions that a limb reaches."""

REACH_AXES = ("reach", "turn")
"""Names of the angles beyond the boundary of a reach and beyond an end of the turn."""

EXTENDS_KEY, BASE_KEY = "extends", "base"
NO_BASE = "none"

FILE_ROWS = TableRows(
    "springs file",
    (
        Text("figure"),
        Text(EXTENDS_KEY),
        Choice(BASE_KEY, (NO_BASE,)),
        Choice("law", tuple(SphericalLaw)),
    ),
    (SPRING_TABLE, COUPLED_TABLE, REACH_TABLE),
)
"""Rows above all tables."""


class _Axis(Choice[str]):
    """The name of an axis; "joint" for the only axis of a joint, which is None in an entry."""

    def value_of(self, owner: object) -> str:
        """Return the name."""
        return super().value_of(owner) or ONLY_AXIS


_HEAD = (
    Names("joints", example='["left_knee", "right_knee"]'),
    _Axis("axis", (*AXIS_NAMES, ONLY_AXIS, *REACH_AXES, *SLIDE_NAMES), is_always_written=True),
    Text("motion"),
)
_HYSTERESIS = Number("hysteresis_Nm", 0.0, hint=ENERGY_HINT, attribute="hysteresis")
_SLIP_RATE = Number(
    "slip_rad_s",
    is_positive=True,
    hint="the rate at which friction reaches 76 % of its full value, such as 0.01",
    attribute="slip_rate",
)
_SCALE = Number("scale", 0.0, hint=ENERGY_HINT)
_MODIFIERS = (_SCALE, Number("offset_deg", attribute="offset"), _HYSTERESIS)
"""Rows that change any elastic law."""

_VISCOUS = Number(
    "viscous_Nms_rad", 0.0, hint=ENERGY_HINT, attribute="damping.viscous", is_always_written=True
)
_COULOMB = Number("coulomb_Nm", 0.0, hint=ENERGY_HINT, attribute="damping.coulomb")
_SLIDE_VISCOUS = Number(
    "viscous_Ns_m", 0.0, hint=ENERGY_HINT, attribute="damping.viscous", is_always_written=True
)
_SLIDE_COULOMB = Number("coulomb_N", 0.0, hint=ENERGY_HINT, attribute="damping.coulomb")
_SLIDE_DAMPING = (_SLIDE_VISCOUS, _SLIDE_COULOMB)
"""Rows of the damping along a translation."""

_WITHOUT_LAW = (
    _VISCOUS,
    _COULOMB,
    Number("stop_stiffness_Nm_rad", is_positive=True, hint=ENERGY_HINT, attribute="stop_stiffness"),
    Number("stop_onset_deg", is_positive=True, hint=ENERGY_HINT, attribute="stop_onset"),
)
"""Rows that are enough without an elastic law."""

_TAIL = (*_MODIFIERS, _SLIP_RATE, *_WITHOUT_LAW, *PROVENANCE_ROWS)
_SLIDE_TAIL = (_SCALE, *_SLIDE_DAMPING, *PROVENANCE_ROWS)
SPRING_ROWS = TableRows("spring", (*_HEAD, *LAW_ROWS, *_TAIL, *_SLIDE_DAMPING))

_SLIDE_KEYS = tuple(row.key for row in (*SLIDE_FORM.rows, *_SLIDE_DAMPING))
"""Keys that only a translation has."""

_SHARED_KEYS = tuple(row.key for row in (*_HEAD, _SCALE, *PROVENANCE_ROWS))
"""Keys of rotations and translations."""


@short_repr
@dataclass(frozen=True)
class SpringEntry:
    """A `[[spring]]` table, in SI.

    What a published curve brings along (reference, damping, motion) is here as if it were written.

    Attributes:
        joints: the joints that have this spring.
        axis: "x", "y" or "z" of the joint frame, None for the only axis of a joint, one of
            `REACH_AXES`, or one of `SLIDE_NAMES`, along which [m], [N] and [N/m] stand for [rad],
            [N m] and [N m/rad].
        law: elastic law, or None for damping alone.
        scale: factor of the elastic torque.
        offset: shift of the elastic curve towards larger angles [rad].
        hysteresis: difference of the curves of a decreasing and an increasing angle [N m].
        slip_rate: rate at which the hysteresis reaches 76 % of its full value [rad/s].
        damping: viscous and Coulomb damping; None leaves that of the file that is extended.
        stop_stiffness: stop stiffness of the stops at the figure's limits [N m/rad].
        stop_onset: angle over which they grow [rad].
        motion: name of a positive angle.
        reference: where the numbers are from.
        why: why they are read as they are.
        origins: places of the keys' values; "spring" is the table, "joints.0" the first joint.
    """

    joints: tuple[str, ...]
    axis: str | None = None
    law: EntryLaw | None = None
    scale: float = 1.0
    offset: float = 0.0
    hysteresis: float = 0.0
    slip_rate: float = DEFAULT_SLIP_RATE
    damping: Damping | None = None
    stop_stiffness: float = DEFAULT_STOP_STIFFNESS
    stop_onset: float = DEFAULT_STOP_ONSET
    motion: str = ""
    reference: str = ""
    why: str = ""
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)


@short_repr
@dataclass(frozen=True)
class SpringsFile:
    """Content of a springs file.

    Attributes:
        entries: springs about one axis.
        figure: the figure that it was written for.
        law: law of spherical joints; None for that of the file that is extended.
        coupled: laws over several joints.
        reaches: directions that limbs reach.
        extends: name or path of the springs file whose other springs stay; None for the figure's
            own file.
        stands_alone: whether no other springs stay (`base = "none"`).
        origins: spans of the keys.
    """

    entries: tuple[SpringEntry, ...]
    figure: str | None = None
    law: SphericalLaw | None = None
    coupled: tuple[CoupledEntry, ...] = ()
    reaches: tuple[ReachEntry, ...] = ()
    extends: str | None = None
    stands_alone: bool = False
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)

    @property
    def base(self) -> str | None:
        """Value of the key `base`; None without it."""
        return NO_BASE if self.stands_alone else None


def _parse_springs(source: Source, diagnostics: Diagnostics) -> SpringsFile | None:
    top = parse_document(source, "springs file", diagnostics)
    if top is None:
        return None
    FILE_ROWS.check_keys(top)
    values = FILE_ROWS.read(top)
    stands_alone = values.pop(BASE_KEY, None) is not None
    if EXTENDS_KEY in values and stands_alone:
        top.error(BASE_KEY, f"`{BASE_KEY}` excludes `{EXTENDS_KEY}`", "write one of them")
    entries = [_parse_entry(table) for table in top.tables(SPRING_TABLE, "springs")]
    coupled = [parse_coupled_entry(table) for table in top.tables(COUPLED_TABLE, "coupled laws")]
    reaches = [parse_reach_entry(table) for table in top.tables(REACH_TABLE, "reaches")]
    if not (entries or coupled or reaches or "law" in values or diagnostics.has_errors):
        hint = "write `[[spring]]`, or `law` for the springs in the fields of a figure"
        diagnostics.error("this file has no spring", top.spans.table(""), hint)
    return SpringsFile(
        tuple(entry for entry in entries if entry),
        coupled=tuple(entry for entry in coupled if entry),
        reaches=tuple(entry for entry in reaches if entry),
        stands_alone=stands_alone,
        origins={key: top.span(key) for key in top.content},
        **values,
    )


SPRINGS_FILE = FileKind("springs", ".springs.toml", once_per_source(_parse_springs))


def _parse_entry(table: TableReader) -> SpringEntry | None:
    """Parse one `[[spring]]` table; None, with a fault noted, if it has no joints."""
    SPRING_ROWS.check_keys(table)
    slides = is_slide(table.content.get("axis"))
    if _has_keys_of_other_kind(table, slides=slides):
        return None
    _check_combination(table, slides=slides)
    law = parse_law(table)
    values = read_rows(table, (*_HEAD, *(_SLIDE_TAIL if slides else _TAIL)))
    joints: tuple[str, ...] = values.get("joints", ())
    if not joints:
        return None
    if isinstance(law, PublishedLaw):
        texts = {
            "motion": law.motion_name(joints),
            "reference": str(law.row.reference),
            "why": law.why,
        }
        values |= {name: text for name, text in texts.items() if not values.get(name)}
        values.setdefault(_VISCOUS.attributes[0], law.row.damping)
        _warn_joint_mismatch(table, law, joints)
    if values.get("axis") == ONLY_AXIS:
        del values["axis"]
    viscous, coulomb = (values.pop(row.attributes[0], None) for row in (_VISCOUS, _COULOMB))
    if not viscous is coulomb is None:
        values["damping"] = Damping(viscous or 0.0, coulomb or 0.0)
    origins = {key: table.span(key) for key in table.content} | {"spring": table.header_span}
    origins |= {f"joints.{k}": table.span("joints", k) for k in range(len(joints))}
    return SpringEntry(law=law, origins=origins, **values)


def entry_lines(entry: SpringEntry) -> Iterator[str]:
    """Yield the lines of a `[[spring]]` table."""
    yield from lines_of_rows(entry, _HEAD)
    if entry.law is not None:
        yield from write_law(entry.law)
    yield from lines_of_rows(entry, _SLIDE_TAIL if is_slide(entry.axis) else _TAIL)


def _has_keys_of_other_kind(table: TableReader, *, slides: bool) -> bool:
    """Return whether a spring has keys of a rotation along a translation, or the other way."""
    if slides:
        wrong = [key for key in table.content if key not in (*_SLIDE_KEYS, *_SHARED_KEYS)]
    else:
        wrong = [key for key in table.content if key in _SLIDE_KEYS]
    for key in wrong:
        if slides:
            message = f"`{shorten(key)}` is of a rotation, but the axis is that of a translation"
            table.error(key, message, f"a translation has {', '.join(_SLIDE_KEYS)}")
        else:
            message = f"`{key}` is of a translation, but the axis is that of a rotation"
            table.error(key, message, f"a translation has an axis such as `{SLIDE_NAMES[-1]}`")
    return bool(wrong)


def _check_combination(table: TableReader, *, slides: bool) -> None:
    """Check that a table has a law or damping, at most one law, and only keys of that law."""
    content, rows = table.content, _SLIDE_DAMPING if slides else _WITHOUT_LAW
    sufficient_keys = tuple(row.key for row in rows)
    present = [form for form in LAW_FORMS if form.is_present(table)]
    if not present and not any(key in content for key in sufficient_keys):
        elastic = [key for key in ELASTIC_KEYS if (key in _SLIDE_KEYS) is slides]
        known = (*elastic, *sufficient_keys)
        table.diagnostics.error(
            "this spring has no law", table.header_span, f"it needs one of: {', '.join(known)}"
        )
    for form in present:
        first = next(key for key in form.required_keys if key in content)
        for key in form.required_keys:
            if key not in content:
                keys = f"{form.name}: {', '.join(form.required_keys)}"
                table.error(first, f"`{first}` needs `{key}` beside it", keys)
    for form in present[1:]:
        key = next(key for key in form.required_keys if key in content)
        table.error(
            key,
            f"a spring is {present[0].name} or {form.name}, not both",
            "one elastic law a table",
        )
    for key, owner, hint in _misplaced_keys(table, present):
        table.error(key, f"`{key}` belongs to {owner}", hint)


def _misplaced_keys(
    table: TableReader, present: list[LawForm[Any]]
) -> Iterator[tuple[str, str, str]]:
    """Yield keys whose law is absent, with what they belong to and a hint."""
    content = table.content
    for key in dict.fromkeys(key for form in LAW_FORMS for key in form.optional_keys):
        owners = [form for form in LAW_FORMS if key in form.optional_keys]
        if key in content and not any(form in present for form in owners):
            hint = " or ".join(f"`{form.required_keys[0]}`" for form in owners)
            yield key, " or ".join(form.name for form in owners), f"with {hint}"
    for key in (row.key for row in _MODIFIERS):
        if key in content and not present:
            known = (one for one in ELASTIC_KEYS if one not in _SLIDE_KEYS)
            yield key, "an elastic law", f"with one of: {', '.join(known)}"
    has_two = any(INCREASING_KEY in form.required_keys for form in present)
    if _HYSTERESIS.key in content and has_two:
        yield (_HYSTERESIS.key, "a law of one curve", "two curves already define their difference")
    if _SLIP_RATE.key in content and _HYSTERESIS.key not in content and not has_two:
        hint = f"with `{_HYSTERESIS.key}`, or with `{INCREASING_KEY}` and `{DECREASING_KEY}`"
        yield _SLIP_RATE.key, "a law that depends on the direction", hint


def _warn_joint_mismatch(table: TableReader, law: PublishedLaw, joints: tuple[str, ...]) -> None:
    """Warn of each joint whose name does not fit the published curve."""
    for k, joint in enumerate(joints):
        if names_other_joint(law.row.motion, joint):
            message = (
                f"`{law.key}` is a curve of {law.row.motion}, but the joint is `{shorten(joint)}`"
            )
            table.diagnostics.warning(
                message, table.span("joints", k), "is it meant for another joint?"
            )
