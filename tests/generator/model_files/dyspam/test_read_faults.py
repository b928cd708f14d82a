"""Broken files of DYSPAM: one sentence each, with file and line."""

from importlib.resources import files
from pathlib import Path
from shutil import copytree

import pytest

from generator import read_figure
from generator.diagnostics import InputError, Severity, select_errors
from generator.model_files.dyspam import read as dyspam_reader
from generator.model_files.dyspam import write as dyspam
from springs import SpringSet
from tests.chains import chain, two_bodies
from tests.generator.model_files.model_cases import own_springs

S, N, J, O = dyspam.FILES  # noqa: E741
PENDULUM = Path(str(files("figures"))) / "pendulum.fig"


@pytest.fixture(scope="module")
def good(tmp_path_factory) -> Path:
    """The pendulum, with a record in `optional`."""
    folder = tmp_path_factory.mktemp("dyspam") / "good"
    figure = read_figure(PENDULUM)
    dyspam.format_files(figure, own_springs(figure), folder).write()
    (folder / O).write_text("1 1\n0.0 1000 0.0 500\n60 0.0\n0.0 0.0 0.0\n")
    return folder


@pytest.fixture
def folder(good: Path, tmp_path: Path) -> Path:
    """A copy of it, to be changed."""
    return copytree(good, tmp_path / "changed")


def change(path: Path, *replaced: tuple[str, str]) -> None:
    text = path.read_text()
    for old, new in replaced:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text)


BROKEN = [
    (S, "1, 1, 3", "1, 1", 1, "2 values instead of 3"),
    (S, "1, 1, 3", "0, 1, 3", 1, "the number of bodies is `0`"),
    (S, "1, 1, 3", "1, 1, 4", 1, "the number of degrees of freedom is 4"),
    (S, "1, 1, 3", "1, 2, 3", 2, "2 values instead of 4"),
    (S, "1, 1, 3", "2, 1, 3", 11, "5 values instead of 6"),
    (S, "1, 1, 3", "1, one, 3", 1, "`one` is not a number"),
    (S, "1, 1, 3", "1, 1.5, 3", 1, "the number of joints is `1.5`"),
    (S, "1 0 0 0", "2 0 0 0", 1, "the file ends before globalforce 2 of 2"),
    (S, "1 0 0 0", "0 0 0 0", 1, "a line is left over after the 0 loads"),
    (S, "1 0 0 0", "-1 0 0 0", 2, "the number of loads `globalforce` is `-1`"),
    (S, "0, 0, 3", "0, 0, 2", 16, "5 values instead of 7"),
    (S, "0, 0, 3", "0, 0, 4", 17, "7 values instead of 5"),
    (S, "0.000000, 0.001", "0.000000, -1", 6, "the step is not above zero"),
    (S, " 1.000000, 0.02", " 0.000000, 0.02", 6, "the stop time is not after the start"),
    (S, "10.0 ,1.0 ,0.1/\n", "", 7, "the file ends before a line of numerical parameters"),
    (S, "0.1/\n", "0.1/\n5\n", 9, "a line is left over"),
    (N, "1 0 1 7", "2 0 1 7", 1, "the number of the joint is `2`"),
    (N, "1 0 1 7", "1 0 2 7", 1, "the number of the body is `2`"),
    (N, "1 0 1 7", "1 0 1 2", 1, "the joint type `2` is not known"),
    (N, "1 0 1 7", "1 1 1 7", 2, "the number of the body is `0`"),
    (N, "\n0 1\n", "\n0 2\n", 2, "the number of the joint is `2`"),
    (N, "0.00 1.00 0.00 120.00", "0.00 1.00 0.00", 4, "3 values instead of 4"),
    (N, "0.00 1.00 0.00 120.00", "0.00 1.50 0.00 120.00", 3, "the triad of body 0 at joint 1"),
    (N, "0.00 1.00 0.00 120.00", "0.00 -1.00 0.00 120.00", 3, "the triad of body 0 at joint 1"),
    (N, "120.00", "nan", 4, "`nan` is not a number"),
    (N, "120.00", "1e999", 4, "`1e999` is too large"),
    (N, "120.00", "120cm", 4, "`120cm` is not a number"),
    (N, "1 3 25.0", "1 4 25.0", 10, "there is no point 4"),
    (N, "1 3 25.0", "1 3 -25.0", 10, "`body1` has a negative mass"),
    (N, "25.000000 50.0", "25.000000 500.0", 10, "no body has the inertia of `body1`"),
    (N, "2 1 150.00", "3 1 150.00", 12, "the number of the point is `3`"),
    (N, "2 1 150.00", "2 0 150.00", None, None),
    (N, "3 1 75.00", "3 0 75.00", 10, "point 3, the centre of mass of body 1, is on body 0"),
    (N, "2 1 150.00,0.00,-15.00\n", "", 12, "the number of the point is `3`"),
    (N, "1 1 0.00,0.00,0.00", "1 1 0.00 0.00,0.00", None, None),
    (N, "0.000000 3\n", "0.000000 4\n", 16, "the axis of the spring is `4`"),
    (N, "0.000000 3\n", "0.000000 2\n", 16, "a second spring of joint 1, axis 2"),
    (N, "100.000000 0.000000", "100.000000 -1", 14, "damping is negative"),
    (N, "0.000000 0.00 0.00 0.00\n", "0.000000 0.00 0.00\n", 17, "6 values instead of 7"),
    (J, "1 3 100", "1 4 100", 1, "the number of the point is `4`"),
    (J, "1 3 100", "2 3 100", 1, "the number of the load is `2`"),
    (J, "100.00", "x", 1, "`x` is not a number"),
    (O, "1 1\n", "2 1\n", 1, "there is no joint number 2"),
    (O, "60 0.0\n", "", 3, "the line `b_v b_coul` is missing"),
]


@pytest.mark.parametrize(("file", "old", "new", "line", "message"), BROKEN)
def test_each_fault_is_a_sentence_with_file_and_line(file, old, new, line, message, folder):
    change(folder / file, (old, new))
    faults = select_errors(dyspam_reader.parse_dyspam(folder).diagnostics)
    if message is None:
        assert faults == ()
        return
    assert len(faults) == 1, "\n".join(map(str, faults))
    (fault,) = faults
    assert message in fault.message
    assert fault.span is not None
    assert fault.span.line == line
    assert Path(fault.span.source.name).parent == folder


def test_all_faults_of_a_file_are_told_at_once(folder):
    change(folder / N, ("120.00", "far"), ("1 3 25", "1 9 25"))
    with pytest.raises(InputError) as caught:
        dyspam_reader.parse_dyspam(folder).require_value()
    assert [fault.span.line for fault in caught.value.diagnostics if fault.span] == [4, 10]


@pytest.mark.parametrize("file", [S, N, J])
def test_a_missing_file_is_named(file, folder):
    (folder / file).unlink()
    (fault,) = dyspam_reader.parse_dyspam(folder).diagnostics
    assert fault.message == f"`{folder / file}` cannot be read: no such file or directory"


@pytest.mark.parametrize("file", [S, N])
def test_an_empty_file_is_told_at_its_start(file, folder):
    (folder / file).write_text("")
    (fault,) = dyspam_reader.parse_dyspam(folder).diagnostics
    assert fault.message.startswith("the file ends before ")
    assert fault.span is not None
    assert fault.span.line == 1


def test_optional_is_optional(folder):
    (folder / O).unlink()
    reading = dyspam_reader.parse_dyspam(folder)
    assert reading.value is not None
    assert [len(joint.axes) for joint in reading.value.springs.joints.values()] == [3]
    (folder / O).write_text("# none\n")
    assert "there is no record" in dyspam_reader.parse_dyspam(folder).diagnostics[0].message
    (folder / O).write_text("\n")
    assert dyspam_reader.parse_dyspam(folder).diagnostics == ()


def test_no_folder_and_a_file_in_place_of_one(tmp_path):
    (tmp_path / "file").write_text("1, 1, 3\n")
    for name in ("nothing", "file"):
        (fault,) = dyspam_reader.parse_dyspam(tmp_path / name).diagnostics
        assert fault.message == f"there is no folder `{tmp_path / name}`"


def test_points_need_no_commas(folder, good):
    (folder / N).write_text((folder / N).read_text().replace(",", " "))
    assert (
        dyspam_reader.parse_dyspam(folder).value.figure
        == dyspam_reader.parse_dyspam(good).value.figure
    )


def test_two_decimals_of_a_triad_are_enough_for_the_nearest_turn(folder):
    turned = "0.71 0.00 -0.71 0.00\n0.00 1.00 0.00 120.00\n0.71 0.00 0.71 0.00\n"
    old = "0.00 0.00 -1.00 0.00\n0.00 1.00 0.00 120.00\n1.00 0.00 0.00 0.00\n"
    change(folder / N, (old, turned))
    reading = dyspam_reader.parse_dyspam(folder)
    assert [fault.severity for fault in reading.diagnostics] == [Severity.WARNING]
    assert reading.value is not None
    pose = reading.value.figure.segments["ground"].sites["joint1"].pose_in_segment
    assert pose[0, 0] == pytest.approx(0.5**0.5, abs=1e-12)


def test_a_second_joint_that_leaves_a_body_alone(tmp_path):
    given_figure = two_bodies(chain("Ry"), (0.3,))
    folder = tmp_path / "loose"
    dyspam.format_files(given_figure, own_springs(given_figure), folder).write()
    text = (folder / N).read_text().replace("2 1 2 1\n", "2 0 1 1\n").replace("\n2 2\n", "\n1 2\n")
    head, _, tail = text.partition("\n1 2\n")
    (folder / N).write_text(f"{head}\n0 2\n{tail}")
    (fault,) = select_errors(dyspam_reader.parse_dyspam(folder).diagnostics)
    assert fault.message == "no joints lead from the root to segment `body2`"
    assert fault.span is not None
    assert fault.span.text.startswith("2 ")


def test_joints_that_start_moving_are_named(tmp_path):
    dyspam.format_files(two_bodies(chain("Ry"), (0.3,)), SpringSet(), tmp_path / "out").write()
    path = tmp_path / "out" / dyspam.TABLES
    lines = path.read_text().splitlines()
    lines[-2] = " ".join([*lines[-2].split()[:4], "0.1", "0.2", "0.3"])
    lines[-1] = " ".join([*lines[-1].split()[:2], "-1.5"])
    path.write_text("\n".join(lines))
    model = dyspam_reader.parse_dyspam(tmp_path / "out").require_value()
    (lost,) = (loss for loss in model.losses.entries if "rates" in loss.what)
    assert lost.where == ("joint1", "joint2")
