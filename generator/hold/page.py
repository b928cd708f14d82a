"""A held posture as a picture (SVG), and as a page with its tables, without scripts."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from html import escape
from math import isfinite

import numpy as np

from generator.figure import Figure
from generator.geometry.read import read_segment_surface
from generator.hold.posture import JointDemand, Posture
from generator.hold.statics import site_point
from generator.kinematics.placement import site_pose
from generator.kinematics.stability import stability
from generator.rotations import Array

SCALE = 230.0
"""Pixels per metre."""

_MARGIN = 46.0
_LABELLED_USE = 0.2
"""Use from which a joint has a number in the picture."""

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

_VIEWS: Mapping[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "from the front": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "from the right": ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)),
}
"""Axis of the world to the right of each view, and the one towards the viewer."""


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
    every = np.concatenate([*outlines.values(), *(_load_ends(posture).values() or [])])
    low, high = every.min(axis=0), every.max(axis=0)
    height = SCALE * (high[1] - low[1]) + 2.0 * _MARGIN
    parts: list[str] = []
    left = 0.0
    for title, (right, towards) in _VIEWS.items():
        axis = np.array(right)
        start, end = float(low @ axis), float(high @ axis)

        def place(
            point: Array, axis: Array = axis, start: float = start, left: float = left
        ) -> tuple[float, float]:
            x = left + _MARGIN + SCALE * (float(point @ axis) - start)
            return round(x, 1), round(_MARGIN + SCALE * float(high[1] - point[1]), 1)

        parts += _view(posture, outlines, place, np.array(towards))
        parts.append(f'<text x="{left + _MARGIN:.0f}" y="16" font-weight="bold">{title}</text>')
        left += SCALE * (end - start) + 2.0 * _MARGIN
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{left:.0f}" height="{height:.0f}" '
            f'viewBox="0 0 {left:.0f} {height:.0f}" font-family="sans-serif" font-size="11">',
            '<rect width="100%" height="100%" fill="white"/>',
            *parts,
            "</svg>\n",
        ]
    )


def _view(
    posture: Posture,
    outlines: Mapping[str, Array],
    place: Callable[[Array], tuple[float, float]],
    towards: Array,
) -> list[str]:
    """Return the elements of a view, the farthest segment first."""
    parts: list[str] = []
    for points in sorted(outlines.values(), key=lambda each: float((each @ towards).mean())):
        flat = np.array([[*place(point), 0.0] for point in points])
        corners = stability(flat.mean(axis=0), flat, (0.0, 0.0, 1.0)).corners[:, :2]
        text = " ".join(f"{x:.1f},{y:.1f}" for x, y in corners)
        parts.append(f'<polygon points="{text}" fill="#e6e6e6" stroke="#9a9a9a"/>')
    if posture.standing is not None:
        centre = posture.standing.centre_of_pressure
        x, y = place(centre)
        parts.append(
            f'<path d="M{x},{y} l-6,10 h12 z" fill="#333333">'
            "<title>centre of pressure</title></path>"
        )
    taken: list[Array] = []
    for load, (start, end) in zip(posture.loads, _load_ends(posture).values(), strict=True):
        (x1, y1), (x2, y2) = place(start), place(end)
        size = float(np.linalg.norm(load.total))
        parts.append(
            f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="#333333" stroke-width="2.5"/>'
            f'<circle cx="{x2}" cy="{y2}" r="3.5" fill="#333333">'
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
    for name, one in uses.items():
        x, y = places[name]
        text = "not known" if one.use is None else f"{100.0 * one.use:.0f} %"
        parts.append(
            f'<circle cx="{x}" cy="{y}" r="7" fill="{use_colour(one.use)}" stroke="#333333">'
            f"<title>{escape(name)} {escape(one.direction)}: {text}</title></circle>"
        )
        is_far = towards[0] < 0.0 and name.startswith("left_")
        if one.use is not None and one.use >= _LABELLED_USE and not is_far:
            # In the view from the front the body's right side is on the left.
            is_outside = towards[2] > 0.0 and name.startswith("right_")
            sides = (-1.0, 1.0) if is_outside else (1.0, -1.0)
            boxes = list(_label_boxes(x, y, _CHARACTER * len(text), sides))
            box = min(boxes, key=lambda each: _count_inside(each, taken))
            taken.append(box[0] + _GRID * (box[1] - box[0]))
            middle, bottom = box.mean(axis=0)[0], box[1, 1]
            labels.append(
                f'<text x="{middle:.1f}" y="{bottom - 3.0:.1f}" text-anchor="middle">{text}</text>'
            )
    return [*parts, *labels]


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


def _load_ends(posture: Posture) -> dict[int, Array]:
    """Return start and end of the arrow of each load, shape (2, 3) [m]; 1 m is 500 N."""
    found: dict[int, Array] = {}
    for k, load in enumerate(posture.loads):
        point = site_point(posture.placement, load.segment, load.site)
        size = float(np.linalg.norm(load.total))
        length = min(max(size / 500.0, 0.08), 0.5) if size else 0.0
        found[k] = np.array([point, point + load.total * (length / size if size else 0.0)])
    return found


def posture_page(
    title: str,
    paragraphs: Sequence[str],
    rows: Sequence[Sequence[str]],
    notes: Sequence[str],
    picture: str,
) -> str:
    """Return a page with a picture, a table and texts.

    Args:
        title: Title.
        paragraphs: Verdict and lines under it.
        rows: Rows of the table; the first has the titles.
        notes: Notes, each a line.
        picture: Result of `posture_svg`.
    """

    def table() -> Iterator[str]:
        for k, row in enumerate(rows):
            tag = "th" if k == 0 else "td"
            yield "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in row) + "</tr>"

    legend = " ".join(
        f'<span style="background:{use_colour(use)};color:{_ink(use)}">'
        f"&nbsp;{100.0 * use:.0f} %&nbsp;</span>"
        for use in (0.0, 0.25, 0.5, 0.75, 1.0)
    )
    return "\n".join(
        [
            '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">',
            f"<title>{escape(title)}</title>",
            '<meta name="viewport" content="width=device-width">',
            "<style>.wide{overflow-x:auto}span{white-space:nowrap}p,li{overflow-wrap:anywhere}",
            "body{font:14px/1.4 sans-serif;margin:1.5em;max-width:70em}",
            "table{border-collapse:collapse;font-size:13px}td,th{padding:2px 8px;text-align:right;",
            "white-space:nowrap;border-bottom:1px solid #ddd}",
            "td:nth-child(-n+2),th:nth-child(-n+2){text-align:left}",
            "svg{max-width:100%;height:auto}</style></head><body>",
            f"<h1>{escape(title)}</h1>",
            *(f"<p>{escape(text)}</p>" for text in paragraphs),
            picture,
            f"<p>Use of strength: {legend}; dark red beyond, grey not known.</p>",
            '<div class="wide"><table>',
            *table(),
            "</table></div>",
            *(
                [f"<h2>Notes</h2><ul>{''.join(f'<li>{escape(n)}</li>' for n in notes)}</ul>"]
                if notes
                else []
            ),
            "</body></html>\n",
        ]
    )
