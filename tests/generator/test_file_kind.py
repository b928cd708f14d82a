"""The laws of all kinds of text files: damaged, missing, of any ends of line, shipped by name."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator import read_figure
from generator.diagnostics import InputError, Source, select_errors
from generator.file_kind import FileKind
from generator.input_files.links import LINK_ENTRIES
from generator.input_files.live import LIVE_FILE, LiveLog, LiveStart, write_live
from generator.input_files.loads import LOADS_FILE
from generator.input_files.moments import MOMENTS_FILE
from generator.input_files.pose import POSE_FILE
from generator.input_files.scene import SCENE_FILE
from generator.kinematics.links import LINKS_FILE
from generator.person.measures import MEASURES_FILE
from tests.paths import FIGURES

FIGURE = read_figure("prototype")
LIVE = LiveLog("prototype.fig", None, LiveStart(), end_frame=3)
LINK = '[[link]]\njoints = ["left_knee"]\ncontrol = "right_knee"\n'


@dataclass(frozen=True)
class Example:
    """A text of a kind, and what its parser needs beside it."""

    kind: FileKind[Any, ...]
    text: str
    given: tuple[object, ...] = ()

    def parse(self, text: str) -> Any:
        return self.kind.parse_text(text, *self.given)


EXAMPLES = {
    "link entries": Example(LINK_ENTRIES, LINK),
    "links": Example(LINKS_FILE, LINK, (FIGURE,)),
    "live": Example(LIVE_FILE, write_live(LIVE)),
    "loads": Example(
        LOADS_FILE,
        "site,kind,time [s],x [N],y [N],z [N]\ncenter_torso.distal,globalforce,0,0,1,0\n",
        (FIGURE,),
    ),
    "moments": Example(MOMENTS_FILE, "angle [deg],moment [N m]\n0,0\n10,1\n20,2\n30,3\n40,4\n"),
    "pose": Example(POSE_FILE, "joint left_knee {\n  displacement = (30deg);\n}\n", (FIGURE,)),
    "scene": Example(SCENE_FILE, (FIGURES / "step.scene.toml").read_text(encoding="utf-8")),
    "measures": Example(MEASURES_FILE, "hand_length_mm = 188\n"),
}

every_kind = pytest.mark.parametrize("example", EXAMPLES.values(), ids=EXAMPLES)


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
    named = example.kind.parse(Source(str(path), example.text), *example.given)
    assert parsed.value == named.value
    assert example.kind.read(path, *example.given) == named.value


@every_kind
def test_a_missing_file_is_a_sentence(example: Example, tmp_path: Path) -> None:
    path = tmp_path / f"none{example.kind.suffix}"
    with pytest.raises(InputError, match=r"cannot be read: no such file|there is no file"):
        example.kind.read(path, *example.given)


@every_kind
@settings(max_examples=30)
@given(data=st.data())
def test_a_damaged_text_is_diagnosed(example: Example, data: st.DataObject) -> None:
    start = data.draw(st.integers(0, len(example.text)))
    end = data.draw(st.integers(start, min(start + 10, len(example.text))))
    text = example.text[:start] + data.draw(st.text(max_size=5)) + example.text[end:]
    parsed = example.parse(text)
    assert (parsed.value is None) == bool(select_errors(parsed.diagnostics))


def test_shipped_files_are_found_by_name(tmp_path: Path) -> None:
    shipped = SCENE_FILE.shipped()
    assert "step" in shipped
    for name, path in shipped.items():
        assert SCENE_FILE.find(name) == path
        assert SCENE_FILE.read(name) == SCENE_FILE.read(path)
    own = tmp_path / "step"
    own.write_bytes(shipped["bed"].read_bytes())
    assert SCENE_FILE.find(own) == own
    (fault,) = SCENE_FILE.parse_file("stp").diagnostics
    assert fault.message == "there is no file `stp` and no shipped scene of that name"
    assert fault.hint == "did you mean `step`?"
    assert POSE_FILE.shipped() == {}
