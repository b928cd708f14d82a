"""The laws of all kinds of text files: damaged, missing, of any ends of line, shipped by name."""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator import read_figure
from generator.contact_file.file import CONTACT_FILE, write_contact
from generator.diagnostics import InputError, select_errors
from generator.figure_file import FIGURE_FILE
from generator.figure_file.write import write_figure, write_pose
from generator.file_kind import FileKind
from generator.geometry.psurf import PSURF_FILE, format_psurf
from generator.input_files.coordinates import COORDINATE_NAMES, write_coordinates
from generator.input_files.drives import DRIVES_FILE
from generator.input_files.links import LINK_ENTRIES
from generator.input_files.live import LIVE_FILE, LiveLog, LiveStart, write_live
from generator.input_files.loads import LOADS_FILE
from generator.input_files.moments import MOMENTS_FILE
from generator.input_files.pose import POSE_FILE
from generator.input_files.scene import SCENE_FILE, write_scene
from generator.input_files.tone import STRENGTH_FILE, TONE_FILE
from generator.inverse.markers import TASKS_FILE, TRC_FILE, Markers, format_trc
from generator.kinematics.links import LINKS_FILE
from generator.motion_files.action import ACTION_FILE, format_action
from generator.motion_files.opensim_table import COORDINATES_FILE, CoordinateTable
from generator.person.measures import MEASURES_FILE
from generator.springs_file.optional import OPTIONAL_FILE, write_optional
from generator.springs_file.parse import SPRINGS_FILE
from generator.springs_file.write import write_springs
from generator.study.study_file import STUDY_FILE
from generator.text_io import MAX_FILE_BYTES, make_source
from tests.paths import FIGURES, ROOT

FIGURE = read_figure("prototype")
LIVE = LiveLog("prototype.fig", None, LiveStart(), end_frame=3)
LINK = '[[link]]\njoints = ["left_knee"]\ncontrol = "right_knee"\n'
LOAD = "site,kind,time [s],x [N],y [N],z [N]\ncenter_torso.distal,globalforce,0,0,1,0\n"
PENDULUM = (FIGURES / "pendulum.fig").read_text(encoding="utf-8")
SPRING = """figure = "leg"
[[spring]]
joints = ["left_knee", "right_knee"]
points_deg_Nm = [[0, 1.5], [45, 0.25], [90, -2]]
viscous_Nms_rad = 0.1
"""
STRENGTH = """[[strength]]
motion = "left_knee flexion"
torque_Nm = [110, 210]
class = "estimate"
"""
STUDY = """figure = "pendulum"
stop = 0.3
[design]
kind = "sobol"
runs = 64
[parameters]
gravity_scale = { path = "gravity", low = 0.8, high = 1.2 }
[measures]
end = { column = "kinetic [J]", take = "last" }
"""
ACTION = """action 1
units s deg cm
figure leg.fig
sha256 none
start 0.0
stop 0.5
frame 0.5
springs none
law weighted
outcome done
message done at 0.5 s
joints 2
hip R(1,0,0)*T(0,0,1)
weld fixed
frames 2
0.0 0.0 0.0 1.5
1.0 0.5 30.0 -2.25
end
"""
COORDINATES = """coordinates
version=1
nRows=2
nColumns=2
inDegrees=yes
endheader
time left_knee_1
0 10
0.5 20
"""
COORDINATE = '[[coordinate]]\nname = "knee"\njoint = "left_knee"\nplace = 1\nshift_deg = 3\n'
PART = """[[part]]
name = "pelvis"
spheres = ["lower_torso 0", "left thigh 12"]
from_m = [0, 0.03]
stiffness_N_m = [30e3, 71e3]
damping_s_m = 1
band = [0.8, 1.7]
class = "scaled"
source = "of twelve people"
"""
TASKS = '<IKTaskSet><IKMarkerTask name="a"><weight>2</weight></IKMarkerTask></IKTaskSet>\n'
MARKERS = Markers(np.array([0.0, 0.5]), ("a", "b"), np.arange(12.0).reshape(2, 2, 3))
PSURF = "0 0 0\n10 0 0\n0 10 0\n0 0 10\n;;\n1 3 2;\n1 2 4;\n1 4 3;\n2 3 4;\n;;\n"


def table_content(table: CoordinateTable) -> tuple[object, ...]:
    titles = [title.text for title in table.titles]
    return titles, table.times.tolist(), table.numbers.tolist(), table.in_degrees


@dataclass(frozen=True)
class Example:
    """A text of a kind, what its parser needs beside it, and the writer of its values."""

    kind: FileKind[Any, ...]
    text: str
    given: tuple[object, ...] = ()
    write: Callable[[Any], str] | None = None
    content: Callable[[Any], object] | None = None
    """What is equal for equal values, where these cannot be compared [default: as written]."""

    def parse(self, text: str) -> Any:
        return self.kind.parse_text(text, *self.given)

    def comparable(self, value: Any) -> object:
        compare = self.content or self.write
        return value if compare is None else compare(value)


EXAMPLES = {
    "ACTION_FILE": Example(ACTION_FILE, ACTION, write=format_action),
    "CONTACT_FILE": Example(CONTACT_FILE, PART, write=write_contact),
    "COORDINATES_FILE": Example(COORDINATES_FILE, COORDINATES, content=table_content),
    "COORDINATE_NAMES": Example(
        COORDINATE_NAMES, COORDINATE, (FIGURE,), lambda read: write_coordinates(read, FIGURE)
    ),
    "DRIVES_FILE": Example(
        DRIVES_FILE, "time [s],left_knee [deg]\n0,0\n1,10\n2,5\n", (FIGURE,), content=repr
    ),
    "FIGURE_FILE": Example(FIGURE_FILE, PENDULUM, write=write_figure),
    "LINK_ENTRIES": Example(LINK_ENTRIES, LINK),
    "LINKS_FILE": Example(LINKS_FILE, LINK, (FIGURE,)),
    "LIVE_FILE": Example(LIVE_FILE, write_live(LIVE), write=write_live),
    "LOADS_FILE": Example(LOADS_FILE, LOAD, (FIGURE,)),
    "MEASURES_FILE": Example(MEASURES_FILE, "hand_length_mm = 188\n"),
    "MOMENTS_FILE": Example(
        MOMENTS_FILE, "angle [deg],moment [N m]\n0,0\n10,1\n20,2\n30,3\n40,4\n"
    ),
    "OPTIONAL_FILE": Example(
        OPTIONAL_FILE, "1 1\n1 2 3 4\n5 6\n.7 -1 1 # waist\n", write=write_optional
    ),
    "POSE_FILE": Example(
        POSE_FILE,
        "joint left_knee {\n  displacement = (30deg);\n}\n",
        (FIGURE,),
        lambda pose: write_pose(FIGURE, pose),
        dict,
    ),
    "PSURF_FILE": Example(PSURF_FILE, PSURF, write=format_psurf),
    "SCENE_FILE": Example(
        SCENE_FILE, (FIGURES / "step.scene.toml").read_text(encoding="utf-8"), write=write_scene
    ),
    "SPRINGS_FILE": Example(SPRINGS_FILE, SPRING, write=write_springs),
    "STUDY_FILE": Example(STUDY_FILE, STUDY),
    "TASKS_FILE": Example(TASKS_FILE, TASKS, content=dict),
    "TRC_FILE": Example(TRC_FILE, format_trc(MARKERS), write=format_trc),
    "STRENGTH_FILE": Example(STRENGTH_FILE, STRENGTH),
    "TONE_FILE": Example(TONE_FILE, (FIGURES / "fall.tone.toml").read_text(encoding="utf-8")),
}

every_kind = pytest.mark.parametrize("example", EXAMPLES.values(), ids=EXAMPLES)
every_shipped_kind = pytest.mark.parametrize(
    "kind", [one.kind for one in EXAMPLES.values() if one.kind.is_shipped], ids=lambda one: one.noun
)


def test_every_kind_has_an_example() -> None:
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "generator").rglob("*.py")]
    rows = {name for text in sources for name in re.findall(r"^(\w+) = FileKind\(", text, re.M)}
    assert rows == set(EXAMPLES)


@every_kind
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"], ids=["plain", "marked"])
@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"], ids=["lf", "crlf", "cr"])
def test_marks_and_ends_of_lines_change_nothing(
    example: Example, mark: bytes, end: bytes, tmp_path: Path
) -> None:
    path = tmp_path / f"file{example.kind.suffix}"
    path.write_bytes(mark + example.text.encode().replace(b"\n", end))
    parsed = example.kind.parse_file(path, *example.given)
    assert not select_errors(parsed.diagnostics)
    named = example.kind.parse(make_source(example.text, str(path), path), *example.given)
    expected = example.comparable(named.value)
    assert example.comparable(parsed.value) == expected
    assert example.comparable(example.kind.read(path, *example.given)) == expected


@every_kind
def test_what_was_written_is_read(example: Example) -> None:
    if example.write is not None:
        value = example.parse(example.text).require_value()
        again = example.parse(example.write(value)).require_value()
        assert example.comparable(again) == example.comparable(value)
        assert example.write(again) == example.write(value)


@every_kind
def test_what_is_no_text_is_a_sentence(example: Example, tmp_path: Path) -> None:
    def fault(path: str | Path) -> str:
        with pytest.raises(InputError) as refused:
            example.kind.read(path, *example.given)
        (fault,) = refused.value.diagnostics
        return fault.message

    name = f"none{example.kind.suffix}"
    missing = "cannot be read: no such file or directory"
    if example.kind.is_shipped:
        missing = f"no shipped {example.kind.noun} of that name"
    for path in (tmp_path / name, tmp_path / "no" / name, tmp_path / ("a" * 5000)):
        assert missing in fault(path) or "cannot be read: file name too long" in fault(path)
    assert "is a directory, not a file" in fault(tmp_path)
    assert fault("/dev/zero") == "`/dev/zero` cannot be read: it is not a regular file"
    path = tmp_path / name
    with path.open("wb") as file:
        file.truncate(MAX_FILE_BYTES + 1)
    assert fault(path) == f"`{path}` is larger than 32 MB"
    path.write_bytes(b"\xef\xbb\xbf one\r\n{ # caf\xe9 }")
    assert fault(path) == "byte 0xE9 is not UTF-8"
    path.write_bytes(example.text.encode() + b"\0")
    assert fault(path) == "this is a binary file, not a text"


PIECES = ("", *'\n=,"-0[{\x00é\r#', "nan", "1e999", "true")


@every_kind
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_a_damaged_text_is_diagnosed(example: Example, data: st.DataObject) -> None:
    """A part of the text is lost, or another one in its place."""
    text = example.text
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(start + 20, len(text))))
    words = st.sampled_from(PIECES) | st.sampled_from(text.split()) | st.text(max_size=5)
    text = text[:start] + data.draw(words) + text[end:]
    parsed = example.parse(text)
    assert (parsed.value is None) == bool(select_errors(parsed.diagnostics))
    for fault in parsed.diagnostics:
        assert fault.span is not None
        assert 0 <= fault.span.start <= fault.span.end <= len(fault.span.source.text) + 1
        assert str(fault)


@every_kind
@settings(max_examples=20, deadline=None)
@given(data=st.data())
def test_any_text_has_a_value_or_an_error(example: Example, data: st.DataObject) -> None:
    letters = st.text(sorted(set(example.text)), max_size=100)
    parsed = example.parse(data.draw(st.text(max_size=60) | letters))
    assert (parsed.value is None) == bool(select_errors(parsed.diagnostics))


@every_shipped_kind
def test_shipped_files_are_found_by_name(kind: FileKind[Any, ...], tmp_path: Path) -> None:
    shipped = kind.shipped()
    assert shipped
    for name, path in shipped.items():
        assert kind.find(name) == path
        (fault,) = kind.parse_file(f"{name}x").diagnostics
        assert (
            fault.message == f"there is no file `{name}x` and no shipped {kind.noun} of that name"
        )
        assert fault.hint == f"did you mean `{name}`?"
        assert kind.parse_file(f"{name}x{kind.suffix}").diagnostics[0].hint == fault.hint
    name = next(iter(shipped))
    own = tmp_path / name
    own.write_bytes(shipped[name].read_bytes())
    assert kind.find(own) == own
    assert replace(kind, is_shipped=False).shipped() == {}


@every_shipped_kind
def test_own_files_are_found_without_their_suffix(
    kind: FileKind[Any, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before shipped ones of the name, except figures, where the command says so."""
    monkeypatch.chdir(tmp_path)
    name, shipped = min(kind.shipped().items(), key=lambda one: one[1].stat().st_size)
    for stem in (name, "ramp"):
        Path(f"{stem}{kind.suffix}").write_bytes(shipped.read_bytes())
    assert kind.find("ramp") == Path(f"ramp{kind.suffix}")
    own = Path(f"{name}{kind.suffix}")
    assert kind.find(name) == (shipped if kind.prefers_shipped else own)
    folder = Path("elsewhere")
    assert kind.find("ramp", folder) == folder / "ramp"
    assert kind.find("ramp", tmp_path) == tmp_path / f"ramp{kind.suffix}"
    found = [str(one) for one in kind.parse_file(name).diagnostics]
    assert any("is the shipped" in text for text in found) == kind.prefers_shipped
