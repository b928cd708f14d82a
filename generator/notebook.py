"""Tables, curves and pages in HTML, as which notebooks show figures, springs and recordings."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike


def html_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table with its title above it; all texts are escaped."""
    from html import escape  # notebooks alone need it

    head = "".join(f"<th>{escape(column)}</th>" for column in columns)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows
    )
    return (
        f'<p>{escape(title)}</p><div style="overflow-x:auto"><table><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


_WIDTH, _HEIGHT, _MARGIN = 420, 200, 40
"""Size of the drawing of a curve, and the edge for the numbers on its left [px]."""

_STYLES = ("#0072B2;stroke-width:2.5", "#D55E00", "#009E73", "#6E6E6E", "#CC79A7", "#E69F00")
"""Strokes of curves, in turn."""


def html_curves(
    labels: tuple[str, str],
    curves: Sequence[tuple[str, ArrayLike, ArrayLike]],
    limits: tuple[float, float],
) -> str:
    """Return curves in one drawing (SVG) with their names below it; all texts are escaped.

    Args:
        labels: Names of the horizontal and the vertical axis, with their units.
        curves: Name, horizontal and vertical numbers of each curve, shape (n,); numbers that are
            not finite are gaps.
        limits: Smallest and largest vertical number that is drawn.
    """
    from html import escape

    drawn = [(name, np.asarray(x, float), np.asarray(y, float)) for name, x, y in curves]
    left, right = (float(end([end(x) for _, x, _ in drawn])) for end in (np.min, np.max))
    low, high = limits
    lines, keys = list[str](), list[str]()
    for k, (name, x, y) in enumerate(drawn):
        across = _MARGIN + (_WIDTH - _MARGIN) * (x - left) / (right - left or 1.0)
        down = _HEIGHT * (high - y) / (high - low or 1.0)
        # Far beyond the limits a coordinate of SVG loses its digits.
        known = np.isfinite(down) & (np.abs(down) < 10 * _HEIGHT)
        parts = np.split(np.arange(x.size), np.flatnonzero(np.diff(known)) + 1)
        path = "".join(
            "M" + " ".join(f"{across[i]:.0f},{down[i]:.1f}" for i in part)
            for part in parts
            if part.size and known[part[0]]
        )
        stroke = _STYLES[k % len(_STYLES)] + (";stroke-dasharray:5 3" if k >= len(_STYLES) else "")
        lines.append(
            f'<path d="{path}" clip-path="inset(0)" style="fill:none;stroke:{stroke}">'
            f"<title>{escape(name)}</title></path>"
        )
        mark = "- -" if k >= len(_STYLES) else "&#9644;"
        keys.append(
            f'<span style="color:{stroke.partition(";")[0]}">{mark}</span> {escape(name)}<br>'
        )
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT + 18}" width="{_WIDTH}" height="{_HEIGHT + 18}" '
        'role="img" '
        f'aria-label="{escape(" over ".join(reversed(labels)))}" font-size="11" '
        'fill="currentColor" style="display:block;overflow:visible">'
        f'<svg x="0" y="0" width="{_WIDTH}" height="{_HEIGHT}">{_grid(limits)}'
        f"{''.join(lines)}</svg>"
        f'<text x="{_MARGIN}" y="{_HEIGHT + 14}">{left:.4g}</text>'
        f'<text x="{_WIDTH}" y="{_HEIGHT + 14}" text-anchor="end">{right:.4g}</text>'
        f'<text x="{_WIDTH / 2:g}" y="{_HEIGHT + 14}" text-anchor="middle">{escape(labels[0])}'
        f'</text><text x="0" y="10">{high:.3g}</text>'
        f'<text x="0" y="{_HEIGHT}">{low:.3g}</text>'
        f'<text transform="translate(12,{_HEIGHT / 2:g}) rotate(-90)" '
        f'text-anchor="middle">{escape(labels[1])}</text></svg><p>{"".join(keys)}</p>'
    )


def _grid(limits: tuple[float, float]) -> str:
    """Return the frame of a drawing and its line of zero."""
    low, high = limits
    zero = _HEIGHT * high / (high - low or 1.0)
    return (
        f'<path d="M{_MARGIN},0V{_HEIGHT - 1}H{_WIDTH}M{_MARGIN},{zero:.1f}H{_WIDTH}" '
        'style="fill:none;stroke:#999;stroke-width:0.7"/>'
    )


@dataclass(frozen=True)
class PageView:
    """A page that a notebook shows in its cell, without a server or a network.

    Attributes:
        html: Text of the page.
        height: Height of the cell [px].
    """

    html: str = field(repr=False)
    height: int = 600

    def _repr_html_(self) -> str:
        """The page in a frame of its own, whose scripts cannot reach the notebook."""
        from html import escape

        return (
            f'<iframe srcdoc="{escape(self.html)}" sandbox="allow-scripts allow-downloads" '
            f'title="motion" style="width:100%;height:{self.height}px;border:0"></iframe>'
        )
