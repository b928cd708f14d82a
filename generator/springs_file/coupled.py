"""`[[coupled]]` of a springs file: a law over several joints, published or in numbers."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from math import degrees, radians
from typing import Any, cast

from generator.diagnostics import Span, shorten, spelling_hint
from generator.springs_file.axes import AXIS_NAMES, ONLY_AXIS, names_other_joint
from generator.springs_file.published import PUBLISHED_KEY, PublishedKey
from generator.toml_file.reader import Pair, TableReader
from generator.toml_file.rows import (
    ENERGY_HINT,
    Choice,
    Names,
    Number,
    Numbers,
    Row,
    TableRows,
    Text,
    item_count,
)
from generator.toml_file.writer import degrees_to_toml, list_to_toml, names_to_toml
from springs.coupled import CoupledExponential, CoupledTerm, nearest_conservative_law
from springs.elastic import Range
from springs.published.tables import coupled_law
from springs.short_repr import short_repr

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


@short_repr
@dataclass(frozen=True)
class CoupledEntry:
    """A `[[coupled]]` table, in SI.

    Attributes:
        joints: joints for each side of the body the joints of the coordinates.
        coordinates: names of the law's angles, in the order of the joints.
        axes: axes for each coordinate "x", "y" or "z", or None for the only axis of the joint.
        senses: senses for each coordinate -1 where the axis's positive angle is against it.
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

    @property
    def fixed_names(self) -> tuple[str, ...] | None:
        """Names of the coordinates that are held; None without any."""
        return tuple(name for name, _ in self.held_angles) or None

    @property
    def fixed_angles(self) -> tuple[float, ...] | None:
        """Angles of the coordinates that are held [rad]; None without any."""
        return tuple(angle for _, angle in self.held_angles) or None

    @property
    def conservative(self) -> str | None:
        """Value of the key `conservative`; None without it."""
        return NEAREST_CONSERVATIVE if self.is_nearest_conservative else None

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


_COUNT = "coordinates"
"""Key of the list that has an item for each coordinate."""


class _Senses(Row[tuple[int, ...]]):
    """Signs."""

    @property
    def bounds(self) -> str:
        return "-1 or +1"

    def read(self, table: TableReader) -> tuple[int, ...] | None:
        if self.key not in table.content:
            return None
        items, count = table.items(self.key), item_count(table, _COUNT)
        if items is None or any(type(item) is not int or item not in (-1, 1) for item in items):
            table.error(self.key, f"`{self.key}` must be a list of -1 and +1", "in square brackets")
        elif len(items) != count:
            table.error(self.key, f"`{self.key}` has {len(items)} instead of {count} signs")
        else:
            return tuple(items)
        return None

    def value_to_toml(self, value: tuple[int, ...]) -> str:
        return f"[{', '.join(f'{sense:+d}' for sense in value)}]"


class _Axes(Row[tuple[str | None, ...]]):
    """Names of axes, None for the only axis of a joint."""

    def read(self, table: TableReader) -> tuple[str | None, ...] | None:
        names, count = table.names(self.key, '["y", "joint"]'), item_count(table, _COUNT)
        known = (*AXIS_NAMES, ONLY_AXIS)
        for k, name in enumerate(names):
            if name not in known:
                hint = f"it is one of: {', '.join(known)}"
                table.error(self.key, f"an axis cannot be `{shorten(name)}`", hint, k)
        if names and len(names) != count:
            table.error(self.key, f"there are {len(names)} axes for {count} coordinates")
        return tuple(None if name == ONLY_AXIS else name for name in names) or None

    def value_to_toml(self, value: tuple[str | None, ...]) -> str:
        return names_to_toml(name or ONLY_AXIS for name in value)


class _Joints(Row[tuple[tuple[str, ...], ...]]):
    """Joints of the coordinates, a tuple for each side of the body."""

    def read(self, table: TableReader) -> tuple[tuple[str, ...], ...] | None:
        if self.key not in table.content:
            return None
        items, count = table.items(self.key) or [], item_count(table, _COUNT)
        is_flat = bool(items) and all(isinstance(item, str) for item in items)
        sides = [items] if is_flat else items
        if not sides or not all(map(_is_name_list, sides)):
            hint = 'as in `["left_hip_joint", "left_knee"]`, or a list of such lists, one a side'
            table.error(self.key, f"`{self.key}` must be a list of names", hint)
            return None
        for k, side in enumerate(sides):
            if count and len(side) != count:
                message = f"there are {len(side)} joints for {count} coordinates"
                hint = "one joint for each coordinate, in their order"
                table.error(self.key, message, hint, None if is_flat else k)
            if side in sides[:k]:
                table.error(self.key, "these joints stand twice", "one list a side", k)
        return tuple(tuple(side) for side in sides)

    def value_to_toml(self, value: tuple[tuple[str, ...], ...]) -> str:
        sides = list(map(names_to_toml, value))
        return sides[0] if len(sides) == 1 else list_to_toml(sides)


TERM_ROWS = TableRows(
    "term",
    (
        Numbers("amplitudes_Nm", attribute="amplitudes"),
        Numbers("rates_1_rad", attribute="rates"),
        Number("exponent"),
        Number("end"),
    ),
)


class _Terms(Row[tuple[CoupledTerm, ...]]):
    """Exponentials: torques, how they grow with each angle, and the exponent at zero."""

    def read(self, table: TableReader) -> tuple[CoupledTerm, ...] | None:
        items = table.items(self.key)
        if self.key not in table.content:
            return None
        if not items or not all(isinstance(item, dict) for item in items):
            hint = "as in `[{amplitudes_Nm = [1.0, 0.5], rates_1_rad = [2.0, 1.0]}]`"
            table.error(self.key, f"`{self.key}` must be a list of tables in braces", hint)
            return None
        count = item_count(table, _COUNT)
        if not count:
            return None
        terms = [self._read_term(table, item, k, count) for k, item in enumerate(items)]
        found = tuple(term for term in terms if term is not None)
        return found if len(found) == len(items) else None

    def _read_term(
        self, table: TableReader, content: Mapping[str, Any], k: int, count: int
    ) -> CoupledTerm | None:
        place = (self.key, k)
        inner = TableReader(content, table.name, table.index, table.spans, table.diagnostics, place)
        inner.reject_unknown_keys(TERM_ROWS.keys, TERM_ROWS.noun)
        for row in TERM_ROWS.rows[:2]:
            if row.key not in content:
                hint = f"a list of {count} numbers, one for each coordinate"
                inner.diagnostics.error(f"this term has no `{row.key}`", inner.header_span, hint)
        amplitudes, rates = (inner.numbers(row.key, count) for row in TERM_ROWS.rows[:2])
        exponent, end = inner.number("exponent"), inner.number("end")
        if amplitudes is None or rates is None:
            return None
        if not any(rates):
            hint = "such a term is a constant: `constants_Nm`"
            inner.error("rates_1_rad", "the rates of a term must not all be zero", hint)
            return None
        return CoupledTerm(amplitudes, rates, exponent or 0.0, end)

    def value_to_toml(self, value: tuple[CoupledTerm, ...]) -> str:
        return list_to_toml(f"{{ {', '.join(TERM_ROWS.lines(term))} }}" for term in value)


class _MeasuredRanges(Row[tuple[Pair | None, ...]]):
    """Ranges in which a law is known."""

    def read(self, table: TableReader) -> tuple[Pair | None, ...] | None:
        pairs, count = table.pairs(self.key, 1, ("deg", "deg")), item_count(table, _COUNT)
        if pairs and count and len(pairs) != count:
            message = f"`{self.key}` has {len(pairs)} instead of {count} pairs"
            table.error(self.key, message, "one a coordinate")
            return None
        for k, (low, high) in enumerate(pairs):
            if low >= high:
                table.error(self.key, f"`{self.key}` ends before it begins", "[lower, upper]", k)
                return None
        return pairs or None

    def value_to_toml(self, value: tuple[Pair | None, ...]) -> str:
        known = [one for one in value if one is not None]
        if len(known) < len(value):
            raise ValueError("a springs file knows the ranges of all coordinates or of none")
        return list_to_toml(map(degrees_to_toml, known))


PROVENANCE_ROWS = (Text("reference", is_long=True), Text("why", is_long=True))

_COORDINATES = Names("coordinates", example='["hip flexion", "knee flexion"]')
_PUBLISHED = PublishedKey(PUBLISHED_KEY, "coupled law")
_FIXED_NAMES = Names("held", '["ankle dorsiflexion"]', attribute="fixed_names")
_FIXED_ANGLES = Numbers("held_deg", count="held", attribute="fixed_angles")
_EXPLICIT_LAW = (
    _Terms("terms", attribute="explicit_law.terms"),
    Numbers("constants_Nm", count=_COUNT, usual=0.0, attribute="explicit_law.constants"),
    _MeasuredRanges("measured_deg", usual=None, attribute="explicit_law.valid_ranges"),
)
_CONSERVATIVE = Choice("conservative", (NEAREST_CONSERVATIVE,))
COUPLED_ROWS = TableRows(
    "coupled law",
    (
        _Joints(
            "joints",
            example='[["left_hip_joint", "left_knee"], ["right_hip_joint", "right_knee"]]',
        ),
        _Axes("axes", usual=None),
        _Senses("senses", usual=1),
        _COORDINATES,
        _PUBLISHED,
        _FIXED_NAMES,
        _FIXED_ANGLES,
        *_EXPLICIT_LAW,
        _CONSERVATIVE,
        Number("scale", 0.0, hint=ENERGY_HINT),
        Numbers("offsets_deg", count=_COUNT, usual=0.0, attribute="offsets"),
        *PROVENANCE_ROWS,
    ),
)


def parse_coupled_entry(table: TableReader) -> CoupledEntry | None:
    """Parse one `[[coupled]]` table; None, with a fault noted, if it cannot be used."""
    before, content = len(table.diagnostics.entries), table.content
    COUPLED_ROWS.check_keys(table)
    values: dict[str, Any] = COUPLED_ROWS.read(table)
    coordinates: tuple[str, ...] = values.get("coordinates", ())
    if len(coordinates) == 1:
        hint = "a law of one angle is a `[[spring]]`"
        table.error("coordinates", "a coupled law has two coordinates at least", hint)
    if len(coordinates) > MAX_COORDINATES:
        table.error("coordinates", f"a coupled law has at most {MAX_COORDINATES} coordinates")
    for k, name in enumerate(coordinates):
        if name in coordinates[:k]:
            table.error("coordinates", f"`{shorten(name)}` stands twice", "", k)
    count = len(coordinates)
    held_keys = (_FIXED_NAMES.key, _FIXED_ANGLES.key)
    for key, other in (held_keys, held_keys[::-1]):
        if key in content and other not in content:
            table.error(key, f"`{key}` needs `{other}` beside it", "a name and its angle")
    names, angles = (values.pop(name, ()) for name in ("fixed_names", "fixed_angles"))
    fixed = tuple(zip(names, angles, strict=True)) if names and angles else ()
    for k, angle in enumerate(angles):
        if abs(angle) > _HALF_TURN:
            message = f"an angle is held within half a turn, not at {degrees(angle):.6g} deg"
            table.error(_FIXED_ANGLES.key, message, "", k)
    law = {name: values.pop(f"explicit_law.{name}", None) for name in _LAW_PARTS}
    published: str | None = values.get("published")
    if PUBLISHED_KEY in content:
        keys = [row.key for row in _EXPLICIT_LAW]
        _reject_keys(table, keys, "own numbers", f"without `{PUBLISHED_KEY}`")
        if published is not None and coordinates:
            _check_coordinates(table, published, coordinates, fixed)
    elif "terms" in content:
        _reject_keys(table, held_keys, "a published law", f"with `{PUBLISHED_KEY}`")
    else:
        hint = f"it needs one of: {PUBLISHED_KEY}, terms"
        table.diagnostics.error("this coupled law has no law", table.header_span, hint)
    if len(table.diagnostics.entries) > before:
        return None
    is_nearest = values.pop(_CONSERVATIVE.key, None) is not None
    if published is not None:
        row = coupled_law(published)
        _warn_held_out_of_range(table, row.law, fixed)
        first = f"{_CONSERVATIVE_NOTE} is taken." if is_nearest else "As published."
        note = " ".join(part for part in (first, row.note.strip()) if part)
        stated = {name: value for name, value in values.items() if value != ""}
        values = {"reference": str(row.reference), "why": note} | stated
    else:
        terms, constants, ranges = law.values()
        values["explicit_law"] = CoupledExponential(
            coordinates, terms, constants or (0.0,) * count, ranges or (None,) * count
        )
    places = _joint_spans(table, values["joints"])
    _warn_joint_mismatch(table, coordinates, values["joints"], places)
    usual: dict[str, Any] = {
        "axes": (None,) * count,
        "senses": (1,) * count,
        "offsets": (0.0,) * count,
    }
    entry = CoupledEntry(
        **(usual | values),
        held_angles=fixed,
        is_nearest_conservative=is_nearest,
        origins={key: table.span(key) for key in content} | {"coupled": table.header_span},
        joint_spans=places,
    )
    is_found = not is_nearest or _has_nearest_conservative(table, entry)
    return entry if is_found else None


_LAW_PARTS = ("terms", "constants", "valid_ranges")


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


def _reject_keys(table: TableReader, keys: Iterable[str], owner: str, hint: str) -> None:
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
    return nearest_conservative_law(law, [cast("Range", known) for known in law.valid_ranges]).law


def _reorder_coordinates(
    law: CoupledExponential, coordinates: tuple[str, ...]
) -> CoupledExponential:
    """Return the law with its coordinates in another order."""
    places = [law.coordinates.index(name) for name in coordinates]

    def put(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(values[place] for place in places)

    return CoupledExponential(
        coordinates,
        tuple(replace(t, amplitudes=put(t.amplitudes), rates=put(t.rates)) for t in law.terms),
        put(law.constants),
        tuple(law.valid_ranges[place] for place in places),
    )
