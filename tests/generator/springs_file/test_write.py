"""Writing a springs file: reading what was written gives the same springs."""

from math import inf, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import select_errors
from generator.springs_file.coupled import CoupledEntry
from generator.springs_file.laws import SlideEntry
from generator.springs_file.parse import SPRINGS_FILE, SpringEntry, SpringsFile
from generator.springs_file.published import PublishedLaw
from generator.springs_file.write import write_springs
from springs import Damping, Linear, SphericalLaw
from springs.coupled import CoupledExponential, CoupledTerm
from springs.damping import DEFAULT_SLIP_RATE
from springs.exponential import Exponential, ExponentialTerm
from springs.hysteresis import Hysteresis
from springs.published.tables import coupled_law
from tests.laws import ANGLES, ENTRY_STRATEGIES, POSITIVE

HELD = st.floats(min_value=-pi, max_value=pi)
TEXTS = st.text(st.characters(exclude_categories=("Cs",), exclude_characters="\r"), max_size=120)
NAMES = st.text(st.characters(exclude_categories=("Cs",)), min_size=1, max_size=20)
SAID = TEXTS.filter(bool)
TORQUES = st.floats(min_value=-1e6, max_value=1e6)
RANGES = st.tuples(ANGLES, ANGLES).map(sorted).map(tuple).filter(lambda ends: ends[0] < ends[1])


@st.composite
def spring_entries(draw: st.DrawFn) -> SpringEntry:
    law = draw(st.none() | st.one_of(*ENTRY_STRATEGIES.values()))
    # What a published row brings along is written as if it were the file's own.
    texts = SAID if isinstance(law, PublishedLaw) else TEXTS
    if isinstance(law, SlideEntry) or (law is None and draw(st.booleans())):
        return SpringEntry(
            joints=tuple(draw(st.lists(NAMES, min_size=1, max_size=3))),
            axis=draw(st.sampled_from(["along x", "along y", "along z"])),
            law=law,
            scale=1.0 if law is None else draw(st.just(1.0) | st.just(0.0) | POSITIVE),
            damping=Damping(draw(st.just(0.0) | POSITIVE), draw(st.just(0.0) | POSITIVE)),
            motion=draw(TEXTS),
            reference=draw(TEXTS),
            why=draw(TEXTS),
        )
    is_two_curves = isinstance(law, Hysteresis)
    hysteresis = 0.0 if law is None or is_two_curves else draw(st.just(0.0) | POSITIVE)
    return SpringEntry(
        joints=tuple(draw(st.lists(NAMES, min_size=1, max_size=3))),
        axis=draw(st.sampled_from([None, "x", "y", "z"])),
        law=law,
        scale=1.0 if law is None else draw(st.just(1.0) | st.just(0.0) | POSITIVE),
        offset=0.0 if law is None else draw(ANGLES),
        hysteresis=hysteresis,
        slip_rate=draw(POSITIVE) if is_two_curves or hysteresis else DEFAULT_SLIP_RATE,
        damping=Damping(draw(st.just(0.0) | POSITIVE), draw(st.just(0.0) | POSITIVE)),
        stop_stiffness=draw(POSITIVE),
        stop_onset=draw(POSITIVE),
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
        held_angles=held,
        is_nearest_conservative=knows and draw(st.booleans()),
        scale=draw(st.just(1.0) | POSITIVE),
        offsets=draw(st.tuples(*[st.just(0.0) | ANGLES] * count)),
        reference=draw(SAID if published else TEXTS),
        why=draw(SAID if published else TEXTS),
    )


FILES = st.builds(
    SpringsFile,
    entries=st.lists(spring_entries(), min_size=1, max_size=2).map(tuple),
    coupled=st.lists(coupled_entries(), max_size=2).map(tuple),
    figure=st.none() | NAMES,
    law=st.none() | st.sampled_from(SphericalLaw),
)


@given(FILES, TEXTS.filter(lambda text: text.isprintable()))
def test_what_is_written_is_read_back(content: SpringsFile, comment: str):
    reading = SPRINGS_FILE.parse_text(write_springs(content, comment))
    # Where it is held, a law may be an extrapolation.
    assert select_errors(reading.diagnostics) == ()
    assert reading.value == content


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
