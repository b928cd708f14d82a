"""The tab that plays motions."""

from dataclasses import replace

import numpy as np
import pytest

from generator.motion_files import motion_writer
from generator.rotations import quaternion_from_matrix
from generator.viewer.play_panel import NEXT, NO_SITE, PlayPanel
from generator.viewer.scene import node_name
from generator.viewer.viewer import Driver, FigureState
from tests.contacts import with_contact
from tests.generator.viewer.conftest import content_of, wait_until
from tests.motions import any_motion, clip, shipped


@pytest.fixture
def play(run_viewer, tmp_path):
    """Start a page of a motion; return the viewer and its panel."""

    def start(motion, ghost=None, figure="prototype"):
        content = replace(content_of(figure, tmp_path), motion=motion, ghost=ghost)
        running = run_viewer(content, (PlayPanel,))
        return running, running.viewer.panels[0]

    return start


def placed(page, motion, frame: int, root: str = "figure") -> bool:
    """Return whether the nodes of all segments of the page have the poses of a frame, to 1e-6."""
    places = page.evaluate(
        """([root, names]) => names.map(name => {
            const node = window.__viserMutable?.nodeRefFromName?.[name];
            return node ? [...node.position.toArray(), ...node.quaternion.toArray()] : null; })""",
        [root, [node_name(segment, root) for segment in motion.figure.bodies]],
    )
    if None in places:
        return False
    poses = np.array([motion.poses[segment][frame] for segment in motion.figure.bodies])
    w_last = np.roll(quaternion_from_matrix(poses[:, :3, :3]), -1, axis=1)
    expected = np.hstack([poses[:, :3, 3], w_last])
    return bool(np.abs(np.array(places) - expected).max() < 1e-6)


def test_the_page_plays_to_the_end(play, open_page):
    motion = clip("flying")
    running, _ = play(motion)
    page = open_page(running)
    wait_until(lambda: placed(page, motion, 0))
    page.get_by_role("button", name="Play", exact=True).click()
    wait_until(lambda: placed(page, motion, -1))
    assert running.viewer.shown.driver is Driver.MOTION
    assert running.viewer.shown.time == motion.times[-1]
    wait_until(lambda: page.get_by_role("button", name="Play", exact=True).is_visible())


def test_a_slider_that_moves_on_is_not_set_back(play):
    running, panel = play(clip("prototype"))

    def move_twice() -> None:
        panel._slider.value = 5
        panel._scrub()
        panel._slider.value = 6  # the event of this value is still in the queue
        panel.tick(panel.clock())

    running.call(move_twice)
    assert panel._slider.value == 6


@pytest.mark.slow
def test_the_slider_scrubs(play, open_page):
    motion = clip("prototype")
    running, panel = play(motion, ghost=clip("flying"))
    page = open_page(running)
    wait_until(lambda: placed(page, motion, 0))
    thumb = page.get_by_role("slider").first
    thumb.focus()
    for _ in range(7):
        thumb.press("ArrowRight")
    wait_until(lambda: placed(page, motion, 7))
    assert placed(page, clip("flying"), 7, "ghost")
    page.get_by_role("button", name="Next", exact=True).click()
    wait_until(lambda: placed(page, motion, 8))
    assert panel._readout.value.startswith(f"{motion.times[8]:.3f} s")


def test_a_motion_appears_at_once(play):
    motion = clip("prototype")
    running, _ = play(motion)
    wait_until(lambda: running.viewer.shown.driver is Driver.MOTION)
    assert running.viewer.shown.time == motion.times[0]


def test_another_driver_pauses(play):
    running, panel = play(clip("prototype"))
    viewer = running.viewer
    running.call(panel._toggle)
    running.call(lambda: panel.playback.set_speed(0.05, panel.clock()))
    wait_until(lambda: panel._play.label == "Pause")
    pose = viewer.content.placement
    running.call(lambda: viewer.show(FigureState(Driver.POSE, pose.displacements, pose.poses)))
    running.call(lambda: None)  # after another tick
    assert not panel.playback.is_playing(panel.clock())
    assert viewer.shown.driver is Driver.POSE
    assert panel._play.label == "Play"
    running.call(lambda: panel._go(NEXT))
    wait_until(lambda: viewer.shown.driver is Driver.MOTION)


def test_one_frame_can_be_shown(play):
    motion = any_motion(shipped("prototype"), np.array([0.3]))
    running, panel = play(motion)
    running.call(panel._toggle)
    wait_until(lambda: running.viewer.shown.time == 0.3)
    running.call(lambda: panel._go(NEXT))
    assert running.viewer.shown.time == 0.3


def test_a_hundred_thousand_frames_are_played(play):
    count = 100_000
    motion = any_motion(shipped("prototype"), np.arange(count) * 1e-3)
    running, panel = play(motion)

    def trace():
        panel._site.value = panel._site.options[1]
        panel._trace()

    running.call(trace)

    def scrub():
        panel._slider.value = count - 1
        panel._scrub()

    running.call(scrub)
    wait_until(lambda: running.viewer.shown.time == motion.times[-1])
    for segment, pose in running.viewer.shown.poses.items():
        last = {name: rows[-1:] for name, rows in motion.displacements.items()}
        alone = replace(motion, times=motion.times[-1:], displacements=last)
        assert np.abs(pose - alone.poses[segment][0]).max() < 1e-12


def test_the_path_of_a_site_grows(play):
    motion = clip("prototype")
    running, panel = play(motion)
    site = next(each for each in panel._site.options if each != NO_SITE)

    def choose():
        panel._site.value, panel._whole_path.value = site, False
        panel._trace()

    running.call(choose)
    assert panel._path is None
    running.call(lambda: panel.playback.step(9, panel.clock()))
    wait_until(lambda: panel._path is not None and len(panel._path.points) == 9)

    def choose_whole():
        panel._whole_path.value = True
        panel._draw_path()

    running.call(choose_whole)
    wait_until(lambda: len(panel._path.points) == len(motion.times) - 1)


def test_the_curves_are_those_of_the_selected_joint(play):
    running, panel = play(clip("prototype"))
    running.call(lambda: running.viewer.select_joint("left_knee"))
    assert panel._joint.value == "Left knee"
    titles = [chart.title for chart in panel.charts]
    assert titles == ["Left knee angle [deg]", "Left knee passive moment [N m]", "Energy [J]"]


def test_moments_without_a_run_are_computed(play):
    running, panel = play(replace(clip("prototype"), recording=None))
    running.call(lambda: running.viewer.select_joint("left_knee"))
    title = "Left knee elastic moment [N m]"
    wait_until(lambda: [chart.title for chart in panel.charts][1:] == [title])


def test_moments_follow_changed_springs(play):
    running, panel = play(replace(clip("prototype"), recording=None))
    running.call(lambda: running.viewer.select_joint("left_hip_joint"))

    def moments():
        return panel.charts[-1]._chart.curves if len(panel.charts) == 2 else ()

    before = wait_until(moments)
    springs = running.viewer.springs
    for factor in (5.0, 4.0, 3.0, 2.0):
        running.call(lambda factor=factor: running.viewer.set_springs(springs.scaled(factor, 1.0)))
    for (_, values), k in zip(before, range(3), strict=True):
        doubled = 2.0 * values
        wait_until(lambda k=k, doubled=doubled: moments() and np.allclose(moments()[k][1], doubled))


def test_motions_of_the_folder_are_loaded(run_viewer, tmp_path):
    motion = clip("prototype")
    motion_writer(tmp_path / "hang.action")(motion, tmp_path / "hang.action")
    running = run_viewer(content_of("prototype", tmp_path), (PlayPanel,))
    panel = running.viewer.panels[0]
    assert panel._file.options == ("hang.action",)
    running.call(lambda: panel._read(panel.load))
    wait_until(lambda: panel.frames is not None)
    assert panel.frames.count == len(motion.times)
    running.call(lambda: panel._read(panel.load_ghost))
    wait_until(lambda: panel.ghost is not None)


def test_a_table_of_opensim_is_loaded_and_columns_that_are_left_out_are_told(
    run_viewer, tmp_path, monkeypatch
):
    text = "inDegrees=yes\nendheader\ntime left_knee_1 load\n0 10 1\n1 20 2\n"
    (tmp_path / "ik.mot").write_text(text)
    running = run_viewer(content_of("prototype", tmp_path), (PlayPanel,))
    panel, messages = running.viewer.panels[0], []
    monkeypatch.setattr(running.viewer, "notify", lambda *words: messages.append(words))
    assert panel._file.options == ("ik.mot",)
    running.call(lambda: panel._read(panel.load))
    wait_until(lambda: len(messages) == 2)
    assert {title for title, _ in messages} == {"ik.mot"}
    assert any(text.endswith("are left out: load.") for _, text in messages)
    assert panel.frames.count == 2


def test_bad_files_of_the_folder_are_reported(run_viewer, tmp_path, monkeypatch):
    (tmp_path / "bad.action").write_text("action 1\n")
    (tmp_path / "other.action").write_text("")
    motion_writer(tmp_path / "other.action")(clip("fourbar"), tmp_path / "other.action")
    running = run_viewer(content_of("prototype", tmp_path), (PlayPanel,))
    panel, errors = running.viewer.panels[0], []
    monkeypatch.setattr(running.viewer, "tell_error", errors.append)
    running.call(lambda: panel._read(panel.load))
    wait_until(lambda: len(errors) == 1)
    assert "bad.action" in str(errors[0])
    panel._file.value = "other.action"
    running.call(lambda: panel._read(panel.load))
    wait_until(lambda: len(errors) == 2)
    assert "unknown to the figure" in str(errors[1])
    assert panel.frames is None


def test_names_are_never_markup(play):
    header = replace(clip("prototype").header, message="<img src=x onerror=alert(1)>")
    _, panel = play(replace(clip("prototype"), header=header))
    assert "<img" not in panel._summary.content
    assert "&lt;img" in panel._summary.content


SHOWN = "name => Boolean(window.__viserMutable?.nodeRefFromName?.[name])"


@pytest.mark.slow
def test_props_and_forces_of_a_run_are_drawn(play, open_page):
    """Until the forces are switched off; another panel hides them, and leaves the props."""
    motion = with_contact(clip("prototype"))
    running, panel = play(motion)
    page = open_page(running)
    wait_until(lambda: page.evaluate(SHOWN, "/props/1"))
    assert page.evaluate(SHOWN, "/props/2")
    assert not page.evaluate(SHOWN, "/contact_forces")  # nothing touches at the first frame
    assert "Arrow of 10 cm: 200 N" in panel._force_scale.content
    running.call(lambda: panel._go(NEXT))
    wait_until(lambda: page.evaluate(SHOWN, "/contact_forces"))
    page.get_by_label("Contact forces").uncheck()
    wait_until(lambda: not page.evaluate(SHOWN, "/contact_forces"))
    page.get_by_label("Contact forces").check()
    wait_until(lambda: page.evaluate(SHOWN, "/contact_forces"))
    state = running.viewer.shown
    running.call(lambda: running.viewer.show(replace(state, driver=Driver.POSE, time=None)))
    wait_until(lambda: not page.evaluate(SHOWN, "/contact_forces"))
    assert page.evaluate(SHOWN, "/props/1")
