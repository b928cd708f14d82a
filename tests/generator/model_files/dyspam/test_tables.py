"""DYSPAM's files: reading what was written gives the same mechanism, to the last bit."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from generator.diagnostics import Diagnostics, Source
from generator.model_files.dyspam.mechanism import (
    LOAD_KINDS,
    Connection,
    JointType,
    LinearSpring,
    Mechanism,
    MechanismBody,
    Point,
    PointLoad,
)
from generator.model_files.dyspam.tables import (
    Structure,
    Times,
    count_loads,
    format_jackforce,
    format_structure,
    format_tables,
    parse_jackforce,
    parse_structure,
    parse_tables,
)

NUMBERS = st.floats(-1e9, 1e9, allow_nan=False)
POSITIVE = st.floats(0.0, 1e9, exclude_min=True)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


@st.composite
def mechanisms(draw: st.DrawFn) -> Mechanism:
    bodies, joints, more = (draw(st.integers(1, 4)) for _ in range(3))
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))

    def numbers(count: int, low: float = -1e9) -> tuple[float, ...]:
        return tuple((rng.uniform(low, 1e9, count) * 10.0 ** -rng.integers(0, 20)).tolist())

    def triad() -> tuple[tuple[float, ...], ...]:
        rows = np.column_stack(
            [Rotation.from_rotvec(rng.normal(size=3)).as_matrix(), numbers(3)]
        ).tolist()
        return tuple(map(tuple, rows))

    def end() -> int:
        return int(rng.integers(0, bodies + 1))

    connections = []
    for _ in range(joints):
        kind = draw(st.sampled_from(JointType))
        count = len(kind.axes)
        pair = (triad(), triad())
        connections.append(Connection(end(), end(), kind, pair, numbers(count), numbers(count)))
    owners = [*range(1, bodies + 1), *(end() for _ in range(more))]
    points = [Point(owner, numbers(3)) for owner in owners]
    springs = [
        LinearSpring(k, axis, draw(NUMBERS), draw(POSITIVE), draw(NUMBERS))
        for k, connection in enumerate(connections, start=1)
        for axis in connection.type.axes
        if draw(st.booleans())
    ]
    made = [MechanismBody(k, *numbers(1, 1.0), numbers(3)) for k in range(1, bodies + 1)]
    return Mechanism(tuple(connections), tuple(made), tuple(points), tuple(springs))


@settings(max_examples=50)
@given(mechanisms())
def test_a_mechanism_is_read_as_it_was_written(mechanism):
    findings = Diagnostics()
    structure = Structure(
        len(mechanism.bodies), len(mechanism.connections), 0, (0,) * 4, len(mechanism.springs)
    )
    text = format_tables(mechanism)
    assert parse_tables(Source("ndyspamfile", text), structure, findings) == mechanism
    assert findings.entries == []


@settings(max_examples=50)
@given(
    st.lists(st.builds(PointLoad, st.sampled_from(LOAD_KINDS), st.integers(1, 5), VECTORS)),
)
def test_loads_are_read_as_they_were_written_in_the_order_of_their_kinds(loads):
    findings = Diagnostics()
    read = parse_jackforce(
        Source("jackforce", format_jackforce(loads)), count_loads(loads), 5, findings
    )
    assert findings.entries == []
    assert list(read) == sorted(loads, key=lambda load: LOAD_KINDS.index(load.kind))


@given(
    st.integers(1, 99),
    st.integers(1, 99),
    st.integers(0, 99),
    st.tuples(*[st.integers(0, 9)] * 4),
    st.integers(0, 99),
    st.builds(Times, st.floats(-1e3, 0.0), POSITIVE, POSITIVE, POSITIVE),
)
def test_structure_is_read_as_it_was_written(bodies, joints, freedoms, loads, springs, times):
    findings = Diagnostics()
    structure = Structure(bodies, joints, freedoms, loads, springs, times)
    read = parse_structure(Source("structure", format_structure(structure)), findings)
    assert findings.entries == []
    assert read is not None
    assert replace(read, span=None) == structure


def test_comments_and_commas_are_read_as_fortran_and_people_have_them():
    text = format_structure(Structure(1, 2, 3, (1, 0, 0, 2), 4))
    findings = Diagnostics()
    changed = text.replace("1, 2, 3", "1 2,3   # bodies, joints, freedoms").replace(
        "0.020000", "2.D-2"
    )
    read = parse_structure(Source("structure", changed), findings)
    assert findings.entries == []
    assert read is not None
    assert (read.bodies, read.joints, read.degrees_of_freedom, read.loads) == (
        1,
        2,
        3,
        (1, 0, 0, 2),
    )
    assert read.times.frame == 0.02


def test_flags_are_noticed():
    text = format_structure(Structure(1, 1, 3, (0,) * 4, 0)).replace("\n0\n", "\n1\n")
    read = parse_structure(Source("structure", text), Diagnostics())
    assert read is not None
    assert read.has_flags
