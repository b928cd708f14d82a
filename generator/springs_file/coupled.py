"""`[[coupled]]` of a springs file: a law over several joints, published or in own numbers.

A coupled law in a file's own numbers: constants, and exponentials of sums of the angles.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import degrees, radians
from typing import Any, cast

from generator.diagnostics import Span, nearest, shorten
from generator.springs_file.axes import AXES, is_elsewhere
from generator.springs_file.laws import PUBLISHED, published_name
from generator.springs_file.toml_table import Pair, TableReader
from springs.coupled import CoupledExponential, CoupledTerm
from springs.elastic import Range
from springs.published.tables import coupled
from springs.spherical import nearest_conservative

OWN_KEYS = ("terms", "constants_Nm", "measured_deg")
TERM_KEYS = ("amplitudes_Nm", "rates_1_rad", "exponent")


def own_law(table: TableReader, coordinates: tuple[str, ...]) -> CoupledExponential | None:
    """The law of `terms`, `constants_Nm` and `measured_deg`; None with a fault noted."""
    count = len(coordinates)
    items = table.items("terms")
    if not items or not all(isinstance(item, dict) for item in items):
        hint = "as in `[{amplitudes_Nm = [1.0, 0.5], rates_1_rad = [2.0, 1.0]}]`"
        table.error("terms", "`terms` must be a list of tables in braces", hint)
        return None
    if not count:
        return None
    terms = [
        _term(_inner(table, cast("Mapping[str, Any]", item), k), count)
        for k, item in enumerate(items)
    ]
    constants = table.numbers("constants_Nm", count)
    measured = _measured(table, count)
    if None in terms or measured is None:
        return None
    return CoupledExponential(
        coordinates,
        tuple(term for term in terms if term is not None),
        constants or (0.0,) * count,
        measured,
    )


def _inner(table: TableReader, content: Mapping[str, Any], k: int) -> TableReader:
    """The reader of one table in braces."""
    return TableReader(content, table.name, table.index, table.places, table.findings, ("terms", k))


def _term(table: TableReader, count: int) -> CoupledTerm | None:
    """One exponential: its torques, how they grow with each angle, its exponent at zero."""
    table.refuse_unknown(TERM_KEYS, "term")
    for key in TERM_KEYS[:2]:
        if key not in table.content:
            hint = f"a list of {count} numbers, one for each coordinate"
            table.findings.error(f"this term has no `{key}`", table.header, hint)
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


def _measured(table: TableReader, count: int) -> tuple[Pair | None, ...] | None:
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


PLACE_KEYS = ("joints", "axes", "senses", "coordinates")
HELD_KEYS = ("held", "held_deg")
COUPLED_KEYS = (
    *PLACE_KEYS,
    PUBLISHED,
    *HELD_KEYS,
    *OWN_KEYS,
    "conservative",
    "scale",
    "offsets_deg",
    "reference",
    "why",
)

NEAREST = "nearest"
"""`conservative = "nearest"` takes the nearest law that is the gradient of an energy."""

MOST = 6
"""Coordinates of a law: looking at it everywhere takes a power of their number."""

_MOST_COORDINATES, _MOST_TERMS = 3, 40
"""What a nearest conservative law is sought for: the work grows with the power of the first."""

_MENDED = "The nearest conservative law of the same exponentials"

_HALF_TURN = radians(180.0)
_ROUNDING = 1e-9
"""What converting degrees may add to an end of a range [rad]."""

_JOINTS = '["left_hip_joint", "left_knee"]'


@dataclass(frozen=True)
class CoupledEntry:
    """A `[[coupled]]` table, in SI.

    Attributes:
        joints: for each side of the body the joints of the coordinates.
        coordinates: names of the law's angles, in the order of the joints.
        axes: for each coordinate "x", "y" or "z", or None for the only axis of the joint.
        senses: for each coordinate -1 where the axis's positive angle is against it.
        published: the published law, `publication/name`, or None.
        own: the law in numbers of the file instead, or None.
        held: the published law's other coordinates and their angles [rad].
        is_nearest: whether the nearest conservative law takes its place.
        scale: factor of its torques.
        offsets: how far it is moved towards greater angles, one a coordinate [rad].
        reference: where the numbers are from.
        why: why they are read as they are.
        origins: places of the keys' values; "coupled" is the table.
        joint_origins: places of the joints, as in `joints`.
    """

    joints: tuple[tuple[str, ...], ...]
    coordinates: tuple[str, ...]
    axes: tuple[str | None, ...]
    senses: tuple[int, ...]
    published: str | None = None
    own: CoupledExponential | None = None
    held: tuple[tuple[str, float], ...] = ()
    is_nearest: bool = False
    scale: float = 1.0
    offsets: tuple[float, ...] = ()
    reference: str = ""
    why: str = ""
    origins: Mapping[str, Span] = field(default_factory=dict[str, Span], compare=False, repr=False)
    joint_origins: tuple[tuple[Span, ...], ...] = field(default=(), compare=False, repr=False)

    @cached_property
    def law(self) -> CoupledExponential:
        """Torques on the children [N m] of the coordinates [rad], in their order."""
        law = self.as_given
        if self.is_nearest:
            law = nearest_conservative(law, _box(law)).law
        return self._changed(law)

    @property
    def replaced(self) -> CoupledExponential | None:
        """The law for which the nearest conservative one stands, or None."""
        return self._changed(self.as_given) if self.is_nearest else None

    def _changed(self, law: CoupledExponential) -> CoupledExponential:
        """A law with what `scale` and `offsets_deg` do to it."""
        return law.scaled(self.scale, dict(zip(self.coordinates, self.offsets, strict=False)))

    def is_same(self, other: "CoupledEntry") -> bool:
        """Whether another table has the same law, whatever the order of its coordinates."""
        if set(self.coordinates) != set(other.coordinates):
            return False
        return self.law == _ordered(other.law, self.coordinates)

    @property
    def as_given(self) -> CoupledExponential:
        """The law before it is changed, its coordinates in the order of the file."""
        if self.published is None:
            assert self.own is not None
            return self.own
        law = coupled(self.published).law
        for name, angle in self.held:
            law = law.holding(name, angle)
        return _ordered(law, self.coordinates)


def coupled_entry(table: TableReader) -> CoupledEntry | None:
    """One `[[coupled]]`; None, with a fault noted, when it says nothing that can be used."""
    before = len(table.findings.faults)
    table.refuse_unknown(COUPLED_KEYS, "coupled law")
    coordinates = table.names("coordinates", '["hip flexion", "knee flexion"]', "coupled law")
    if len(coordinates) == 1:
        hint = "a law of one angle is a `[[spring]]`"
        table.error("coordinates", "a coupled law has two coordinates at least", hint)
    if len(coordinates) > MOST:
        table.error("coordinates", f"a coupled law has at most {MOST} coordinates")
    for k, name in enumerate(coordinates):
        if name in coordinates[:k]:
            table.error("coordinates", f"`{shorten(name)}` stands twice", "", k)
    count = len(coordinates)
    joints = _joints(table, count)
    axes = _axes(table, count)
    senses = table.signs("senses", count)
    offsets = table.numbers("offsets_deg", count)
    scale = table.number("scale", negative=False)
    wanted = table.choice("conservative", (NEAREST,))
    said = {key: table.text(key) or "" for key in ("reference", "why")}
    held, published, own = _held(table), None, None
    if PUBLISHED in table.content:
        published = published_name(table, PUBLISHED, "coupled law")
        _refuse_beside(table, OWN_KEYS, "own numbers", f"without `{PUBLISHED}`")
        if published is not None and coordinates:
            _check_coordinates(table, published, coordinates, held)
    elif "terms" in table.content:
        own = own_law(table, coordinates)
        _refuse_beside(table, HELD_KEYS, "a published law", f"with `{PUBLISHED}`")
    else:
        hint = f"it needs one of: {PUBLISHED}, terms"
        table.findings.error("this coupled law has no law", table.header, hint)
    if len(table.findings.faults) > before:
        return None
    if published is not None:
        row = coupled(published)
        _doubt_held(table, row.law, held)
        first = "As published." if wanted is None else f"{_MENDED} is taken."
        note = " ".join(part for part in (first, row.note.strip()) if part)
        said = {"reference": said["reference"] or str(row.reference), "why": said["why"] or note}
    origins = {key: table.place(key) for key in table.content} | {"coupled": table.header}
    places = _joint_places(table, joints)
    _doubt_joints(table, coordinates, joints, places)
    entry = CoupledEntry(
        joints=joints,
        coordinates=coordinates,
        axes=axes or (None,) * count,
        senses=senses or (1,) * count,
        published=published,
        own=own,
        held=held,
        is_nearest=wanted is not None,
        scale=1.0 if scale is None else scale,
        offsets=offsets or (0.0,) * count,
        reference=said["reference"],
        why=said["why"],
        origins=origins,
        joint_origins=places,
    )
    return entry if not entry.is_nearest or _can_be_nearest(table, entry) else None


def _joints(table: TableReader, count: int) -> tuple[tuple[str, ...], ...]:
    """The joints of the coordinates, a list for each side; empty with a fault noted."""
    if "joints" not in table.content:
        hint = f"write `joints = {_JOINTS}`, or a list of such lists, one a side"
        table.findings.error("this coupled law has no `joints`", table.header, hint)
        return ()
    items = table.items("joints") or []
    is_flat = bool(items) and all(isinstance(item, str) for item in items)
    sides = [items] if is_flat else items
    if not sides or not all(map(_is_names, sides)):
        hint = f"as in `{_JOINTS}`, or a list of such lists, one a side"
        table.error("joints", "`joints` must be a list of names", hint)
        return ()
    for k, side in enumerate(sides):
        if count and len(side) != count:
            said = f"there are {len(side)} joints for {count} coordinates"
            hint = "one joint for each coordinate, in their order"
            table.error("joints", said, hint, None if is_flat else k)
        if side in sides[:k]:
            table.error("joints", "these joints stand twice", "one list a side", k)
    return tuple(tuple(side) for side in sides)


def _is_names(value: Any) -> bool:
    """Whether a value is a list of names, at least one."""
    return (
        bool(value)
        and isinstance(value, list)
        and all(isinstance(name, str) for name in cast("list[Any]", value))
    )


def _joint_places(
    table: TableReader, joints: tuple[tuple[str, ...], ...]
) -> tuple[tuple[Span, ...], ...]:
    """Where each joint is written."""
    is_flat = isinstance((table.items("joints") or [None])[0], str)
    return tuple(
        tuple(
            table.place("joints", j) if is_flat else table.place("joints", k, j)
            for j in range(len(side))
        )
        for k, side in enumerate(joints)
    )


def _axes(table: TableReader, count: int) -> tuple[str | None, ...] | None:
    """For each coordinate the axis of its joint; None where they are left out, or wrong."""
    if "axes" not in table.content:
        return None
    names = table.names("axes", '["y", "joint"]')
    known = (*AXES, "joint")
    for k, name in enumerate(names):
        if name not in known:
            hint = f"it is one of: {', '.join(known)}"
            table.error("axes", f"an axis cannot be `{shorten(name)}`", hint, k)
    if names and len(names) != count:
        table.error("axes", f"there are {len(names)} axes for {count} coordinates")
    return tuple(None if name == "joint" else name for name in names)


def _held(table: TableReader) -> tuple[tuple[str, float], ...]:
    """The coordinates that are held, with their angles [rad]."""
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
            said = f"an angle is held within half a turn, not at {degrees(angle):.6g} deg"
            table.error("held_deg", said, "", k)
    return tuple(zip(names, angles, strict=True)) if angles is not None else ()


def _doubt_held(
    table: TableReader, law: CoupledExponential, held: tuple[tuple[str, float], ...]
) -> None:
    """Note a warning for each coordinate that is held where the law is not known."""
    for k, (name, angle) in enumerate(held):
        known = law.measured[law.coordinates.index(name)]
        if known is not None and not known[0] - _ROUNDING <= angle <= known[1] + _ROUNDING:
            low, high = (f"{degrees(end):.4g}" for end in known)
            said = f"`{shorten(name)}` is held at {degrees(angle):.6g} deg, beyond what is known"
            hint = f"the law is known for {low} .. {high} deg"
            table.findings.warning(said, table.place("held_deg", k), hint)


def _doubt_joints(
    table: TableReader,
    coordinates: tuple[str, ...],
    joints: tuple[tuple[str, ...], ...],
    places: tuple[tuple[Span, ...], ...],
) -> None:
    """Note a warning for each coordinate that hangs on a joint of which it is not."""
    for side, spans in zip(joints, places, strict=True):
        for name, joint, span in zip(coordinates, side, spans, strict=True):
            if is_elsewhere(name, joint):
                said = f"`{shorten(name)}` hangs on `{shorten(joint)}`"
                table.findings.warning(said, span, "joints stand in the order of `coordinates`")


def _check_coordinates(
    table: TableReader,
    published: str,
    coordinates: tuple[str, ...],
    held: tuple[tuple[str, float], ...],
) -> None:
    """Every coordinate of a published law is hung on a joint or held, and only one of the two."""
    known = coupled(published).law.coordinates
    names = [name for name, _ in held]
    for key, said in (("coordinates", coordinates), ("held", names)):
        for k, name in enumerate(said):
            if name not in known:
                missing = f"`{published}` has no coordinate `{shorten(name)}`"
                table.error(key, missing, nearest(name, known), k)
    for k, name in enumerate(names):
        if name in coordinates or name in names[:k]:
            both = "hung on a joint and held" if name in coordinates else "held twice"
            table.error("held", f"`{shorten(name)}` is {both}", "", k)
    missing = [name for name in known if name not in coordinates and name not in names]
    if missing and "held" in table.content and not held:
        return  # what is wrong with `held` has been said
    if missing and all(name in known for name in (*coordinates, *names)):
        listed = ", ".join(f'"{name}"' for name in (*names, *missing))
        angles = ", ".join("0.0" for _ in (*names, *missing))
        table.error(
            PUBLISHED,
            f"`{published}` depends on `{missing[0]}` too, and nothing says where that is",
            f"hold it: `held = [{listed}]` and `held_deg = [{angles}]`",
        )


def _refuse_beside(table: TableReader, keys: tuple[str, ...], owner: str, hint: str) -> None:
    for key in keys:
        if key in table.content:
            table.error(key, f"`{key}` belongs to {owner}", hint)


def _can_be_nearest(table: TableReader, entry: CoupledEntry) -> bool:
    """Whether a nearest conservative law can be sought; else the fault is noted."""
    law = entry.as_given
    for name, known in zip(law.coordinates, law.measured, strict=True):
        if known is None or not known[0] < known[1]:
            said = f"the range over which to come near is not known for `{shorten(name)}`"
            table.error("conservative", said, "`measured_deg` gives it, a pair for each coordinate")
            return False
    if len(law.coordinates) > _MOST_COORDINATES or len(law.terms) > _MOST_TERMS:
        most = f"{_MOST_COORDINATES} coordinates and {_MOST_TERMS} terms"
        table.error("conservative", f"a nearest law is sought for at most {most}")
        return False
    return True


def _box(law: CoupledExponential) -> list[Range]:
    """The ranges in which a law is known, all of them there."""
    return [cast("Range", known) for known in law.measured]


def _ordered(law: CoupledExponential, coordinates: tuple[str, ...]) -> CoupledExponential:
    """The same law with its coordinates in another order."""
    places = [law.coordinates.index(name) for name in coordinates]

    def put(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(values[place] for place in places)

    return CoupledExponential(
        coordinates,
        tuple(CoupledTerm(put(t.amplitudes), put(t.rates), t.exponent) for t in law.terms),
        put(law.constants),
        tuple(law.measured[place] for place in places),
    )
