"""Files of markers, and the sites that markers are on."""

import builtins
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from generator import read_figure
from generator.diagnostics import InputError, UsageError
from generator.inverse.markers import (
    TASKS_FILE,
    TRC_FILE,
    Markers,
    find_marker_sites,
    format_trc,
    read_markers,
)
from generator.model_files.formats import read_model
from tests.generator.inverse.walking import MODEL

WORDS = st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=12).filter(
    lambda word: word.strip() == word and "\n" not in word
)
NUMBERS = st.one_of(st.just(np.nan), st.floats(-1e3, 1e3))


@st.composite
def trajectories(draw: st.DrawFn) -> Markers:
    names = draw(st.lists(WORDS, unique=True, min_size=1, max_size=4))
    steps = draw(st.lists(st.floats(1e-4, 1.0), min_size=1, max_size=5))
    positions = draw(arrays(float, (len(steps), len(names), 3), elements=NUMBERS))
    return Markers(np.cumsum(steps), tuple(names), positions)


@given(trajectories())
def test_what_was_written_is_read(markers: Markers):
    read = TRC_FILE.parse_text(format_trc(markers)).require_value()
    assert read.names == markers.names
    assert np.array_equal(read.times, markers.times)
    assert np.array_equal(read.positions, markers.positions, equal_nan=True)


TRC = """PathFileType\t4\t(X/Y/Z)\twalk.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits
100\t100\t3\t2\tmm
Frame#\tTime\tknee\t\t\theel\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2

1\t0\t1000\t2000\t3000\t100\t200\t300
2\t0.01\t1001\t2001\t3001
3\t0.02\t1002\t2002\t3002\t\t\t
"""


def test_lengths_are_in_the_unit_and_empty_cells_are_missing():
    markers = TRC_FILE.parse_text(TRC).require_value()
    assert markers.names == ("knee", "heel")
    assert markers.times.tolist() == [0.0, 0.01, 0.02]
    np.testing.assert_allclose(markers.positions[:, 0, 2], [3.0, 3.001, 3.002])
    assert np.isnan(markers.positions[1:, 1]).all()


def test_headers_with_more_tabs_and_blanks_than_columns_are_read():
    text = TRC.replace("PathFileType\t4", "PathFileType  4").replace(
        "100\t100\t3\t2\tmm", "  100.0\t\t  100.0 \t\t   3\t\t  2\t mm"
    )
    found, plain = (TRC_FILE.parse_text(one).require_value() for one in (text, TRC))
    assert np.array_equal(found.positions, plain.positions, equal_nan=True)


@pytest.mark.parametrize(
    ("old", "new", "message", "line"),
    [
        ("PathFileType", "Path", "this is not a file of markers", 1),
        ("\tmm", "\tfurlong", "the `Units` are none of m, cm, mm", 3),
        ("\theel", "\tknee", "a second marker `knee`", 4),
        ("3\t2\tmm", "3\t5\tmm", "the file has 2 markers, not 5", 3),
        ("100\t3\t2", "100\t9\t2", "the file has 3 frames, not 9", 3),
        ("2001", "2oo1", "`2oo1` is not a finite number", 8),
        ("0.02", "0.01", "the time does not increase", 9),
        ("3\t0.02", "3\t", "the time is missing", 9),
        ("\t300\n", "\t300\t1\n", "this row has more than 2 markers", 7),
        (TRC[TRC.index("\n1\t") :], "\n", "there are no frames", 4),
        (TRC[TRC.index("100\t") :], "", "the header of the markers is not whole", 1),
    ],
)
def test_errors_have_a_place(old: str, new: str, message: str, line: int):
    parsed = TRC_FILE.parse_text(TRC.replace(old, new))
    assert parsed.value is None
    found = [one for one in parsed.diagnostics if message in one.message]
    assert found, parsed.diagnostics
    assert found[0].span is not None
    assert found[0].span.line == line


def test_other_suffixes_are_refused():
    with pytest.raises(UsageError, match=r"markers are read from .trc and .c3d"):
        read_markers(Path("walk.csv"))


def test_z_up_becomes_y_up(tmp_path: Path):
    path = tmp_path / "walk.trc"
    path.write_text(TRC)
    plain, turned = read_markers(path), read_markers(path, "z")
    x, y, z = plain.positions[0, 0]
    assert turned.positions[0, 0].tolist() == [x, z, -y]


def test_c3d_needs_its_reader(monkeypatch: pytest.MonkeyPatch):
    own = builtins.__import__

    def refused(name: str, *others: Any, **more: Any) -> Any:
        if name == "ezc3d":
            raise ImportError(name)
        return own(name, *others, **more)

    monkeypatch.setattr(builtins, "__import__", refused)
    with pytest.raises(UsageError, match=r'needs ezc3d: .*`pip install -e "\.\[c3d\]"`'):
        read_markers(Path("walk.c3d"))


def test_points_of_c3d(tmp_path: Path):
    ezc3d: Any = pytest.importorskip("ezc3d")
    rng, names = np.random.default_rng(2), ["knee", "heel", "toe"]
    positions = rng.normal(size=(5, 3, 3))
    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [100]
    content["parameters"]["POINT"]["LABELS"]["value"] = names
    content["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    points = np.ones((4, 3, 5))
    points[:3] = 1e3 * np.moveaxis(positions, 2, 0).swapaxes(1, 2)
    content["data"]["points"] = points
    residuals = np.zeros((1, 3, 5))
    residuals[0, 1, 2] = -1.0
    content["data"]["meta_points"]["residuals"] = residuals
    path = tmp_path / "walk.c3d"
    content.write(str(path))
    markers = read_markers(path)
    assert markers.names == tuple(names)
    np.testing.assert_allclose(np.diff(markers.times), 0.01)
    assert np.isnan(markers.positions[2, 1]).all()
    positions[2, 1] = np.nan
    np.testing.assert_allclose(markers.positions, positions, atol=1e-6)


def test_a_wrong_c3d_is_refused(tmp_path: Path):
    pytest.importorskip("ezc3d")
    path = tmp_path / "walk.c3d"
    with pytest.raises(InputError, match="cannot be read"):
        read_markers(path)
    path.write_bytes(b"no points")
    with pytest.raises(InputError, match=r"cannot be read as .c3d"):
        read_markers(path)


def test_names_of_markers_are_sites():
    figure = read_model(MODEL).figure
    sites = find_marker_sites(["R.ASIS", "femur_r.R_Thigh_Upper", "frame", "nothing"], figure)
    assert {name: one.segment for name, one in sites.items()} == {
        "R.ASIS": "pelvis",
        "femur_r.R_Thigh_Upper": "femur_r",
    }
    prototype = read_figure("prototype")
    assert find_marker_sites(["left_lower_leg.distal"], prototype).keys() == {
        "left_lower_leg.distal"
    }


def test_tasks_are_weights():
    text = """<IKTaskSet><objects>
    <IKMarkerTask name="a"><apply>true</apply><weight>10</weight></IKMarkerTask>
    <IKMarkerTask name="b"><apply>false</apply><weight>3</weight></IKMarkerTask>
    </objects></IKTaskSet>"""
    assert TASKS_FILE.parse_text(text).require_value() == {"a": 10.0, "b": 0.0}
    assert TASKS_FILE.parse_text("<IKTaskSet/>").value is None
    assert TASKS_FILE.parse_text(text.replace("10", "many")).value is None
