"""A held posture as a picture (SVG), and as a page with its tables on which loads are dragged."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from math import isfinite
from typing import Any

import numpy as np

from generator.figure import Figure
from generator.geometry.read import read_segment_surface
from generator.hold.posture import JointDemand, Posture
from generator.hold.statics import site_point
from generator.kinematics.placement import site_pose
from generator.kinematics.stability import stability
from generator.motion_files.page import fill_page, script_json
from generator.rotations import Array

SCALE = 230.0
"""Pixels per metre."""

_MARGIN = 46.0
_LABELLED_USE = 0.2
"""Use from which a joint has a number in the picture."""

_SHORTEST_ARROW, _LONGEST_ARROW = 0.08, 0.5
"""Lengths of the arrow of a load [m]."""

_FIELD_CREDIT = (
    "Numbers of the Arm Force Field: copyright Nicholas J. La Delfa and Jim R. Potvin 2025, "
    "Creative Commons Attribution 4.0 (CC-BY-4.0), unchanged; the code that reads them is another."
)

_CHARACTER = 7.0
"""Width of a character of a label, at most [px]."""

_JOINT_RIM = 7.0 * np.array(
    [(np.cos(turn), np.sin(turn)) for turn in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)]
)
"""Points on the rim of the circle of a joint [px]."""

_GRID = np.array([(k % 7, k // 7) for k in range(49)]) / 6.0
"""Points over the area of a label, of unit size."""

_COLOURS = ((0.0, (44, 123, 182)), (0.5, (255, 255, 191)), (1.0, (215, 25, 28)))
_BEYOND = "#7f0000"
_UNKNOWN = "#bbbbbb"


@dataclass(frozen=True)
class View:
    """A view of a posture.

    Attributes:
        title: Title.
        right: Axis of the world to the right, shape (3,).
        towards: Axis of the world towards the viewer, shape (3,).
        x: Place of the world's origin [px].
        y: Place of the world's origin [px].
        width: Width with margins [px].
        height: Height with margins [px].
    """

    title: str
    right: Array
    towards: Array
    x: float
    y: float
    width: float
    height: float

    def place(self, point: Array) -> tuple[float, float]:
        """Return where a point of the world, shape (3,) [m], is drawn [px]."""
        x = self.x + SCALE * float(point @ self.right)
        return round(x, 1), round(self.y - SCALE * float(point[1]), 1)


def _views(posture: Posture, outlines: Mapping[str, Array], reach: float) -> Iterator[View]:
    """Yield the views of a posture with its loads, and with arrows of a length at these [m]."""
    ends = np.concatenate([np.zeros((0, 3)), *(ends for ends in _load_ends(posture))])
    around = [ends + sign * reach for sign in (-1.0, 1.0)]
    every = np.concatenate([*outlines.values(), *around])
    low, high = every.min(axis=0), every.max(axis=0)
    height = SCALE * (high[1] - low[1]) + 2.0 * _MARGIN
    for title, right, towards in (
        ("from the front", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        ("from the right", (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)),
    ):
        axis = np.array(right)
        start, end = float(low @ axis), float(high @ axis)
        yield View(
            title,
            axis,
            np.array(towards),
            _MARGIN - SCALE * start,
            _MARGIN + SCALE * float(high[1]),
            SCALE * (end - start) + 2.0 * _MARGIN,
            height,
        )


def use_colour(use: float | None) -> str:
    """Return the colour of a use: blue at 0, yellow at a half, red at 1, dark red beyond."""
    if use is None:
        return _UNKNOWN
    if not isfinite(use) or use > 1.0:
        return _BEYOND
    places = [place for place, _ in _COLOURS]
    channels = [np.interp(use, places, [colour[k] for _, colour in _COLOURS]) for k in range(3)]
    return "#" + "".join(f"{round(float(channel)):02x}" for channel in channels)


def _ink(use: float) -> str:
    """Return the colour of text on the colour of a use."""
    return "#fff" if abs(use - 0.5) > 0.4 else "#000"


def joint_uses(posture: Posture) -> dict[str, JointDemand]:
    """Return the demand with the largest use of each joint; one without a use for others."""
    found: dict[str, JointDemand] = {}
    for one in posture.joints:
        if one.joint not in found or (one.use or 0.0) > (found[one.joint].use or 0.0):
            found[one.joint] = one
    return found


def posture_svg(posture: Posture) -> str:
    """Return a picture of a posture from the front and from the right, joints coloured by use.

    Raises InputError when a psurf cannot be read.
    """
    outlines = _segment_points(posture)
    parts, left, height = list[str](), 0.0, 0.0
    for view in _views(posture, outlines, 0.0):
        parts += _draw(posture, outlines, replace(view, x=view.x + left), left)
        left, height = left + view.width, view.height
    return _svg("\n".join(parts), left, height)


def page_views(posture: Posture) -> tuple[tuple[View, ...], str]:
    """Return the views of a page in which loads are dragged, and a picture of each.

    Raises InputError when a psurf cannot be read.
    """
    outlines = _segment_points(posture)
    views = tuple(_views(posture, outlines, _LONGEST_ARROW))
    return views, "".join(
        _svg(
            "\n".join(_draw(posture, outlines, view, 0.0, is_page=True)),
            view.width,
            view.height,
            f' class="view" role="img" aria-label="The posture {view.title}"',
        )
        for view in views
    )


def _svg(content: str, width: float, height: float, attributes: str = "") -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="sans-serif" font-size="11"'
        f'{attributes}>\n<rect width="100%" height="100%" fill="white"/>\n{content}\n</svg>\n'
    )


def _draw(
    posture: Posture,
    outlines: Mapping[str, Array],
    view: View,
    left: float,
    *,
    is_page: bool = False,
) -> list[str]:
    """Return the elements of a view, the farthest segment first.

    Those of a page have labels of all joints, hidden below `_LABELLED_USE`.
    """
    parts: list[str] = []
    towards, place = view.towards, view.place
    for points in sorted(outlines.values(), key=lambda each: float((each @ towards).mean())):
        flat = np.array([[*place(point), 0.0] for point in points])
        corners = stability(flat.mean(axis=0), flat, (0.0, 0.0, 1.0)).corners[:, :2]
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in corners)
        parts.append(f'<polygon points="{text}" fill="#e6e6e6" stroke="#9a9a9a"/>')
    if posture.standing is not None:
        x, y = place(posture.standing.centre_of_pressure)
        parts.append(
            f'<path class="pressure" d="M{x},{y} l-6,10 h12 z" fill="#333333">'
            "<title>centre of pressure</title></path>"
        )
    taken: list[Array] = []
    arrows, radius = list[str](), 7.0 if is_page else 3.5
    ends = enumerate(zip(posture.loads, _load_ends(posture), strict=True))
    for k, (load, (start, end)) in sorted(ends, key=lambda item: float(item[1][1][0] @ towards)):
        (x1, y1), (x2, y2) = place(start), place(end)
        size = float(np.linalg.norm(load.total))
        arrows.append(
            f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="#333333" stroke-width="2.5"/>'
            f'<circle data-load="{k}" cx="{x2}" cy="{y2}" r="{radius}" fill="#333333">'
            f"<title>{escape(load.segment)}: {size:.0f} N</title></circle>"
        )
        taken.append(np.linspace((x1, y1), (x2, y2), 1 + round(abs(x2 - x1) + abs(y2 - y1))))
    figure = posture.placement.tree.figure
    uses = joint_uses(posture)
    places = {
        name: place(site_pose(posture.placement, figure.joints[name], "parent")[:3, 3])
        for name in uses
    }
    taken += [np.array(at) + _JOINT_RIM for at in places.values()]
    labels: list[str] = []
    joints = list[str]()
    # The joints that are labelled have the first choice of a place.
    for name, one in sorted(uses.items(), key=lambda item: not _is_labelled(item[1])):
        x, y = places[name]
        text = use_text(one.use)
        joints.append(
            f'<circle data-joint="{escape(name)}" cx="{x}" cy="{y}" r="7" '
            f'fill="{use_colour(one.use)}" stroke="#333333">'
            f"<title>{escape(name)} {escape(one.direction)}: {text}</title></circle>"
        )
        is_far = towards[0] < 0.0 and name.startswith("left_")
        if not is_far and (_is_labelled(one) or (is_page and one.use is not None)):
            # In the view from the front the body's right side is on the left.
            is_outside = towards[2] > 0.0 and name.startswith("right_")
            sides = (-1.0, 1.0) if is_outside else (1.0, -1.0)
            boxes = list(_label_boxes(x, y, _CHARACTER * max(len(text), 5 * is_page), sides))
            box = min(boxes, key=lambda each: _count_inside(each, taken))
            taken.append(box[0] + _GRID * (box[1] - box[0]))
            middle, bottom = box.mean(axis=0)[0], box[1, 1]
            hidden = "" if _is_labelled(one) else ' visibility="hidden"'
            labels.append(
                f'<text data-joint="{escape(name)}" x="{middle:.1f}" y="{bottom - 3.0:.1f}" '
                f'text-anchor="middle"{hidden}>{text}</text>'
            )
    title = f'<text x="{left + _MARGIN:.0f}" y="16" font-weight="bold">{view.title}</text>'
    return [*parts, *joints, *arrows, *labels, title]


def use_text(use: float | None) -> str:
    """Return a use in percent."""
    if use is None:
        return "not known"
    return f"{100.0 * use:.0f} %" if isfinite(use) else "more than all"


def _is_labelled(one: JointDemand) -> bool:
    return one.use is not None and one.use >= _LABELLED_USE


def _label_boxes(x: float, y: float, width: float, sides: Sequence[float]) -> Iterator[Array]:
    """Yield places of a label beside a joint, the preferred one first: corners, shape (2, 2)."""
    half = np.array([0.5 * width, 6.5])
    for gap, rise in ((10.0, 0.0), (9.0, -12.0), (9.0, 12.0), (16.0, 0.0)):
        for side in sides:
            centre = np.array([x + side * (gap + half[0]), y + rise])
            yield np.array([centre - half, centre + half])


def _count_inside(box: Array, taken: Sequence[Array]) -> int:
    """Return how many of the points that are taken a label would lie on."""
    points = np.concatenate(taken)
    return int(np.all((points > box[0] - 2.0) & (points < box[1] + 2.0), axis=1).sum())


def _segment_points(posture: Posture) -> dict[str, Array]:
    """Return the corners of each segment's surface in the world, else of its sites."""
    figure = posture.placement.tree.figure
    found: dict[str, Array] = {}
    for name, body in figure.bodies.items():
        points = _points_of(figure, name)
        if len(points):
            pose = posture.placement.poses[body.name]
            found[name] = points @ pose[:3, :3].T + pose[:3, 3]
    return found


def _points_of(figure: Figure, name: str) -> Array:
    body = figure.segments[name]
    if body.psurf is not None:
        return read_segment_surface(figure, body).vertices
    return np.array([site.pose_in_segment[:3, 3] for site in body.sites.values()])


def _load_ends(posture: Posture) -> list[Array]:
    """Return start and end of the arrow of each load, shape (2, 3) [m]; 1 m is 500 N."""
    found: list[Array] = []
    for load in posture.loads:
        point = site_point(posture.placement, load.segment, load.site)
        size = float(np.linalg.norm(load.total))
        length = min(max(size / 500.0, _SHORTEST_ARROW), _LONGEST_ARROW) if size else 0.0
        found.append(np.array([point, point + load.total * (length / size if size else 0.0)]))
    return found


def posture_page(
    title: str,
    lines: Sequence[str],
    rows: Sequence[Sequence[str]],
    notes: Sequence[str],
    posture: Posture,
    data: Mapping[str, Any],
) -> str:
    """Return a page on which loads are dragged, and numbers and colours follow.

    Without scripts it shows the posture as it is.

    Args:
        title: Title.
        lines: Verdict and lines under it.
        rows: Rows of the table; the first has the titles.
        notes: Notes, each a line.
        posture: Posture, with the loads that can be changed.
        data: Result of `page_data`, and texts.
    """
    views, pictures = page_views(posture)
    places = [{"right": view.right.tolist(), "x": view.x, "y": view.y} for view in views]
    head, *body = rows or [()]
    titles = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in head)
    legend = "".join(
        f'<rect x="{200.0 * use:.0f}" width="50" height="20" fill="{use_colour(use)}"/>'
        f'<text x="{200.0 * use + 25.0:.0f}" y="14" text-anchor="middle" fill="{_ink(use)}">'
        f"{100.0 * use:.0f} %</text>"
        for use in (0.0, 0.25, 0.5, 0.75, 1.0)
    )
    parts = {
        "heading": escape(title),
        "verdict": escape(lines[0]),
        "lines": "".join(f"<p>{escape(text)}</p>" for text in lines[1:]),
        "pictures": pictures,
        "legend": legend,
        "head": f"<tr>{titles}</tr>",
        "rows": "".join(
            f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in body
        ),
        "notes": "".join(f"<li>{escape(note)}</li>" for note in notes),
        "credits": _FIELD_CREDIT if data["hands"] else "",
        "posture": script_json(
            {**data, "views": places, "scale": SCALE, "arrow": (_SHORTEST_ARROW, _LONGEST_ARROW)}
        ),
    }
    return fill_page("hold.html", ("tools.js", "hold.js"), ("hold.css",), title, parts)
