"""Commands, files and code of the tutorials, run in an empty folder as they are printed."""

import json
import re
import shlex
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass, field, replace
from io import StringIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from typer.testing import CliRunner

from generator import read_figure, read_npz, read_springs
from generator.cli.app import app
from generator.viewer.curve_editor import CurveEditor
from tests.paths import DOCS, ROOT

BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# ([\w.]+\.\w+)\n")


@dataclass
class Reader:
    """Somebody who does what a page says: saves its files, types its commands, runs its code."""

    page: str
    names: dict[str, Any] = field(default_factory=dict)
    answers: list[str] = field(default_factory=list)
    shown: list[str] = field(default_factory=list)

    def follow(self) -> None:
        for language, text in BLOCK.findall(self.page):
            if language == "sh":
                for line in text.splitlines():
                    self.type(line)
            elif language == "python":
                with redirect_stdout(StringIO()) as printed:
                    exec(compile(text, "page", "exec"), self.names)
                self.answers.append(printed.getvalue())
            elif found := FILE.match(text):
                Path(found[1]).write_text(text, encoding="utf-8")
            else:
                self.shown.append(text)

    def type(self, line: str) -> str:
        program, *words = shlex.split(line)
        assert program == "mover", line
        result = CliRunner().invoke(app, words)
        self.answers.append(result.output)
        assert result.exit_code == 0, f"{line}\n{result.output}"
        return result.output


@pytest.fixture
def reader(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Reader]:
    monkeypatch.chdir(tmp_path)
    page = Reader((DOCS / f"{request.param}.md").read_text(encoding="utf-8"))
    with mpl.rc_context():
        page.follow()
        yield page


@pytest.mark.parametrize("reader", ["tutorials/first-figure"], indirect=True)
def test_my_first_figure(reader: Reader) -> None:
    for suffix in ("action", "glb", "csv"):
        assert Path(f"swing.{suffix}").stat().st_size > 0
    assert read_figure("rod.fig") == reader.names["pendulum"]
    assert reader.names["elbow"][0] == pytest.approx(10.0)
    missing, made_in_python = reader.shown
    wrong = Path("arm.fig").read_text().replace("connect upper_arm", "connect uper_arm")
    Path("wrong.fig").write_text(wrong)
    assert missing in CliRunner().invoke(app, ["check", "wrong.fig"]).output
    assert made_in_python in reader.answers


@pytest.mark.slow
@pytest.mark.parametrize("reader", ["tutorials/measured-limb"], indirect=True)
def test_from_measured_moments_to_an_animation(reader: Reader) -> None:
    springs = Path("limb.springs.toml").read_text()
    assert "viscous_Nms_rad = 0.2\n" in springs
    (printed,) = reader.shown
    first, *others = printed.splitlines()
    assert re.search(re.escape(first).replace(r"\.\.\.", r"\d+"), springs)
    assert all(line in reader.page for line in others)
    assert all(line in springs for line in others)
    _, recording = read_npz("limb.npz")
    settled = re.search(r"^elbow +([\d.]+) deg", "".join(reader.answers), re.MULTILINE)
    assert settled is not None
    last = np.degrees(recording.displacements["elbow"][-1, 0])
    assert last == pytest.approx(float(settled[1]), abs=1.0)
    for name in ("limb.glb", "limb.bvh", "limb.mot", "fall.glb", "torque.png"):
        assert Path(name).stat().st_size > 0


@pytest.mark.parametrize("reader", ["tutorials/own-exudyn-system"], indirect=True)
def test_your_own_exudyn_system(reader: Reader) -> None:
    names = reader.names
    assert names["tension"].max() > 3.0 * 9.81
    assert names["angle"][0] == pytest.approx(0.5)
    assert names["free"] == pytest.approx(20.0, abs=1.0)
    assert np.degrees(names["angle"][-1]) < names["free"] - 3.0
    assert names["left"].bodies != names["right"].bodies


@pytest.mark.slow
@pytest.mark.parametrize("reader", ["tutorials/stiff-elbow"], indirect=True)
def test_why_my_elbow_does_not_bend(reader: Reader) -> None:
    names, (command,) = reader.names, reader.shown
    assert command == "mover view arms.springs.toml\n"
    stiff, mended = (
        np.degrees(np.abs(names[name].displacements["left_elbow"])).max()
        for name in ("stiff", "mended")
    )
    assert f"bend by {stiff:.0f} deg at most" in reader.page
    assert f"bends by {mended:.0f} deg" in reader.page
    doubt = re.search(r"^    (doubt .*) \.\.\.$", reader.page, re.MULTILINE)
    assert doubt is not None
    assert doubt[1] in "".join(reader.answers)
    figure, choice = read_figure("prototype"), "arms.springs.toml"
    editor = CurveEditor(figure, read_springs(choice, figure), Path.cwd(), choice)
    key = ("left_elbow", editor.motions("left_elbow")["flexion"])
    editor.change(replace(editor.edit(key), stiffness=2.3), both_sides=True)
    saved = Path("mended.springs.toml")
    assert saved.read_text().partition("\n")[2] == editor.text(saved).rstrip("\n") + "\n"
    assert b"<html" in Path("mended.html").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("reader", ["tutorials/pendulum-test"], indirect=True)
def test_the_springs_of_a_knee_from_its_swing(reader: Reader) -> None:
    answers = [line.split() for line in "".join(reader.answers).splitlines()]
    results = BLOCK.sub("", reader.page.partition("## Numbers")[2])
    rows = [row.split() for row in re.findall(r"^ {4}(.*)$", results, re.MULTILINE)]
    assert len(rows) == 13
    assert [row for row in rows if row not in answers] == []
    places = [(row, row.index("..")) for row in rows if row[0].startswith("springs.knee.")]
    intervals = [(row[place - 1], row[place + 1]) for row, place in places]
    for (low, high), true in zip(intervals, (1.3, -4.0, 0.35), strict=True):
        assert float(low) < true < float(high)
    rms = reader.names["rms"]
    assert rms["fitted.springs.toml"] == pytest.approx(0.5, abs=0.04)
    assert rms[None] > 5.0
    for name in ("fitted.springs.toml", "fit.png", "swing.csv"):
        assert Path(name).stat().st_size > 0


@pytest.fixture
def other_programs() -> None:
    pytest.importorskip("opensim").Logger.removeFileSink()
    pytest.importorskip("mujoco")


@pytest.mark.verify
@pytest.mark.usefixtures("other_programs")
@pytest.mark.parametrize("reader", ["tutorials/opensim-mujoco"], indirect=True)
def test_your_passive_curves_in_opensim_and_mujoco(reader: Reader) -> None:
    (measured,) = re.findall(r"points_deg_Nm = (.*)", reader.page)
    points = dict(json.loads(measured))
    for printed in (answer for answer in reader.answers if " deg: " in answer):
        for angle, moment in re.findall(r"^(\d+) deg: (\S+) N m$", printed, re.MULTILINE):
            assert float(moment) == pytest.approx(points[int(angle)], abs=1e-3)
    assert "".join(reader.answers).count("130 deg: -9.000 N m") == 2
    assert "Our measurements of March" in reader.answers[-1]
    counts = [
        Path(name).read_text().count("<ExpressionBasedCoordinateForce ")
        for name in ("body.osim", "mine.osim")
    ]
    assert counts == [19, 20]


@pytest.fixture
def mujoco_and_gymnasium() -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("gymnasium")


@pytest.mark.verify
@pytest.mark.slow
@pytest.mark.usefixtures("mujoco_and_gymnasium")
@pytest.mark.parametrize("reader", ["mujoco"], indirect=True)
def test_your_passive_human_in_mujoco_and_gymnasium(reader: Reader) -> None:
    from gymnasium.utils.env_checker import check_env

    answers, names = "".join(reader.answers), reader.names
    assert re.search(r"centre of mass 0\.1\d m above the floor", answers)
    assert "51 frames, the last one of 1 s" in answers
    down = re.search(r"down after (\S+) s", answers)
    assert down is not None
    assert 0.3 < float(down[1]) < 0.6
    check_env(names["env"], skip_render_check=True)
    assert [names["model"].joint(name).type[0] for name in ("left_shoulder", "left_knee")] == [1, 3]
    assert sum(one.number for one in names["env"].data.warning) == 0


@pytest.mark.verify
@pytest.mark.slow
def test_your_passive_human_in_mjx(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Minutes of compilation, where MJX is installed; the extra `verify` does not have it."""
    pytest.importorskip("mujoco.mjx")
    mujoco = pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["convert", "male50", "body.xml", "--floor"]).exit_code == 0
    page = (DOCS / "mujoco.md").read_text(encoding="utf-8")
    (code,) = (text for language, text in BLOCK.findall(page) if language == "py")
    names: dict[str, Any] = {}
    exec(compile(code, "mujoco.md", "exec"), names)
    model, data = names["mj_model"], names["mj_data"]
    for _ in range(100):
        mujoco.mj_step(model, data)
    assert np.abs(np.asarray(names["data"].qpos) - data.qpos).max() < 3e-3


@pytest.mark.parametrize("reader", ["figure-language", "api"], indirect=True)
def test_pages_with_code(reader: Reader) -> None:
    assert reader.names["read_figure"] is read_figure


@pytest.mark.slow
@pytest.mark.parametrize("reader", ["simulation"], indirect=True)
def test_the_stepper_of_the_page(reader: Reader) -> None:
    stepper, names = reader.names["stepper"], reader.names
    assert names["outcome"].succeeded
    assert stepper.time == names["saved"].time == pytest.approx(0.25)
    assert stepper.locked == ("right_elbow",)
    assert names["angle"] != 0.0
    assert Path("rest.pose").stat().st_size > 0


def test_the_code_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (code,) = re.findall(
        r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(), re.MULTILINE | re.DOTALL
    )
    assert code.count("\n") <= 10
    names: dict[str, Any] = {}
    exec(compile(code.replace("stop=2.0", "stop=0.04"), "README.md", "exec"), names)
    assert names["recording"].outcome.succeeded
    assert Path("fall.glb").stat().st_size > 0


@pytest.mark.parametrize("reader", ["tutorials/passive-hip"], indirect=True)
def test_how_much_of_my_hips_work_is_passive(reader: Reader) -> None:
    answers = [line.split() for line in "".join(reader.answers).splitlines()]
    rows = [
        row.split() for row in re.findall(r"^ {4}(.*)$", BLOCK.sub("", reader.page), re.MULTILINE)
    ]
    assert len(rows) == 8
    assert [row for row in rows if row not in answers] == []
    assert float(reader.names["best"]["hip_flexion_r net power [W]"]) > 50.0
