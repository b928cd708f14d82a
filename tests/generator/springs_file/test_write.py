"""Writing a springs file: reading what was written gives the same springs."""

from math import inf, pi, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import select_errors
from generator.springs_file.coupled import CoupledEntry
from generator.springs_file.laws import CubicEntry
from generator.springs_file.parse import SpringEntry, SpringsFile, parse_springs
from generator.springs_file.published import PublishedLaw
from generator.springs_file.write import write_springs
from springs import Damping, Joining, Linear
from springs.coupled import CoupledExponential, CoupledTerm
from springs.damping import DEFAULT_SLIP_RATE
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.interpolated import Interpolated
from springs.published.tables import coupled_law, publication, publications
from springs.smooth_limit import SmoothLimit
from tests.paths import FIGURES

NUMBERS = st.floats(
    allow_nan=False, allow_infinity=False, width=64, min_value=-1e30, max_value=1e30
)
POSITIVE = st.floats(min_value=1e-6, max_value=1e6)
ANGLES = st.floats(min_value=-2.0 * pi, max_value=2.0 * pi)
HELD = st.floats(min_value=-pi, max_value=pi)
TEXTS = st.text(st.characters(exclude_categories=("Cs",), exclude_characters="\r"), max_size=250)
NAMES = st.text(st.characters(exclude_categories=("Cs",)), min_size=1, max_size=20)
COEFFICIENTS = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
ZONES = st.tuples(ANGLES, ANGLES).map(lambda ends: (min(ends), max(ends)))


@st.composite
def cubics(draw: st.DrawFn) -> SpringEntry:
    zone = draw(st.none() | ZONES)
    return SpringEntry(
        joints=tuple(draw(st.lists(NAMES, min_size=1, max_size=3))),
        axis=draw(st.sampled_from([None, "x", "y", "z"])),
        law=CubicEntry(
            draw(COEFFICIENTS),
            sense=draw(st.sampled_from([None, -1, 1])),
            dead_zone=zone,
            dead_zone_stated=zone is not None or draw(st.booleans()),
            rest=draw(ANGLES),
        ),
        damping=Damping(draw(POSITIVE), draw(st.just(0.0) | POSITIVE)),
        motion=draw(TEXTS),
        reference=draw(TEXTS),
        why=draw(TEXTS),
    )


@st.composite
def linears(draw: st.DrawFn) -> SpringEntry:
    return SpringEntry(
        joints=(draw(NAMES),),
        law=Linear(draw(POSITIVE), draw(ANGLES)),
        stop_stiffness=draw(POSITIVE),
        stop_onset=draw(POSITIVE),
    )


TORQUES = st.floats(min_value=-1e6, max_value=1e6)
RATES = TORQUES.filter(bool)
RANGES = ZONES.filter(lambda ends: ends[0] < ends[1])
POINT_ANGLES = st.lists(st.integers(-360, 360), min_size=2, max_size=20, unique=True).map(sorted)


@st.composite
def curves(draw: st.DrawFn) -> Interpolated:
    angles = [radians(angle) for angle in draw(POINT_ANGLES)]
    return Interpolated(tuple((angle, draw(TORQUES)) for angle in angles))


@st.composite
def two_curves(draw: st.DrawFn) -> Hysteresis:
    """A curve, and another above it at the same angles."""
    up = draw(curves())
    gap = draw(st.floats(0.0, 100.0))
    return Hysteresis(up, Interpolated(tuple((angle, torque + gap) for angle, torque in up.points)))


EXPONENTIALS = st.builds(
    Exponential,
    st.lists(st.builds(ExponentialTerm, TORQUES, RATES), min_size=1, max_size=20).map(tuple),
    TORQUES,
    st.none() | RANGES,
)
LIMITS = st.builds(
    lambda ends, *others: SmoothLimit(*ends, *others),
    ZONES,
    st.just(0.0) | POSITIVE,
    st.just(0.0) | POSITIVE,
    st.floats(min_value=1e-3, max_value=10.0),
    st.none() | RANGES,
)
ROWS = [f"{name}/{row}" for name in publications() for row in publication(name).curves]
PUBLISHED = st.builds(PublishedLaw, st.sampled_from(ROWS), st.sampled_from([-1, 1]))
SAID = TEXTS.filter(bool)


@st.composite
def whole_laws(draw: st.DrawFn) -> SpringEntry:
    law = draw(curves() | two_curves() | EXPONENTIALS | LIMITS | PUBLISHED)
    # What a published row brings along is written as if it were the file's own.
    texts = SAID if isinstance(law, PublishedLaw) else TEXTS
    two = isinstance(law, Hysteresis)
    hysteresis = 0.0 if two else draw(st.just(0.0) | POSITIVE)
    return SpringEntry(
        joints=(draw(NAMES),),
        law=law,
        scale=draw(st.just(1.0) | st.just(0.0) | POSITIVE),
        offset=draw(ANGLES),
        hysteresis=hysteresis,
        slip_rate=draw(POSITIVE) if two or hysteresis else DEFAULT_SLIP_RATE,
        damping=Damping(draw(st.just(0.0) | POSITIVE)),
        motion=draw(texts),
        reference=draw(texts),
        why=draw(texts),
    )


@st.composite
def own_laws(draw: st.DrawFn, coordinates: tuple[str, ...]) -> CoupledExponential:
    count = len(coordinates)
    numbers = st.tuples(*[TORQUES] * count)
    terms = st.builds(CoupledTerm, numbers, numbers.filter(any), TORQUES)
    none = st.just((None,) * count)
    return CoupledExponential(
        coordinates,
        tuple(draw(st.lists(terms, min_size=1, max_size=4))),
        draw(numbers),
        draw(none | st.tuples(*[RANGES] * count)),
    )


@st.composite
def coupled_entries(draw: st.DrawFn) -> CoupledEntry:
    """A published law of two coordinates, the third held, or one of two or three in own numbers."""
    published = draw(st.sampled_from([None, "riener_edrich_1999/leg", "silder_2007/leg"]))
    own, held = None, ()
    if published is None:
        names = draw(st.lists(NAMES, min_size=2, max_size=3, unique=True))
        coordinates = tuple(names)
        own = draw(own_laws(coordinates))
    else:
        *hung, last = draw(st.permutations(coupled_law(published).law.coordinates))
        coordinates, held = tuple(hung), ((last, draw(HELD)),)
    count = len(coordinates)
    knows = own is None or own.valid_ranges[0] is not None
    sides = st.tuples(*[NAMES] * count)
    return CoupledEntry(
        joints=tuple(draw(st.lists(sides, min_size=1, max_size=2, unique=True))),
        coordinates=coordinates,
        axes=draw(st.tuples(*[st.sampled_from([None, "x", "y", "z"])] * count)),
        senses=draw(st.tuples(*[st.sampled_from([-1, 1])] * count)),
        published=published,
        explicit_law=own,
        held=held,
        is_nearest_conservative=knows and draw(st.booleans()),
        scale=draw(st.just(1.0) | POSITIVE),
        offsets=draw(st.tuples(*[st.just(0.0) | ANGLES] * count)),
        reference=draw(SAID if published else TEXTS),
        why=draw(SAID if published else TEXTS),
    )


FILES = st.builds(
    SpringsFile,
    entries=st.lists(cubics() | linears() | whole_laws(), min_size=1, max_size=3).map(tuple),
    coupled=st.lists(coupled_entries(), max_size=2).map(tuple),
    figure=st.none() | NAMES,
    joining=st.none() | st.sampled_from(Joining),
)


@given(FILES, TEXTS.filter(lambda text: text.isprintable()))
def test_what_is_written_is_read_back(content: SpringsFile, comment: str):
    reading = parse_springs(write_springs(content, comment))
    # Where it is held, a law may be an extrapolation.
    assert select_errors(reading.diagnostics) == ()
    assert reading.value == content


@pytest.mark.parametrize("name", ["prototype.springs.toml", "prototype.coupled.springs.toml"])
def test_the_prototypes_springs_are_read_back(name: str):
    content = parse_springs((FIGURES / name).read_text(encoding="utf-8")).value
    assert content is not None
    assert parse_springs(write_springs(content)).value == content


def test_the_comment_stands_above():
    text = write_springs(SpringsFile((SpringEntry(("knee",), law=Linear(1.0)),)), "one\ntwo")
    assert text.startswith("# one\n# two\n\n[[spring]]\n")


def test_what_no_reader_takes_is_not_written():
    long = SpringsFile((SpringEntry(("knee",), law=Linear(1.0), reference="x" * 2000),))
    with pytest.raises(ValueError, match="1000 characters"):
        write_springs(long)
    infinite = SpringsFile((SpringEntry(("knee",), law=Linear(inf)),))
    with pytest.raises(ValueError, match="finite"):
        write_springs(infinite)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (Exponential((ExponentialTerm(1.0, 2.0, 0.5),)), "about the angle zero"),
        (Hysteresis.from_mean_and_width(Linear(3.0), 1.0), "one and a hysteresis"),
    ],
)
def test_a_law_that_no_key_holds_is_not_written(law: Exponential | Hysteresis, message: str):
    with pytest.raises(ValueError, match=message):
        write_springs(SpringsFile((SpringEntry(("knee",), law=law),)))


def test_ranges_of_some_coordinates_only_are_not_written():
    law = CoupledExponential(
        ("a", "b"), (CoupledTerm((1.0, 2.0), (1.0, 2.0)),), (0.0, 0.0), ((0.0, 1.0), None)
    )
    entry = CoupledEntry((("hip", "knee"),), ("a", "b"), (None, None), (1, 1), explicit_law=law)
    with pytest.raises(ValueError, match="of all coordinates or of none"):
        write_springs(SpringsFile((), coupled=(entry,)))
