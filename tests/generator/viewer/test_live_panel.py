"""The tab of the live simulation: its texts, and the page while a figure falls."""

import errno
import os
import signal
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure
from generator.contact.scene import Scene, floor_height, with_floor
from generator.diagnostics import UsageError
from generator.input_files.live import LIVE_FILE, LiveStart, SetGravity, SetScales, SetSprings
from generator.input_files.pose import POSE_FILE
from generator.input_files.scene import SCENE_FILE, write_scene
from generator.kinematics.placement import initial_displacements
from generator.kinematics.tree import build_tree
from generator.model import Model
from generator.motion_files import read_action
from generator.simulation.live.live_run import replay
from generator.springs_file.edit import SpringEdit, apply_edits, springs_from_text
from generator.viewer import live_panel, live_start
from generator.viewer.live_process import LiveFrame
from generator.viewer.live_start import Preset
from generator.viewer.play_panel import PlayPanel
from generator.viewer.server import CONTROLS_WIDTH
from generator.viewer.viewer import Driver
from tests.browser import PageClient, go_to_page, node_pose
from tests.command import run
from tests.generator.viewer.conftest import content_of, type_into, wait_until
from tests.motions import clip

WAIT = 120.0
FRAME = LiveFrame(1, 90, 1.5, np.zeros((0, 3, 4)), {}, {"kinetic": 2.345}, 0.43, True, None, False)


@pytest.mark.parametrize(
    ("frame", "text"),
    [
        (None, "Not started."),
        (FRAME, "1.50 s, 0.43 x real time"),
        (replace(FRAME, rate=1.01), "1.50 s, real time"),
        (replace(FRAME, rate=None), "1.50 s"),
        (replace(FRAME, is_running=False), "1.50 s, paused"),
    ],
)
def test_the_clock_is_honest(frame, text):
    assert live_panel.clock_text(frame, is_compiling=False) == text
    assert live_panel.clock_text(frame, is_compiling=True).startswith("Compiling")


def test_texts_of_energy_and_of_the_end_of_the_process():
    assert live_panel.energy_lines({"kinetic": 2.345, "contact damping": 0.0}) == [
        "Kinetic energy 2.35 J",
        "Contact damping energy 0.00 J",
    ]
    assert "was ended by SIGKILL" in live_panel.death_text(-9)
    assert "was ended by signal 250" in live_panel.death_text(-250)
    assert "ended with code 3" in live_panel.death_text(3)
    assert "ended unexpectedly" in live_panel.death_text(None)


def test_figures_with_loops_cannot_be_simulated_live():
    for name, reason in (("fourbar", "closed loops"), ("prototype", None)):
        figure = read_figure(name)
        obstacle = live_panel.live_obstacle(Model.of(figure))
        assert (reason is None and obstacle is None) or reason in obstacle


def test_the_text_of_a_pose_holds_the_joints_of_the_figure_bit_by_bit():
    figure = read_figure("prototype")
    displacements = {
        name: np.linspace(0.1, 0.3, len(joint.chain)) / 3.0 for name, joint in figure.joints.items()
    }
    read = POSE_FILE.parse_text(
        live_start.pose_text(figure, {**displacements, "lower_torso": np.zeros(6)}), figure
    ).require_value()
    for name, joint in figure.joints.items():
        if joint.chain:
            assert np.array_equal(read[name], displacements[name])


def test_the_floor_is_below_all_points():
    points = np.array([[0.0, 0.5004, 0.0], [1.0, -0.2497, 2.0]])
    height = live_panel.floor_height(points)
    assert height == -0.255
    assert points[:, 1].min() - height >= live_panel.FLOOR_GAP


def test_pulled_points_are_in_the_segment():
    pose = np.eye(4)
    pose[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    pose[:3, 3] = 1.0, 2.0, 3.0
    point = live_panel.point_in_segment(pose, np.array([1.0, 2.5, 3.123456]))
    assert point == (0.5, 0.0, 0.12346)
    assert {type(part) for part in point} == {float}


def test_files_stay_in_the_folder(tmp_path: Path):
    assert live_panel.live_path(tmp_path, "a.live.toml") == tmp_path / "a.live.toml"
    assert live_panel.live_path(tmp_path, "a.action") == tmp_path / "a.action"
    for name in ("a.toml", "a.txt", "../a.action", "a"):
        with pytest.raises(UsageError):
            live_panel.live_path(tmp_path, name)


def start(run_viewer, figure: str = "pendulum"):
    """Start a page of a figure that hangs; return the viewer and its panel."""
    running = run_viewer(figure, (live_panel.LivePanel,))
    panel = running.viewer.panels[0]
    running.call(lambda: choose(panel, Preset.PIN))
    return running, panel


def choose(panel, preset: Preset, kind: str = live_start.PAGE_POSE) -> None:
    """Set the controls of the start."""
    panel._preset.value, panel._kind.value = preset, kind
    panel._follow_preset()


def test_a_figure_with_loops_has_no_start(run_viewer):
    _, panel = start(run_viewer, "fourbar")
    assert panel._start.disabled
    wait_until(lambda: "closed loops" in panel._clock.content)


@pytest.mark.slow
def test_a_live_simulation_is_changed_saved_and_replayed(run_viewer, open_page, tmp_path):
    running, panel = start(run_viewer, "prototype")
    page = open_page(running)
    page.get_by_text("Start", exact=True).click()
    wait_until(lambda: panel._frame is not None and panel._frame.time > 0.5, WAIT)
    type_into(page, "Stiffness factor", "2")
    wait_until(lambda: panel._stiffness.value == 2.0, WAIT)
    wait_until(lambda: panel._frame.time > 2.0, WAIT)
    page.get_by_text("Pause", exact=True).click()
    wait_until(lambda: not panel._frame.is_running, WAIT)
    frame = panel._frame
    name = next(iter(running.viewer.figure.bodies))
    pose = frame.poses_by_segment(running.viewer.figure)[name]
    wait_until(lambda: np.abs(node_pose(page, f"/figure/{name}") - pose).max() < 1e-6)
    for file in ("fall.live.toml", "fall.action"):
        type_into(page, "File", file)
        wait_until(lambda file=file: panel._file.value == file)
        page.get_by_text("Save as", exact=True).click()
        wait_until(lambda file=file: (tmp_path / file).exists(), WAIT)
        wait_until(lambda: not panel._saving, WAIT)
    log = LIVE_FILE.read(tmp_path / "fall.live.toml")
    assert [each.change for each in log.changes] == [SetScales(2.0, 1.0)]
    assert log.end_frame == frame.number
    again = tmp_path / "again.action"
    run("simulate", "--replay", tmp_path / "fall.live.toml", "-o", again)
    saved, replayed = read_action(tmp_path / "fall.action"), read_action(again)
    assert saved.times.size == frame.number + 1
    for joint, values in saved.displacements.items():
        assert np.array_equal(values, replayed.displacements[joint])
        assert np.array_equal(values[-1], frame.displacements[joint])


def test_a_name_that_is_typed_while_a_file_is_saved_stays(run_viewer, tmp_path):
    running, panel = start(run_viewer, "prototype")
    running.call(panel._take_step)
    wait_until(lambda: panel.newest is not None and panel.newest.number == 1, WAIT)

    def save_and_type() -> None:
        panel._file.value = "./first.live.toml"
        panel._save_file()
        panel._file.value = "second.action"

    running.call(save_and_type)
    wait_until((tmp_path / "first.live.toml").exists, WAIT)
    wait_until(lambda: not panel._saving, WAIT)
    assert panel._file.value == "second.action"


def test_changed_springs_go_into_the_simulation_and_its_log(run_viewer, tmp_path):
    running, panel = start(run_viewer, "prototype")
    viewer = running.viewer
    direction = viewer.springs.joints["left_knee"].axes[0].direction
    edited = apply_edits(viewer.springs, [SpringEdit("left_knee", direction, scale=3.0)])

    def step(number: int) -> None:
        running.call(panel._take_step)
        wait_until(lambda: panel.newest is not None and panel.newest.number == number, WAIT)

    step(1)
    running.call(lambda: viewer.set_springs(edited))
    step(2)
    running.call(lambda: viewer.set_springs(viewer.content.springs))
    running.call(lambda: setattr(panel._file, "value", "a.live.toml"))
    step(3)
    running.call(panel._save_file)
    wait_until((tmp_path / "a.live.toml").exists, WAIT)
    log = LIVE_FILE.read(tmp_path / "a.live.toml")
    assert [each.frame for each in log.changes] == [1, 2]
    first, second = (each.change for each in log.changes)
    assert "left_knee" in first.text
    assert second == SetSprings("")
    again = replay(viewer.figure, log, folder=tmp_path)
    assert again.springs == viewer.content.springs
    for joint, values in panel.newest.displacements.items():
        assert np.array_equal(again.displacements[joint], values)
    changed = replace(log, changes=log.changes[:1], end_frame=1)
    assert (
        replay(viewer.figure, changed, folder=tmp_path).springs.joints["left_knee"]
        == (
            springs_from_text(first.text, viewer.figure, tmp_path / "b.springs.toml").joints[
                "left_knee"
            ]
        )
    )


def test_a_pose_on_the_page_pauses_the_simulation_and_stays(run_viewer):
    running, panel = start(run_viewer)
    viewer = running.viewer
    posed = viewer.shown
    running.call(panel._toggle)
    wait_until(lambda: panel.newest is not None and panel.newest.number > 3, WAIT)
    assert viewer.shown.driver is Driver.LIVE
    running.call(lambda: viewer.show(posed))
    wait_until(lambda: not panel.newest.is_running, WAIT)
    wait_until(lambda: "Reset starts from it" in panel._clock.content)
    assert viewer.shown is posed
    number = panel.newest.number
    running.call(panel._take_step)
    wait_until(lambda: panel.newest.number == number + 1, WAIT)
    assert viewer.shown.driver is Driver.LIVE


def test_a_simulation_waits_while_no_page_is_open(run_viewer):
    running, panel = start(run_viewer)
    first, second = PageClient(running.address), PageClient(running.address)
    wait_until(lambda: len(running.server.get_clients()) == 2)
    first.set("Start", True)
    wait_until(lambda: panel.newest is not None and panel.newest.number > 3, WAIT)
    first.close()
    wait_until(lambda: len(running.server.get_clients()) == 1)
    number = panel.newest.number
    wait_until(lambda: panel.newest.number > number + 3, WAIT)
    assert panel.newest.is_running
    second.close()
    wait_until(lambda: not panel.newest.is_running, WAIT)
    number = panel.newest.number
    again = PageClient(running.address)
    wait_until(lambda: panel.newest.is_running and panel.newest.number > number + 3, WAIT)
    again.set("Start", True)  # its label is Pause by now
    wait_until(lambda: not panel.newest.is_running, WAIT)
    number = panel.newest.number
    again.close()
    wait_until(lambda: not running.server.get_clients())
    PageClient(running.address)
    wait_until(lambda: running.server.get_clients())
    running.call(lambda: None)
    assert not panel._is_running  # it was paused before, and stays so
    assert panel.newest.number == number


def test_numbers_beyond_a_slider_are_those_of_its_ends(run_viewer):
    running, panel = start(run_viewer)
    for value, gravity, scale in ((1e6, 20.0, 4.0), (-1e6, 0.0, 0.0)):
        for control in (panel._gravity, panel._stiffness, panel._damping):
            running.call(lambda control=control, value=value: setattr(control, "value", value))
        assert panel._gravity_change() == SetGravity((0.0, -gravity, 0.0))
        assert panel._scales_change() == SetScales(scale, scale)
    running.call(lambda: setattr(panel._floor, "value", True))
    running.call(lambda: setattr(panel._height, "value", -1e300))
    assert panel._floor_height() == -0.01 * live_panel.MAX_HEIGHT


def test_a_process_that_cannot_start_is_said(run_viewer, monkeypatch):
    running, panel = start(run_viewer)
    viewer = running.viewer
    told: list[str] = []
    monkeypatch.setattr(viewer, "tell_error", lambda failure: told.append(str(failure)))

    def refuse() -> None:
        raise FileNotFoundError(errno.ENOENT, "No such file or directory")

    with monkeypatch.context() as broken:
        broken.setattr(panel.process, "_start", refuse)
        viewer.post(panel._toggle)
        wait_until(lambda: told)
        assert told == ["the simulation cannot be started: no such file or directory"]
        assert panel._start.label == "Start"
        assert "Not started" in panel._clock.content
    running.call(panel._take_step)
    wait_until(lambda: panel.newest is not None and panel.newest.number == 1, WAIT)


def test_start_pauses_a_motion_that_plays_and_play_pauses_the_simulation(run_viewer, tmp_path):
    content = replace(content_of("prototype", tmp_path), motion=clip("prototype"))
    running = run_viewer(content, (PlayPanel, live_panel.LivePanel))
    viewer, (play, panel) = running.viewer, running.viewer.panels

    def is_playing() -> bool:
        return play.playback.is_playing(play.clock())

    running.call(lambda: play.playback.set_loop(True, play.clock()))
    for _ in range(2):
        running.call(play._toggle)
        wait_until(lambda: viewer.shown.driver is Driver.MOTION)
        wait_until(lambda: not panel._is_running)
        assert running.call(is_playing)
        number = 0 if panel.newest is None else panel.newest.number
        running.call(panel._toggle)
        wait_until(lambda: viewer.shown.driver is Driver.LIVE)
        wait_until(lambda n=number: panel.newest and panel.newest.number > n + 5, WAIT)
        assert not running.call(is_playing)


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="the system has no SIGSTOP")
def test_the_page_says_that_the_simulation_waits_for_a_file(run_viewer, tmp_path):
    running, panel = start(run_viewer)
    running.call(panel._take_step)
    wait_until(lambda: panel.newest is not None and panel.newest.number == 1, WAIT)
    for name, is_saved in (("a.action", True), ("missing/a.action", False)):
        os.kill(panel.process.process_id, signal.SIGSTOP)
        running.call(lambda name=name: setattr(panel._file, "value", name))
        running.call(panel._save_file)
        wait_until(lambda: "Saving a.action" in panel._clock.content)
        os.kill(panel.process.process_id, signal.SIGCONT)
        wait_until(lambda: "Saving" not in panel._clock.content, WAIT)
        assert (tmp_path / name).exists() is is_saved


@pytest.mark.slow
def test_floor_root_and_pull_in_the_page(run_viewer, open_page, tmp_path):
    running, panel = start(run_viewer, "prototype")
    page = open_page(running)
    page.get_by_text("Floor and root").click()
    page.get_by_label("Floor", exact=True).click()
    page.get_by_label("Free root").click()
    wait_until(lambda: panel._free.value and panel._floor.value)
    wait_until(lambda: floor_height(running.viewer.surroundings.scene_shown) is not None)
    page.get_by_text("Step", exact=True).click()
    wait_until(lambda: panel._frame is not None and panel._frame.number == 1, WAIT)
    assert panel._frame.has_free_root
    assert panel._frame.floor == pytest.approx(0.01 * panel._height.value)
    height = panel._frame.floor
    type_into(page, "Floor height [cm]", f"{100.0 * height + 50.0:.1f}")
    page.get_by_text("cm inside floor").first.wait_for()
    wait_until(lambda: panel._height.value == pytest.approx(100.0 * height))
    type_into(page, "Gravity [m/s2]", "0")  # so that the segment stays under the pointer
    type_into(page, "Stiffness factor", "0")
    wait_until(lambda: panel._gravity.value == panel._stiffness.value == 0.0)
    box = page.locator("canvas").first.bounding_box()
    x, y = box["x"] + 0.36 * box["width"], box["y"] + 0.45 * box["height"]
    page.get_by_text("Start", exact=True).click()
    page.keyboard.down("Shift")
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(8):
        page.mouse.move(x - 12.0 * k, y - 6.0 * k)
        page.wait_for_timeout(60)
    wait_until(lambda: panel._pulled is not None)
    wait_until(lambda: panel._frame.pulled is not None, WAIT)
    assert panel._line.visible
    page.context.close()  # the browser leaves in mid-drag
    wait_until(lambda: panel._pulled is None)
    wait_until(lambda: panel._frame.pulled is None, WAIT)
    wait_until(lambda: not panel._frame.is_running, WAIT)  # nobody sees it
    running.call(panel.close)


def test_a_person_falls_hangs_or_sits_and_others_hang(run_viewer, tmp_path):
    assert live_start.presets_of(read_figure("male50")) == tuple(Preset)
    assert live_start.presets_of(read_figure("pendulum")) == (Preset.PIN,)
    running = run_viewer("male50", (live_panel.LivePanel,))
    panel = running.viewer.panels[0]
    assert panel._preset.value == Preset.FALL
    assert panel._kind.value == "faint"
    assert panel._floor.value
    assert panel._free.value
    start = panel._choice.apply(LiveStart(), running.viewer.figure, {})
    assert start == LiveStart(fall="faint", free_root=True)
    running.call(lambda: choose(panel, Preset.PIN))
    assert not panel._kind.visible
    assert not panel._floor.value
    assert not panel._free.value


@pytest.mark.parametrize(
    ("preset", "kind"), [(Preset.FALL, live_start.PAGE_POSE), (Preset.SIT, "")]
)
def test_a_start_from_a_pose_is_on_a_floor(preset: Preset, kind: str):
    figure = read_figure("male50")
    shown = initial_displacements(build_tree(figure))
    shown["left_knee"] = np.array([0.3])
    choice = live_start.StartChoice(preset, height=0.1)
    start = choice.apply(LiveStart(), figure, shown)
    assert (start.fall, start.free_root) == ("", True)
    assert start.height == (0.1 if preset is Preset.FALL else 0.0)
    scene = SCENE_FILE.parse_text(start.scene).require_value()
    assert floor_height(scene) == 0.0
    assert len(scene.props) == (1 if preset is Preset.FALL else 3)
    pose = POSE_FILE.parse_text(start.pose, figure).require_value()
    knee = 0.3 if preset is Preset.FALL else np.radians(100.0)  # its chair is tilted by 10 deg
    assert pose["left_knee"][0] == pytest.approx(knee)


def test_scenes_of_the_folder_and_shipped_ones_can_be_chosen(tmp_path: Path):
    (tmp_path / "my.scene.toml").write_text(write_scene(Scene.floor()), encoding="utf-8")
    names = live_start.scene_names(tmp_path)
    assert names[:2] == (live_start.NO_PROPS, "my.scene.toml")
    assert "stairs" in names
    assert live_start.chosen_scene(tmp_path, "my.scene.toml") == Scene.floor()
    assert live_start.chosen_scene(tmp_path, live_start.NO_PROPS) == Scene()
    assert live_start.chosen_scene(tmp_path, "stairs").props
    with pytest.raises(UsageError):
        live_start.chosen_scene(tmp_path, "moon")
    own = live_start.StartChoice(Preset.FALL, scene=with_floor(Scene(), 0.5))
    start = own.apply(LiveStart(), read_figure("male50"), {})
    assert floor_height(SCENE_FILE.parse_text(start.scene).require_value()) == 0.5


def body_columns(page, limit: float) -> np.ndarray:
    """Columns of the window, left of a limit, in which the blue clothes of a person are seen."""
    from PIL import Image

    shot = np.asarray(Image.open(BytesIO(page.screenshot())).convert("RGB")).astype(int)
    red, blue = shot[..., 0], shot[..., 2]
    is_body = (blue > 1.6 * red) & (blue > 60) & (blue < 190)
    return np.flatnonzero(is_body[:, : int(limit)].sum(axis=0) > 3)


def is_seen(page, name: str) -> bool:
    """Return whether a node of the page is shown."""
    return page.evaluate("name => window.__viserMutable?.nodeRefFromName?.[name]?.visible", name)


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), [(1366, 768), (768, 1024), (390, 844)])
def test_the_body_is_seen_beside_the_panel(run_viewer, browser, width: int, height: int):
    running = run_viewer("male50")
    context = browser.new_context(viewport={"width": width, "height": height})
    page = context.new_page()
    said: list[str] = []
    page.on("pageerror", lambda failure: said.append(str(failure)))
    page.on("console", lambda one: said.append(one.text) if one.type == "error" else None)
    go_to_page(page, running.address)
    wait_until(lambda: is_seen(page, "/figure"))
    page.get_by_role("tab", name="Live").click()
    page.wait_for_timeout(2000)
    panel = page.get_by_role("tablist").bounding_box()
    if width >= 768:
        columns = body_columns(page, panel["x"] - 10.0)
        assert columns.max() < panel["x"] - 20.0
    else:  # the figure is above the panel, which is as wide as the page
        wait_until(lambda: abs(body_columns(page, width).mean() / width - 0.5) < 0.2)
        columns = body_columns(page, width)
        assert panel["x"] < 10.0
        assert panel["width"] > width - 40.0
        canvas = page.locator("canvas").first.bounding_box()
        assert canvas["height"] == pytest.approx(0.5 * height, abs=2.0)
    assert len(columns) > 30
    start = page.get_by_role("button", name="Start", exact=True).bounding_box()
    assert start["x"] >= 0.0
    assert start["x"] + start["width"] <= width
    assert start["y"] + start["height"] <= height
    context.close()
    assert said == []


@pytest.mark.slow
def test_the_tab_stays_when_the_window_becomes_narrow(run_viewer, open_page):
    """And when it becomes wide again; the figure is framed anew for the room that it has."""
    running = run_viewer("male50")
    page = open_page(running)
    said: list[str] = []
    page.on("pageerror", lambda failure: said.append(str(failure)))

    def selected() -> list[str]:
        tabs = page.get_by_role("tab", selected=True)
        return [text.strip() for text in tabs.all_inner_texts()]

    page.get_by_role("tab", name="Curve").click()
    page.get_by_role("tab", name="Live").click()
    for width, height in ((390, 844), (768, 1024), (390, 844), (1366, 768)):
        page.set_viewport_size({"width": width, "height": height})
        wait_until(lambda: selected() == ["Live"], 20.0)
        page.wait_for_timeout(2000)
        assert selected() == ["Live"]
        assert page.get_by_role("button", name="Start", exact=True).is_visible()
        columns = body_columns(page, width)
        middle = 0.5 * float(columns.min() + columns.max())
        free = width if width < 576 else width - CONTROLS_WIDTH
        assert 0.3 * free < middle < 0.7 * free
    page.get_by_role("tab", name="Body").focus()
    page.keyboard.press("Enter")
    page.set_viewport_size({"width": 390, "height": 844})
    wait_until(lambda: selected() == ["Body"], 20.0)

    # A double click on a segment opens its sliders, a single one selects it.
    middle = page.viewport_size["width"] // 2
    page.wait_for_timeout(2000)
    page.mouse.dblclick(5, 5)
    page.mouse.click(middle, 200)
    wait_until(lambda: running.viewer.segment is not None, 20.0)
    assert selected() == ["Body"]
    page.mouse.dblclick(middle, 200)
    wait_until(lambda: selected() == ["Pose"], 20.0)
    assert said == []


@pytest.mark.slow
def test_presets_in_the_page(run_viewer, open_page):
    """A fall has props and arrows, a hanging figure its bar, and both are seen from the side."""
    running = run_viewer("male50", (live_panel.LivePanel,))
    panel = running.viewer.panels[0]
    page = open_page(running)

    def begin(preset: Preset, kind: str = "") -> None:
        running.call(lambda: (choose(panel, preset, kind or "faint"), panel.reset()))
        wait_until(lambda: panel.newest is not None, WAIT)

    begin(Preset.FALL, "stairs")
    wait_until(lambda: is_seen(page, "/props/1"), WAIT)
    begin(Preset.FALL, "faint")
    running.call(panel._toggle)
    wait_until(lambda: is_seen(page, "/live_forces"), WAIT)
    wait_until(lambda: not is_seen(page, "/props/1"), WAIT)
    assert not is_seen(page, "/live_pin/0")
    running.call(panel._toggle)
    begin(Preset.PIN)
    wait_until(lambda: is_seen(page, "/live_pin/0"), WAIT)
    wait_until(lambda: not is_seen(page, "/live_forces"), WAIT)
    page.wait_for_timeout(2000)
    wide = len(body_columns(page, 800.0))
    page.get_by_role("button", name="Side", exact=True).click()
    page.wait_for_timeout(2000)
    assert 0 < len(body_columns(page, 800.0)) < 0.9 * wide
    begin(Preset.SIT)
    wait_until(lambda: is_seen(page, "/props/2"), WAIT)
    wait_until(lambda: not is_seen(page, "/live_pin/0"), WAIT)
    running.call(panel.close)
