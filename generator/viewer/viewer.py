"""The page: one figure, its springs and what it shows, changed by panels in one thread.

Callbacks of the page come from threads of the server. Each puts an action into a queue, and the
loop of the viewer takes them one after the other, so that panels need no locks. Of actions with the
same key only the last one is taken: a slider that moves faster than the page is drawn.
"""

import os
import sys
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from html import escape
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np

from generator.diagnostics import InputError, MoverError, format_count, select_errors
from generator.figure import Figure
from generator.kinematics.placement import Placement
from generator.motion_files.motion import FigureMotion
from generator.rotations import Array
from generator.viewer.client_page import PHONE_WIDTH
from generator.viewer.scene import (
    VIEW_ANGLE,
    VIEW_DIRECTIONS,
    FigureScene,
    camera_position,
    points_in_world,
)
from generator.viewer.server import CONTROLS_WIDTH, PageServer
from generator.viewer.surroundings import Surroundings
from springs import SpringSet

REFRESH_INTERVAL = 1.0 / 60.0
"""Shortest time between two ticks of the loop [s]."""

DEFAULT_PAGE = (1500, 900)
"""Width and height of a page until it is known [pixels]."""

Action = Callable[[], None]


class Driver(Enum):
    """The panel that moves the figure."""

    POSE = "pose"
    MOTION = "motion"
    LIVE = "live"


@dataclass(frozen=True, eq=False)
class FigureState:
    """The state of the figure that the page shows.

    Attributes:
        driver: what moves the figure.
        displacements: displacements of the joints [rad or m]; with a free root those of the
            detached figure.
        poses: poses of the segments in the world, shape (4, 4).
        time: time of the motion or the simulation [s]; None for a pose.
    """

    driver: Driver
    displacements: Mapping[str, Array]
    poses: Mapping[str, Array]
    time: float | None = None


class Panel:
    """A tab of the page. Its methods are called in the loop of the viewer."""

    title = ""

    def __init__(self, viewer: "Viewer") -> None:
        """Remember the viewer; `build` adds the controls."""
        self.viewer = viewer

    def build(self) -> None:
        """Add the controls to the tab, and the nodes to the scene."""

    def shown_changed(self, shown: FigureState) -> None:
        """Follow a change of what the page shows."""

    def springs_changed(self, springs: SpringSet) -> None:
        """Follow a change of the springs."""

    def selection_changed(self, segment: str | None, joint: str | None) -> None:
        """Follow a selection of a segment or a joint."""

    def pages_changed(self, *, is_any_open: bool) -> None:
        """Follow the first page that is opened, and the last one that is closed."""

    def tick(self, now: float) -> None:
        """Do what is due at a time of `time.monotonic` [s]."""

    def close(self) -> None:
        """Release processes and files."""


@dataclass(frozen=True)
class Content:
    """Figure, springs and state that a page begins with, and the folder of its files."""

    figure: Figure
    springs: SpringSet
    placement: Placement
    folder: Path
    motion: FigureMotion | None = None
    ghost: FigureMotion | None = None
    title: str = "mover"
    springs_choice: str | Path | None = None


class Viewer:
    """A page and its state: what it shows, the present springs, and the selected parts."""

    def __init__(
        self, server: PageServer, content: Content, panels: Sequence[Callable[["Viewer"], Panel]]
    ) -> None:
        """Draw the figure and build the panels."""
        self.server, self.content, self.springs = server, content, content.springs
        self._actions: SimpleQueue[tuple[str | None, Action]] = SimpleQueue()
        self._stopped = False
        server.notify = lambda text: self.post(lambda: self.notify("Error", text, is_error=True))
        self.segment: str | None = None
        self.joint: str | None = None
        self.scene = FigureScene(server.scene, content.figure)
        self.shown = _shown_pose(content.placement)
        self.surroundings = Surroundings(server, points_in_world(self.scene, self.shown.poses))
        self.scene.move(self.shown.poses)
        self._framed: Sequence[Mapping[str, Array]] = ()
        self._around = np.zeros((0, 3))
        self.frame_camera()
        self._views = server.gui.add_button_group("View", tuple(VIEW_DIRECTIONS))
        self.listen(self._views.on_click, lambda _: self._look(self._views.value))
        self.panels = [make(self) for make in panels]
        tabs = server.gui.add_tab_group()
        for panel in self.panels:
            with tabs.add_tab(panel.title):
                panel.build()
        self._is_any_page_open = False
        for register in (server.on_client_connect, server.on_client_disconnect):
            register(self._count_pages)
        server.on_client_connect(self._frame_new_page)
        for name, mesh in self.scene.meshes.items():
            self.listen(mesh.on_click, lambda _, name=name: self.select_segment(name))
        self.show(self.shown)

    @property
    def figure(self) -> Figure:
        """The figure."""
        return self.content.figure

    def show(self, shown: FigureState) -> None:
        """Show another state of the figure."""
        self.shown = shown
        with self.server.atomic():
            self.scene.move(shown.poses)
            for panel in self.panels:
                panel.shown_changed(shown)

    def set_springs(self, springs: SpringSet) -> None:
        """Replace the springs in all panels."""
        self.springs = springs
        for panel in self.panels:
            panel.springs_changed(springs)

    def select_segment(self, segment: str) -> None:
        """Select a segment, and the joint that carries it."""
        carrying = (
            name for name, joint in self.figure.joints.items() if joint.child.segment == segment
        )
        self._select(segment, next(carrying, self.joint))

    def select_joint(self, joint: str) -> None:
        """Select a joint, and its child."""
        self._select(self.figure.joints[joint].child.segment, joint)

    def deselect(self) -> None:
        """Select no segment; the joint stays."""
        self._select(None, self.joint)

    def _select(self, segment: str | None, joint: str | None) -> None:
        self.segment, self.joint = segment, joint
        self.scene.select(segment)
        for panel in self.panels:
            panel.selection_changed(segment, joint)

    def frame_camera(
        self,
        states: Sequence[Mapping[str, Array]] = (),
        view: str = "Free",
        around: Array | None = None,
    ) -> None:
        """Move the cameras of all pages to see the figure.

        Args:
            states: Poses in which it is seen; without any the present ones.
            view: Name of the direction, of `VIEW_DIRECTIONS`.
            around: Other points to see, shape (n, 3) [m].
        """
        self._framed, self._around = states, np.zeros((0, 3)) if around is None else around
        points = self._framed_points()
        camera = self.server.initial_camera
        camera.fov = VIEW_ANGLE
        camera.position, camera.look_at = _camera_of_page(points, *DEFAULT_PAGE, view)
        for client in self.server.get_clients().values():
            _frame_client(client, points, view)

    def _framed_points(self) -> Array:
        states = self._framed or [self.shown.poses]
        seen = [points_in_world(self.scene, poses) for poses in states]
        return np.concatenate([*seen, self._around])

    def _look(self, view: str) -> None:
        """Look from another direction, at a motion as a whole or at the present pose."""
        is_motion = self.shown.driver is Driver.MOTION
        around = self._around if self.shown.driver is Driver.LIVE else None
        self.frame_camera(self._framed if is_motion else (), view, around)

    async def _frame_new_page(self, client: Any) -> None:
        is_phone = client.camera.image_width <= PHONE_WIDTH

        async def follow_width(camera: Any) -> None:
            """Frame the figure again where the controls go below it, or beside it."""
            nonlocal is_phone
            if is_phone != (camera.image_width <= PHONE_WIDTH):
                is_phone = not is_phone
                frame()

        def frame() -> None:
            self.post(lambda: _frame_client(client, self._framed_points(), "Free"))

        client.camera.on_update(follow_width)
        frame()

    def listen(
        self,
        register: Callable[[Callable[[Any], Any]], Any],
        action: Callable[[Any], None],
        key: str | None = None,
    ) -> None:
        """Call an action with each event that a user causes at a control or a node.

        `register` is such as `slider.on_update` or `mesh.on_click`; `key` is as in `post`.
        """

        async def notify(event: Any) -> None:  # async callbacks keep the order of events
            if event.client is not None:  # the program itself set a value
                self.post(lambda: action(event), key)

        register(notify)

    async def _count_pages(self, _client: Any) -> None:
        self.post(self._follow_pages)

    def _follow_pages(self) -> None:
        is_any_open = bool(self.server.get_clients())
        if is_any_open != self._is_any_page_open:
            self._is_any_page_open = is_any_open
            for panel in self.panels:
                panel.pages_changed(is_any_open=is_any_open)

    def post(self, action: Action, key: str | None = None) -> None:
        """Add an action to the queue of the loop, from any thread.

        Of consecutive actions with one key only the last one is taken.
        """
        self._actions.put((key, action))

    def notify(self, title: str, text: str, *, is_error: bool = False) -> None:
        """Show a message in a corner of all pages."""
        for client in self.server.get_clients().values():
            client.add_notification(
                title, text, color="red" if is_error else "blue", auto_close_seconds=8.0
            )

    def tell_error(self, failure: Exception) -> None:
        """Show the sentence of an error."""
        self.notify("Error", error_text(failure, self.content.folder), is_error=True)

    def run(self) -> None:
        """Take actions and call panels until `stop`."""
        while not self._stopped:
            began = time.monotonic()
            self.run_once(began)
            pause = REFRESH_INTERVAL - (time.monotonic() - began)
            if pause > 0.0:
                time.sleep(pause)

    def run_once(self, now: float) -> None:
        """Take the actions that wait, and call the ticks of the panels."""
        for action in self._waiting():
            self._guard(action)
        for panel in self.panels:
            self._guard(lambda panel=panel: panel.tick(now))

    def _waiting(self) -> list[Action]:
        """Return the actions that wait, of those with one key in a row the last one."""
        actions: list[tuple[str | None, Action]] = []
        while True:
            try:
                key, action = self._actions.get_nowait()
            except Empty:
                return [each for _, each in actions]
            if actions and key is not None and actions[-1][0] == key:
                actions.pop()
            actions.append((key, action))

    def _guard(self, action: Action) -> None:
        """Take an action; show its error on the page instead of ending the program."""
        try:
            action()
        except MoverError as failure:
            self.tell_error(failure)
        except Exception as failure:  # a defect: the page stays, the terminal has the traceback
            traceback.print_exc(file=sys.stderr)
            self.notify("Internal error", f"{type(failure).__name__}: {failure}", is_error=True)

    def stop(self) -> None:
        """End `run` after the present tick."""
        self._stopped = True

    def close(self) -> None:
        """Close all panels."""
        for panel in self.panels:
            panel.close()


def value_in_range(control: Any) -> float:
    """Return the value of a slider or number in its range: a field sends any number typed."""
    return float(min(max(control.value, control.min), control.max))


def error_text(failure: Exception, folder: Path) -> str:
    """Return the sentence of an error; of a wrong file place, first error and hint, in one line.

    The names of files are without the folder of the page.
    """
    text = str(failure)
    if isinstance(failure, InputError):
        errors = select_errors(failure.diagnostics)
        first, hint = errors[0], errors[0].hint
        text = first.first_line.replace(f"{first.severity.value}: ", "", 1)
        text += f" ({hint})" if hint else ""
        if len(errors) > 1:
            text += f"; {format_count(len(errors) - 1, 'more error')}"
    return text.replace(f"{folder}{os.sep}", "")


def _camera_of_page(
    points: Array, width: int, height: int, view: str = "Free"
) -> tuple[Array, Array]:
    """Return `camera_position` for a page of a size [pixels]."""
    width, height = max(width, 1), max(height, 1)  # a hidden page may have no size
    covered = 0.0 if width <= PHONE_WIDTH else min(CONTROLS_WIDTH / width, 0.5)
    return camera_position(points, width / height, covered, view)


def _frame_client(client: Any, points: Array, view: str) -> None:
    """Move the camera of a page to see points, (n, 3) [m]."""
    camera = client.camera
    position, target = _camera_of_page(points, camera.image_width, camera.image_height, view)
    with client.atomic():
        camera.look_at = target  # first, since it may not be where the camera is
        camera.position = position  # moves both
        camera.look_at = target


def _shown_pose(placement: Placement) -> FigureState:
    """Return the state of a pose."""
    return FigureState(Driver.POSE, placement.displacements, placement.poses)


def html_lines(lines: Sequence[str]) -> str:
    """Return lines of text as HTML in which nothing of them is markup."""
    return (
        '<div style="font-size: 0.8em; padding: 0 1em">'
        + "<br>".join(map(escape, lines))
        + "</div>"
    )
