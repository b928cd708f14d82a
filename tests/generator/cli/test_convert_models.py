"""`mover convert` of another program's model."""

import re
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from generator.conversion import convert
from generator.diagnostics import UsageError
from generator.figure_file import read_figure
from generator.geometry.psurf import PSURF_FILE
from generator.springs_file.read import read_springs
from tests.command import answer, mover, run
from tests.generator.inverse.walking import MODEL, MOTION
from tests.generator.model_files.imported_models import MODELS

REFUSED = Path(__file__).parent / "refusals" / "files"
PIN, PLAIN_PIN = REFUSED / "pin.xml", REFUSED / "hinge.xml"


@pytest.mark.parametrize(
    "name", [pytest.param("humanoid.xml", marks=pytest.mark.slow), "arm.urdf", "leg.osim"]
)
def test_a_model_becomes_a_figure_that_moves(name: str, tmp_path: Path):
    figure = tmp_path / "model.fig"
    said = run("convert", MODELS / name, figure, "--verbose").stdout
    assert f"wrote {figure}" in said
    assert "the world is turned" in said or name == "leg.osim"
    run("simulate", figure, "--stop", "0.1", "-o", tmp_path / "m.action", "--quiet")


@pytest.mark.parametrize("is_replaced", [False, True])
def test_springs_that_the_fields_cannot_hold_stand_beside_the_figure(
    is_replaced: bool, tmp_path: Path
):
    """A file that exists is replaced if it is named."""
    figure, springs = tmp_path / "one.fig", tmp_path / "one.springs.toml"
    names = tmp_path / "one.coordinates.toml"
    if is_replaced:
        springs.write_text("# mine\n")
    said = answer("convert", PIN, figure, *([springs] if is_replaced else []))
    shapes = sorted(str(path) for path in (tmp_path / "one_geometry").iterdir())
    assert sorted(said["files"]) == sorted(map(str, [figure, springs, names, *shapes]))
    assert said["coordinates"]["pin"] == {"joint": "pin", "place": 1, "scale": 1.0, "shift": 0.0}
    assert any("friction losses" in loss["what"] for loss in said["losses"][str(figure)])
    assert "coulomb_Nm = 0.1" in springs.read_text()
    # The same import again changes nothing, so there is nothing to ask.
    run("convert", PIN, figure)


def test_an_older_springs_file_is_reported(tmp_path: Path):
    (tmp_path / "one.springs.toml").write_text("")
    said = run("convert", PLAIN_PIN, tmp_path / "one.fig").stdout
    assert "an older springs file stands beside the figure" in said


def test_revolutes_stay_separate_on_demand(tmp_path: Path):
    combined, single = tmp_path / "a.fig", tmp_path / "b.fig"
    run("convert", MODELS / "humanoid.xml", combined)
    run("convert", MODELS / "humanoid.xml", single, "--apart")
    assert "hip_right" in read_figure(combined).joints
    assert "hip_x_right" in read_figure(single).joints


def test_springs_of_balls_are_not_in_mujoco_models_but_under_a_law_of_coordinates(tmp_path: Path):
    path = tmp_path / "out.xml"
    said = run("convert", "prototype", path).stdout
    assert "springs of several rotations (convert with `--law coordinates`): waist" in said
    assert "not in" not in run("convert", "prototype", path, "--law", "coordinates").stdout


def test_a_figure_is_not_written_over_its_model(tmp_path: Path):
    model = tmp_path / "one.xml"
    model.write_bytes(PIN.read_bytes())
    (tmp_path / "one.fig").symlink_to(model)
    assert mover("convert", model, tmp_path / "one.fig").exit_code == 1
    assert model.read_bytes() == PIN.read_bytes()


def mjcf(bodies: str) -> str:
    return f"<mujoco><worldbody>{bodies}</worldbody></mujoco>"


def chained(joints: list[str], geom: str = "") -> str:
    """Bodies one behind the other, on joints with these attributes."""
    mass = f'<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>{geom}'
    return "".join(f'<body pos="0 0 0.1"><joint {words}/>{mass}</body>' for words in joints)


SIZES = st.sampled_from([0.0, 1e-9, 0.3, 5.0, 1e4, 1e16, 1e30, 1e50])
NUMBERS = st.tuples(SIZES, st.sampled_from([1, -1])).map(lambda parts: parts[0] * parts[1])


@st.composite
def joint_attributes(draw: st.DrawFn) -> str:
    """Springs, damping, friction and limits, some of them of no use."""
    stiffness = f"{draw(SIZES)} {draw(NUMBERS)} {draw(NUMBERS)}"
    words = {
        "type": draw(st.sampled_from(["hinge", "slide", "ball", "free"])),
        "axis": draw(st.sampled_from(["1 0 0", "0.6 0.8 0"])),
        "stiffness": draw(st.sampled_from(["0", "3", stiffness])),
        "springref": str(draw(NUMBERS)),
        "damping": str(draw(SIZES)),
        "frictionloss": str(draw(SIZES)),
        "range": " ".join(map(str, sorted([draw(NUMBERS), draw(NUMBERS)]))),
    }
    kept = draw(st.sets(st.sampled_from(sorted(words))))
    return " ".join(f'{key}="{words[key]}"' for key in sorted(kept))


@st.composite
def models(draw: st.DrawFn) -> str:
    """Chains of bodies with a mesh whose faces may be lines."""
    joints = draw(st.lists(joint_attributes(), min_size=1, max_size=4))
    corners = draw(st.lists(st.integers(0, 3), min_size=3, max_size=12))
    faces = " ".join(map(str, corners[: len(corners) // 3 * 3]))
    points = " ".join(str(draw(NUMBERS)) for _ in range(3)) + " 1 0 0 0 1 0 0 0 1"
    asset = f'<asset><mesh name="m" vertex="{points}" face="{faces}"/></asset>'
    geom = '<geom type="mesh" mesh="m" contype="0" conaffinity="0"/>'
    return mjcf(chained(joints, geom)).replace("<worldbody>", f"{asset}<worldbody>")


CROWD = mjcf(chained([f'name="j{k}" stiffness="1 -5 0"' for k in range(250)]))
LONG_NAMES = mjcf(chained([f'name="{k:0180d}" frictionloss="1"' for k in range(250)]))
STEEP = mjcf(chained(['stiffness="1 1e49 0" springref="1e30"']))
FAR = mjcf(chained(['stiffness="1e50" springref="1e50" frictionloss="1"']))


@pytest.mark.slow
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(models())
@example(CROWD)
@example(LONG_NAMES)
@example(STEEP)
@example(FAR)
def test_what_is_written_is_read_again_or_nothing_is_written(model: str):
    with TemporaryDirectory() as folder:
        source, path = Path(folder, "one.xml"), Path(folder, "one.fig")
        source.write_text(model)
        result = mover("convert", source, path)
        if result.exit_code != 0:
            assert result.exit_code == 1
            assert isinstance(result.exception, SystemExit), result.exception
            assert list(Path(folder).iterdir()) == [source]
            return
        figure = read_figure(path)
        read_springs(None, figure)
        for segment in figure.segments.values():
            assert segment.psurf is None or PSURF_FILE.read(path.parent / segment.psurf).face_count


def test_tables_of_many_joints_are_thinned_and_steep_springs_bounded(tmp_path: Path):
    for name, text, word in (("crowd", CROWD, "become tables"), ("far", FAR, "are bounded there")):
        (tmp_path / f"{name}.xml").write_text(text)
        said = answer("convert", tmp_path / f"{name}.xml", tmp_path / f"{name}.fig")
        losses = [loss["what"] for loss in said["losses"][str(tmp_path / f"{name}.fig")]]
        assert any(word in loss for loss in losses)


def test_springs_that_fit_no_file_are_refused_before_anything_is_written(tmp_path: Path):
    (tmp_path / "one.xml").write_text(LONG_NAMES)
    result = mover("convert", tmp_path / "one.xml", tmp_path / "one.fig")
    assert result.exit_code == 1
    assert "too long for a springs file" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["one.xml"]


@pytest.mark.parametrize("name", ["arm.urdf.xacro", "arm.xacro"])
def test_a_model_with_macros_names_the_program_that_writes_it_out(name: str, tmp_path: Path):
    (tmp_path / name).write_text("<robot/>")
    result = mover("convert", tmp_path / name, tmp_path / "arm.fig")
    assert result.exit_code == 2
    assert f"xacro {name} -o arm.urdf" in " ".join(result.stderr.split())
    with pytest.raises(UsageError, match="xacro"):
        convert(tmp_path / name, tmp_path / "arm.fig")


def coordinate_names_of(model: Path) -> list[str]:
    return re.findall(r'<Coordinate name="(.+?)"', model.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def gait(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The figure of a model of OpenSim, and the model that is written of it, `again.osim`."""
    figure = tmp_path_factory.mktemp("gait") / "gait10.fig"
    run("convert", MODEL, figure)
    run("convert", figure, figure.parent / "again.osim", "--quiet")
    return figure


def test_a_model_that_becomes_a_model_again_keeps_the_names_of_coordinates(gait: Path):
    again = gait.parent / "again.osim"
    assert sorted(coordinate_names_of(again)) == sorted(coordinate_names_of(MODEL))
    run("convert", again, gait.parent / "again.fig")
    tables = [gait.parent / f"{stem}.coordinates.toml" for stem in ("gait10", "again")]
    first, second = (table.read_text().partition("\n")[2] for table in tables)
    assert first == second
    # A motion plays on the first model and on the last one.
    for model in (MODEL, again):
        run("convert", MOTION, gait.parent / "walk.sto", "--figure", gait, "--model", model)


def test_a_changed_model_keeps_them_as_well(gait: Path):
    """Everything is then read from the model itself."""
    text = (gait.parent / "again.osim").read_text()
    changed = gait.parent / "changed.osim"
    old, new = (f'<CustomJoint name="{name}">' for name in ("knee_r", "right_knee"))
    changed.write_text(text.replace(old, new, 1))
    assert changed.read_text() != text
    said = answer("convert", changed, gait.parent / "changed.fig")
    assert said["coordinates"]["knee_angle_r"]["joint"] == "right_knee"


def test_a_free_root_has_coordinates_of_its_own(gait: Path):
    run("convert", gait, gait.parent / "free.osim", "--free-root", "--quiet")
    root = {f"pelvis_{k}" for k in range(1, 7)}
    kept = {name for name in coordinate_names_of(MODEL) if not name.startswith("pelvis_")}
    assert set(coordinate_names_of(gait.parent / "free.osim")) == root | kept


def test_a_scaled_coordinate_has_another_name(gait: Path):
    names = gait.parent / "scaled.coordinates.toml"
    figure = gait.parent / "scaled.fig"
    figure.write_bytes(gait.read_bytes())
    text = gait.with_suffix(".coordinates.toml").read_text()
    names.write_text(f"{text}scale = 2.0\n")  # of the last coordinate
    said = run("convert", figure, gait.parent / "scaled.osim", "--verbose").stdout
    assert "scaled, shifted or not plain: here they are JOINT_k: ankle_angle_l" in said
    assert "ankle_l_1" in coordinate_names_of(gait.parent / "scaled.osim")


def test_followers_are_named_in_a_cut_loss_and_refused_off_their_curves(gait: Path):
    said = run("convert", gait, gait.parent / "fitted.xml").stdout
    assert "fitted by polynomials of degree 4: knee_r 3 and knee_l 3 (0.1 " in said
    for words in (("picture", gait, "-o", gait.parent / "set.png"), ("simulate", gait)):
        refused = mover(*words, "--set", "knee_r=-30,-45.77,99")
        assert refused.exit_code != 0
        assert "displacement 3 of `knee_r` follows" in refused.output
        assert "not 99 cm" in refused.output
