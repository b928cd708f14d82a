"""`[[coupled]]` of a springs file: a law over several joints, published or in numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from math import degrees, radians
from typing import Any, cast

from generator.diagnostics import Span, shorten, spelling_hint
from generator.springs_file.axes import AXIS_NAMES, names_other_joint
from generator.springs_file.published import PUBLISHED_KEY, parse_published_key
from generator.toml_file.reader import Pair, TableReader
from springs.coupled import CoupledExponential, CoupledTerm, nearest_conservative_law
from springs.elastic import Range
from springs.published.tables import coupled_law
from springs.short_repr import short_repr

EXPLICIT_LAW_KEYS = ("terms", "constants_Nm", "measured_deg")
TERM_KEYS = ("amplitudes_Nm", "rates_1_rad", "exponent")


def parse_explicit_law(
    table: TableReader, coordinates: tuple[str, ...]
) -> CoupledExponential | None:
    """Parse `terms`, `constants_Nm` and `measured_deg`; None with a fault noted."""
    count = len(coordinates)
    items = table.items("terms")
    if not items or not all(isinstance(item, dict) for item in items):
        hint = "as in `[{amplitudes_Nm = [1.0, 0.5], rates_1_rad = [2.0, 1.0]}]`"
        table.error("terms", "`terms` must be a list of tables in braces", hint)
        return None
    if not count:
        return None
    terms = [
        _parse_term(_term_table(table, cast("Mapping[str, Any]", item), k), count)
        for k, item in enumerate(items)
    ]
    constants = table.numbers("constants_Nm", count)
    measured = _parse_measured_ranges(table, count)
    if None in terms or measured is None:
        return None
    return CoupledExponential(
        coordinates,
        tuple(term for term in terms if term is not None),
        constants or (0.0,) * count,
        measured,
    )


def _term_table(table: TableReader, content: Mapping[str, Any], k: int) -> TableReader:
    """The reader of one table in braces."""
    return TableReader(
        content, table.name, table.index, table.spans, table.diagnostics, ("terms", k)
    )


def _parse_term(table: TableReader, count: int) -> CoupledTerm | None:
    """One exponential: its torques, how they grow with each angle, its exponent at zero."""
    table.reject_unknown_keys(TERM_KEYS, "term")
    for key in TERM_KEYS[:2]:
        if key not in table.content:
            hint = f"a list of {count} numbers, one for each coordinate"
            table.diagnostics.error(f"this term has no `{key}`", table.header_span, hint)
    amplitudes = table.numbers("amplitudes_Nm", count)
    rates = table.numbers("rates_1_rad", count)
    exponent = table.number("exponent")
    if amplitudes is None or rates is None:
        return None
    if not any(rates):
        hint = "such a term is a constant: `constants_Nm`"
        table.error("rates_1_rad", "the rates of a term must not all be zero", hint)
        return None
    return CoupledTerm(amplitudes, rates, exponent or 0.0)


def _parse_measured_ranges(table: TableReader, count: int) -> tuple[Pair | None, ...] | None:
    """For each coordinate its range; None with a fault noted."""
    key = "measured_deg"
    if key not in table.content:
        return (None,) * count
    pairs = table.pairs(key, 1, ("deg", "deg"))
    if not pairs:
        return None
    if len(pairs) != count:
        table.error(key, f"`{key}` has {len(pairs)} instead of {count} pairs", "one a coordinate")
        return None
    for k, (low, high) in enumerate(pairs):
        if low >= high:
            table.error(key, f"`{key}` ends before it begins", "[lower, upper]", k)
            return None
    return pairs


BINDING_KEYS = ("joints", "axes", "senses", "coordinates")
HELD_KEYS = ("held", "held_deg")
COUPLED_KEYS = (
    *BINDING_KEYS,
    PUBLISHED_KEY,
    *HELD_KEYS,
    *EXPLICIT_LAW_KEYS,
    "conservative",
    "scale",
    "offsets_deg",
    "reference",
    "why",
)

NEAREST_CONSERVATIVE = "nearest"
"""`conservative = "nearest"` takes the nearest law that is the gradient of an energy."""

MAX_COORDINATES = 6
"""Coordinates of a law: looking at it everywhere takes a power of their number."""

_MAX_CONSERVATIVE_COORDINATES, _MAX_CONSERVATIVE_TERMS = 3, 40
"""Limits of a nearest conservative law: the work is exponential in the coordinates."""

_CONSERVATIVE_NOTE = "The nearest conservative law of the same exponentials"

_HALF_TURN = radians(180.0)
_RANGE_TOLERANCE = 1e-9
"""Rounding of a range converted from degrees [rad]."""

_JOINTS_EXAMPLE = '["left_hip_joint", "left_knee"]'


@short_repr
@dataclass(frozen=True)
class CoupledEntry:
    """A `[[coupled]]` table, in SI.

    Attributes:
        joints: for each side of the body the joints of the coordinates.
        coordinates: names of the law's angles, in the order of the joints.
        axes: for each coordinate "x", "y" or "z", or None for the only axis of the joint.
        senses: for each coordinate -1 where the axis's positive angle is against it.
        published: the published law, `publication/name`, or None.
        explicit_law: the law in numbers of the file instead, or None.
        held_angles: the published law's other coordinates and their fixed angles [rad].
        is_nearest_conservative: whether the nearest conservative law takes its place.
        scale: factor of its torques.
        offsets: how far it is moved towards greater angles, one a coordinate [rad].
        reference: where the numbers are from.
        why: why they are read as they are.
        origins: places of the keys' values; "coupled" is the table.
        joint_spans: places of the joints, as in `joints`.
    """

    joints: tuple[tuple[str, ...], ...]
    coordinates: tuple[str, ...]
    axes: tuple[str | None, ...]
    senses: tuple[int, ...]
    published: str | None = None
    explicit_law: CoupledExponential | None = None
    held_angles: tuple[tuple[str, float], ...] = ()
    is_nearest_conservative: bool = False
    scale: float = 1.0
    offsets: tuple[float, ...] = ()
    reference: str = ""
    why: str = ""
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)
    joint_spans: tuple[tuple[Span, ...], ...] = field(default=(), compare=False, repr=False)

    @cached_property
    def law(self) -> CoupledExponential:
        """Torques on the children [N m] of the coordinates [rad], in their order."""
        law = self.unmodified_law
        if self.is_nearest_conservative:
            law = _nearest_law(law)
        return self._apply_modifiers(law)

    @property
    def original_law(self) -> CoupledExponential | None:
        """The law for which the nearest conservative one stands, or None."""
        return self._apply_modifiers(self.unmodified_law) if self.is_nearest_conservative else None

    def _apply_modifiers(self, law: CoupledExponential) -> CoupledExponential:
        """A law with what `scale` and `offsets_deg` do to it."""
        return law.scaled(self.scale, dict(zip(self.coordinates, self.offsets, strict=False)))

    def has_same_law(self, other: "CoupledEntry") -> bool:
        """Return whether another table has the same law, in any order of coordinates."""
        if set(self.coordinates) != set(other.coordinates):
            return False
        return self.law == _reorder_coordinates(other.law, self.coordinates)

    @property
    def unmodified_law(self) -> CoupledExponential:
        """The law before it is changed, its coordinates in the order of the file."""
        if self.published is None:
            assert self.explicit_law is not None
            return self.explicit_law
        law = coupled_law(self.published).law
        for name, angle in self.held_angles:
            law = law.hold_coordinate(name, angle)
        return _reorder_coordinates(law, self.coordinates)


def parse_coupled_entry(table: TableReader) -> CoupledEntry | None:
    """Parse one `[[coupled]]` table; None, with a fault noted, if it cannot be used."""
    before = len(table.diagnostics.entries)
    table.reject_unknown_keys(COUPLED_KEYS, "coupled law")
    coordinates = table.names("coordinates", '["hip flexion", "knee flexion"]', "coupled law")
    if len(coordinates) == 1:
        hint = "a law of one angle is a `[[spring]]`"
        table.error("coordinates", "a coupled law has two coordinates at least", hint)
    if len(coordinates) > MAX_COORDINATES:
        table.error("coordinates", f"a coupled law has at most {MAX_COORDINATES} coordinates")
    for k, name in enumerate(coordinates):
        if name in coordinates[:k]:
            table.error("coordinates", f"`{shorten(name)}` stands twice", "", k)
    count = len(coordinates)
    joints = _parse_joints(table, count)
    axes = _parse_axes(table, count)
    senses = table.signs("senses", count)
    offsets = table.numbers("offsets_deg", count)
    scale = table.number("scale", negative=False)
    wanted = table.choice("conservative", (NEAREST_CONSERVATIVE,))
    texts = {key: table.text(key) or "" for key in ("reference", "why")}
    fixed, published, own = _parse_held(table), None, None
    if PUBLISHED_KEY in table.content:
        published = parse_published_key(table, PUBLISHED_KEY, "coupled law")
        _reject_keys(table, EXPLICIT_LAW_KEYS, "own numbers", f"without `{PUBLISHED_KEY}`")
        if published is not None and coordinates:
            _check_coordinates(table, published, coordinates, fixed)
    elif "terms" in table.content:
        own = parse_explicit_law(table, coordinates)
        _reject_keys(table, HELD_KEYS, "a published law", f"with `{PUBLISHED_KEY}`")
    else:
        hint = f"it needs one of: {PUBLISHED_KEY}, terms"
        table.diagnostics.error("this coupled law has no law", table.header_span, hint)
    if len(table.diagnostics.entries) > before:
        return None
    if published is not None:
        row = coupled_law(published)
        _warn_held_out_of_range(table, row.law, fixed)
        first = "As published." if wanted is None else f"{_CONSERVATIVE_NOTE} is taken."
        note = " ".join(part for part in (first, row.note.strip()) if part)
        texts = {"reference": texts["reference"] or str(row.reference), "why": texts["why"] or note}
    origins = {key: table.span(key) for key in table.content} | {"coupled": table.header_span}
    places = _joint_spans(table, joints)
    _warn_joint_mismatch(table, coordinates, joints, places)
    entry = CoupledEntry(
        joints=joints,
        coordinates=coordinates,
        axes=axes or (None,) * count,
        senses=senses or (1,) * count,
        published=published,
        explicit_law=own,
        held_angles=fixed,
        is_nearest_conservative=wanted is not None,
        scale=1.0 if scale is None else scale,
        offsets=offsets or (0.0,) * count,
        reference=texts["reference"],
        why=texts["why"],
        origins=origins,
        joint_spans=places,
    )
    return (
        entry
        if not entry.is_nearest_conservative or _has_nearest_conservative(table, entry)
        else None
    )


def _parse_joints(table: TableReader, count: int) -> tuple[tuple[str, ...], ...]:
    """Parse the joints of the coordinates, a tuple for each side; empty with a fault noted."""
    if "joints" not in table.content:
        hint = f"write `joints = {_JOINTS_EXAMPLE}`, or a list of such lists, one a side"
        table.diagnostics.error("this coupled law has no `joints`", table.header_span, hint)
        return ()
    items = table.items("joints") or []
    is_flat = bool(items) and all(isinstance(item, str) for item in items)
    sides = [items] if is_flat else items
    if not sides or not all(map(_is_name_list, sides)):
        hint = f"as in `{_JOINTS_EXAMPLE}`, or a list of such lists, one a side"
        table.error("joints", "`joints` must be a list of names", hint)
        return ()
    for k, side in enumerate(sides):
        if count and len(side) != count:
            message = f"there are {len(side)} joints for {count} coordinates"
            hint = "one joint for each coordinate, in their order"
            table.error("joints", message, hint, None if is_flat else k)
        if side in sides[:k]:
            table.error("joints", "these joints stand twice", "one list a side", k)
    return tuple(tuple(side) for side in sides)


def _is_name_list(value: Any) -> bool:
    """Return whether a value is a list of one or more names."""
    return (
        bool(value)
        and isinstance(value, list)
        and all(isinstance(name, str) for name in cast("list[Any]", value))
    )


def _joint_spans(
    table: TableReader, joints: tuple[tuple[str, ...], ...]
) -> tuple[tuple[Span, ...], ...]:
    """Spans of the joints."""
    is_flat = isinstance((table.items("joints") or [None])[0], str)
    return tuple(
        tuple(
            table.span("joints", j) if is_flat else table.span("joints", k, j)
            for j in range(len(side))
        )
        for k, side in enumerate(joints)
    )


def _parse_axes(table: TableReader, count: int) -> tuple[str | None, ...] | None:
    """Parse the axis of each coordinate; None where they are left out or wrong."""
    if "axes" not in table.content:
        return None
    names = table.names("axes", '["y", "joint"]')
    known = (*AXIS_NAMES, "joint")
    for k, name in enumerate(names):
        if name not in known:
            hint = f"it is one of: {', '.join(known)}"
            table.error("axes", f"an axis cannot be `{shorten(name)}`", hint, k)
    if names and len(names) != count:
        table.error("axes", f"there are {len(names)} axes for {count} coordinates")
    return tuple(None if name == "joint" else name for name in names)


def _parse_held(table: TableReader) -> tuple[tuple[str, float], ...]:
    """Parse the coordinates held fixed, with their angles [rad]."""
    present = [key for key in HELD_KEYS if key in table.content]
    if len(present) == 1:
        other = HELD_KEYS[1 - HELD_KEYS.index(present[0])]
        table.error(present[0], f"`{present[0]}` needs `{other}` beside it", "a name and its angle")
    if len(present) < 2:
        return ()
    names = table.names("held", '["ankle dorsiflexion"]')
    angles = table.numbers("held_deg", len(names)) if names else None
    for k, angle in enumerate(angles or ()):
        if abs(angle) > _HALF_TURN:
            message = f"an angle is held within half a turn, not at {degrees(angle):.6g} deg"
            table.error("held_deg", message, "", k)
    return tuple(zip(names, angles, strict=True)) if angles is not None else ()


def _warn_held_out_of_range(
    table: TableReader, law: CoupledExponential, fixed: tuple[tuple[str, float], ...]
) -> None:
    """Warn of each coordinate held outside the range in which the law is known."""
    for k, (name, angle) in enumerate(fixed):
        known = law.valid_ranges[law.coordinates.index(name)]
        if (
            known is not None
            and not known[0] - _RANGE_TOLERANCE <= angle <= known[1] + _RANGE_TOLERANCE
        ):
            low, high = (f"{degrees(end):.4g}" for end in known)
            message = f"`{shorten(name)}` is held at {degrees(angle):.6g} deg, beyond what is known"
            hint = f"the law is known for {low} .. {high} deg"
            table.diagnostics.warning(message, table.span("held_deg", k), hint)


def _warn_joint_mismatch(
    table: TableReader,
    coordinates: tuple[str, ...],
    joints: tuple[tuple[str, ...], ...],
    joint_spans: tuple[tuple[Span, ...], ...],
) -> None:
    """Warn of each coordinate bound to a joint of another name."""
    for side, spans in zip(joints, joint_spans, strict=True):
        for name, joint, span in zip(coordinates, side, spans, strict=True):
            if names_other_joint(name, joint):
                message = f"the joint of `{shorten(name)}` is `{shorten(joint)}`"
                table.diagnostics.warning(
                    message, span, "joints stand in the order of `coordinates`"
                )


def _check_coordinates(
    table: TableReader,
    published: str,
    coordinates: tuple[str, ...],
    fixed: tuple[tuple[str, float], ...],
) -> None:
    """Check that each coordinate of a published law is bound to a joint or fixed, not both."""
    known = coupled_law(published).law.coordinates
    names = [name for name, _ in fixed]
    for key, listed_names in (("coordinates", coordinates), ("held", names)):
        for k, name in enumerate(listed_names):
            if name not in known:
                missing = f"`{published}` has no coordinate `{shorten(name)}`"
                table.error(key, missing, spelling_hint(name, known), k)
    for k, name in enumerate(names):
        if name in coordinates or name in names[:k]:
            both = "bound to a joint and held" if name in coordinates else "held twice"
            table.error("held", f"`{shorten(name)}` is {both}", "", k)
    missing = [name for name in known if name not in coordinates and name not in names]
    if missing and "held" in table.content and not fixed:
        return  # the fault in `held` is noted already
    if missing and all(name in known for name in (*coordinates, *names)):
        listed = ", ".join(f'"{name}"' for name in (*names, *missing))
        angles = ", ".join("0.0" for _ in (*names, *missing))
        table.error(
            PUBLISHED_KEY,
            f"`{published}` depends on `{missing[0]}` too, and nothing says where that is",
            f"hold it: `held = [{listed}]` and `held_deg = [{angles}]`",
        )


def _reject_keys(table: TableReader, keys: tuple[str, ...], owner: str, hint: str) -> None:
    for key in keys:
        if key in table.content:
            table.error(key, f"`{key}` belongs to {owner}", hint)


def _has_nearest_conservative(table: TableReader, entry: CoupledEntry) -> bool:
    """Return whether a nearest conservative law can be found; note the fault if not."""
    law = entry.unmodified_law
    for name, known in zip(law.coordinates, law.valid_ranges, strict=True):
        if known is None or not known[0] < known[1]:
            message = f"the range over which to come near is not known for `{shorten(name)}`"
            table.error(
                "conservative", message, "`measured_deg` gives it, a pair for each coordinate"
            )
            return False
    if (
        len(law.coordinates) > _MAX_CONSERVATIVE_COORDINATES
        or len(law.terms) > _MAX_CONSERVATIVE_TERMS
    ):
        most = f"{_MAX_CONSERVATIVE_COORDINATES} coordinates and {_MAX_CONSERVATIVE_TERMS} terms"
        table.error("conservative", f"a nearest law is sought for at most {most}")
        return False
    return True


@lru_cache(maxsize=16)
def _nearest_law(law: CoupledExponential) -> CoupledExponential:
    """Return the nearest conservative law; a fit takes longer than reading the file again."""
    return nearest_conservative_law(law, _known_ranges(law)).law


def _known_ranges(law: CoupledExponential) -> list[Range]:
    """Return the known ranges of a law that has all of them."""
    return [cast("Range", known) for known in law.valid_ranges]


def _reorder_coordinates(
    law: CoupledExponential, coordinates: tuple[str, ...]
) -> CoupledExponential:
    """Return the law with its coordinates in another order."""
    places = [law.coordinates.index(name) for name in coordinates]

    def put(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(values[place] for place in places)

    return CoupledExponential(
        coordinates,
        tuple(CoupledTerm(put(t.amplitudes), put(t.rates), t.exponent) for t in law.terms),
        put(law.constants),
        tuple(law.valid_ranges[place] for place in places),
    )
