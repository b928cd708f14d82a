"""The springs file, `STEM.springs.toml`.

It has one `[[spring]]` for each curve and one `[[coupled]]` for each law over several joints. The
unit of every number is part of its key. Several joints may share a curve: its angle is that of each
joint's declared axis, so the mirror image needs no second table.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, cast

from generator.diagnostics import (
    Diagnostics,
    Source,
    Span,
    shorten,
    spelling_hint,
)
from generator.file_kind import FileKind
from generator.springs_file.axes import AXIS_NAMES, names_other_joint
from generator.springs_file.coupled import CoupledEntry, parse_coupled_entry
from generator.springs_file.laws import (
    DECREASING_KEY,
    ELASTIC_KEYS,
    HYSTERESIS_KEY,
    INCREASING_KEY,
    LAW_FORMS,
    LAW_KEYS,
    MODIFIER_KEYS,
    SLIP_RATE_KEY,
    EntryLaw,
    LawForm,
    parse_law,
)
from generator.springs_file.published import PublishedLaw
from generator.toml_file.reader import TableReader, parse_document
from generator.toml_file.spans import TomlSpans, locate_keys
from springs import Damping, Joining
from springs.damping import DEFAULT_SLIP_RATE
from springs.short_repr import short_repr
from springs.stop import DEFAULT_STOP_ONSET, DEFAULT_STOP_STIFFNESS

SPRING_TABLE = "spring"
"""Name of the tables of springs about one axis."""

COUPLED_TABLE = "coupled"
"""Name of the tables of laws over several joints."""

TEXT_KEYS = ("motion", "reference", "why")
DAMPING_AND_STOP_KEYS = ("viscous_Nms_rad", "coulomb_Nm", "stop_stiffness_Nm_rad", "stop_onset_deg")
SPRING_KEYS = ("joints", "axis", *LAW_KEYS, *DAMPING_AND_STOP_KEYS, *TEXT_KEYS)
EXTENDS_KEY, BASE_KEY = "extends", "base"
NO_BASE = "none"
SPRINGS_FILE_KEYS = ("figure", EXTENDS_KEY, BASE_KEY, "law", SPRING_TABLE, COUPLED_TABLE)


@short_repr
@dataclass(frozen=True)
class SpringEntry:
    """A `[[spring]]` table, in SI.

    What a published curve brings along (reference, damping, motion) is here as if it were written.

    Attributes:
        joints: the joints that have this spring.
        axis: "x", "y" or "z" of the joint frame, or None for the only axis of a joint.
        law: elastic law, or None for damping alone.
        scale: factor of the elastic torque.
        offset: shift of the elastic curve towards larger angles [rad].
        hysteresis: difference of the curves of a decreasing and an increasing angle [N m].
        slip_rate: rate at which the hysteresis reaches 76 % of its full value [rad/s].
        damping: viscous and Coulomb damping; None leaves that of the file that is extended.
        stop_stiffness: of the stops at the figure's limits [N m/rad].
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
        joining: law of spherical joints; None for that of the file that is extended.
        coupled: laws over several joints.
        extends: name or path of the springs file whose other springs stay; None for the figure's
            own file.
        stands_alone: whether no other springs stay (`base = "none"`).
        origins: spans of the keys.
    """

    entries: tuple[SpringEntry, ...]
    figure: str | None = None
    joining: Joining | None = None
    coupled: tuple[CoupledEntry, ...] = ()
    extends: str | None = None
    stands_alone: bool = False
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)


def _parse_springs(source: Source, diagnostics: Diagnostics) -> SpringsFile | None:
    document = parse_document(source, "springs file", diagnostics)
    return None if document is None else _parse_content(document, locate_keys(source), diagnostics)


SPRINGS_FILE = FileKind("springs", ".springs.toml", _parse_springs)


def _parse_content(
    document: Mapping[str, Any], spans: TomlSpans, diagnostics: Diagnostics
) -> SpringsFile:
    top = TableReader(document, "", 0, spans, diagnostics)
    top.reject_unknown_keys(SPRINGS_FILE_KEYS, "springs file")
    figure, law = top.text("figure"), None
    if (name := top.text("law")) is not None:
        laws = [joining.value for joining in Joining]
        if name in laws:
            law = Joining(name)
        else:
            diagnostics.error(
                f"unknown law `{shorten(name)}`", top.span("law"), spelling_hint(name, laws)
            )
    extends, base = top.text(EXTENDS_KEY), top.choice(BASE_KEY, (NO_BASE,))
    if extends is not None and base is not None:
        top.error(BASE_KEY, f"`{BASE_KEY}` excludes `{EXTENDS_KEY}`", "write one of them")
    entries = [_parse_entry(table) for table in _table_readers(document, SPRING_TABLE, top)]
    coupled = [parse_coupled_entry(table) for table in _table_readers(document, COUPLED_TABLE, top)]
    if not entries and not coupled and not diagnostics.has_errors:
        diagnostics.error("there is no spring in this file", spans.table(""), "write `[[spring]]`")
    origins = {key: top.span(key) for key in SPRINGS_FILE_KEYS if key in document}
    return SpringsFile(
        tuple(entry for entry in entries if entry),
        figure,
        law,
        tuple(entry for entry in coupled if entry),
        extends,
        base is not None,
        origins,
    )


def _table_readers(document: Mapping[str, Any], name: str, top: TableReader) -> list[TableReader]:
    """Return the readers of all tables of one name."""
    tables: Any = document.get(name, [])
    if not isinstance(tables, list) or not all(isinstance(t, dict) for t in cast("Any", tables)):
        what = "springs" if name == SPRING_TABLE else "coupled laws"
        top.diagnostics.error(
            f"{what} are tables", top.span(name), f"write `[[{name}]]` above each"
        )
        return []
    return [
        TableReader(table, name, index, top.spans, top.diagnostics)
        for index, table in enumerate(cast("list[Mapping[str, Any]]", tables))
    ]


def _parse_entry(table: TableReader) -> SpringEntry | None:
    """Parse one `[[spring]]` table; None, with a fault noted, if it has no joints."""
    table.reject_unknown_keys(SPRING_KEYS, "spring")
    joints = table.names("joints")
    axis = table.choice("axis", (*AXIS_NAMES, "joint"))
    _check_combination(table, DAMPING_AND_STOP_KEYS)
    law = parse_law(table)
    scale = table.number("scale", negative=False)
    offset = table.number("offset_deg")
    hysteresis = table.number(HYSTERESIS_KEY, negative=False)
    viscous = table.number("viscous_Nms_rad", negative=False)
    coulomb = table.number("coulomb_Nm", negative=False)
    stop_stiffness = table.number("stop_stiffness_Nm_rad", negative=False, zero=False)
    stop_onset = table.number("stop_onset_deg", negative=False, zero=False)
    texts = {key: table.text(key) or "" for key in TEXT_KEYS}
    if not joints:
        return None
    if isinstance(law, PublishedLaw):
        if viscous is None:
            viscous = law.row.damping
        texts = _fill_from_published(texts, law, joints)
        _warn_joint_mismatch(table, law, joints)
    origins = {key: table.span(key) for key in table.content} | {"spring": table.header_span}
    origins |= {f"joints.{k}": table.span("joints", k) for k in range(len(joints))}
    return SpringEntry(
        joints=joints,
        axis=None if axis == "joint" else axis,
        law=law,
        scale=1.0 if scale is None else scale,
        offset=offset or 0.0,
        hysteresis=hysteresis or 0.0,
        slip_rate=_parse_slip_rate(table),
        damping=None if viscous is coulomb is None else Damping(viscous or 0.0, coulomb or 0.0),
        stop_stiffness=stop_stiffness or DEFAULT_STOP_STIFFNESS,
        stop_onset=stop_onset or DEFAULT_STOP_ONSET,
        motion=texts["motion"],
        reference=texts["reference"],
        why=texts["why"],
        origins=origins,
    )


def _check_combination(table: TableReader, sufficient_keys: tuple[str, ...]) -> None:
    """Check that a table has a law or damping, at most one law, and only keys of that law.

    Args:
        table: of a spring.
        sufficient_keys: keys that are enough without an elastic law.
    """
    content = table.content
    present = [form for form in LAW_FORMS if form.is_present(table)]
    if not present and not any(key in content for key in sufficient_keys):
        known = (*ELASTIC_KEYS, *sufficient_keys)
        table.diagnostics.error(
            "this spring has no law", table.header_span, f"it needs one of: {', '.join(known)}"
        )
    for form in present:
        first = next(key for key in form.required_keys if key in content)
        for key in form.required_keys:
            if key not in content:
                table.error(first, f"`{first}` needs `{key}` beside it", f"{form.name} has both")
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
    for key in MODIFIER_KEYS:
        if key in content and not present:
            yield key, "an elastic law", f"with one of: {', '.join(ELASTIC_KEYS)}"
    has_two = any(INCREASING_KEY in form.required_keys for form in present)
    if HYSTERESIS_KEY in content and has_two:
        yield (
            HYSTERESIS_KEY,
            "a law of one curve",
            "two curves already define their difference",
        )
    if SLIP_RATE_KEY in content and HYSTERESIS_KEY not in content and not has_two:
        hint = f"with `{HYSTERESIS_KEY}`, or with `{INCREASING_KEY}` and `{DECREASING_KEY}`"
        yield SLIP_RATE_KEY, "a law that depends on the direction", hint


def _parse_slip_rate(table: TableReader) -> float:
    """Return `slip_rad_s` or its default [rad/s]."""
    hint = "the rate at which friction reaches 76 % of its full value, such as 0.01"
    return table.number(SLIP_RATE_KEY, negative=False, zero=False, hint=hint) or DEFAULT_SLIP_RATE


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


def _fill_from_published(
    texts: Mapping[str, str], law: PublishedLaw, joints: tuple[str, ...]
) -> dict[str, str]:
    """Return the texts of the table, and those of the published row where it has none."""
    row = {"motion": law.motion_name(joints), "reference": str(law.row.reference), "why": law.why}
    return {key: texts[key] or row[key] for key in TEXT_KEYS}
