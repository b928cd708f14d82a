"""`mover mass`: what the body within a surface weighs, and how it resists being turned."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import degrees
from pathlib import Path

import numpy as np

from generator.cli.answer import Answer, UsageError, aligned, counted
from generator.cli.inputs import figure_of
from generator.cli.options import density_given, length_unit_given, vector_given
from generator.diagnostics import nearest
from generator.geometry.completion import Products, products_of, statements_of
from generator.geometry.read import PSURF, read_surface, surface_of, unit_of
from generator.geometry.surface import Surface
from generator.geometry.validate import Solid, solid_of
from generator.inertia import MassProperties
from generator.rotations import Array

FORMULA = (
    "signed tetrahedra from one point near the body to the triangles of each face "
    "(thesis 5.3, eq. 5.2 to 5.38, with the sign of det A kept)"
)

ROUNDING = 1e-14
"""What is smaller than this, relative to its neighbours, is shown as zero."""

NAMED = 20
"""How many turned faces are named."""


@dataclass(frozen=True)
class Request:
    """What `mover mass` is asked for.

    Attributes:
        file: a psurf or mesh file; with `segment` a figure.
        density: with its unit.
        unit: of the file's lengths; None for that of its format, which a figure's psurf keeps.
        about: a point `x,y,z` in that unit, for another inertia tensor.
        segment: a segment of the figure.
        fix_winding: whether to turn faces that look to the wrong side.
    """

    file: str
    density: str
    unit: str | None = None
    about: str | None = None
    segment: str | None = None
    fix_winding: bool = False


@dataclass(frozen=True)
class _Found:
    """A body and all that the answer says about it."""

    request: Request
    solid: Solid
    density: float
    unit: Fraction
    body: MassProperties
    about: Array | None


def mass(request: Request) -> Answer:
    """Volume, mass, centre of mass and inertia of the body that a request names."""
    density = density_given("--density", request.density)
    given = None if request.unit is None else length_unit_given("--unit", request.unit)
    surface, unit = _surface(request, given)
    about = None
    if request.about is not None:
        about = np.array(vector_given("--about", request.about)) * float(unit)
    solid = solid_of(surface, fix_winding=request.fix_winding)
    try:
        body = solid.mass_properties(density)
    except ValueError as failure:
        raise UsageError(f"--density {request.density}: {failure}") from None
    found = _Found(request, solid, density, unit, body, about)
    return Answer(_text(found), _data(found), faults=solid.warnings)


def _surface(request: Request, unit: Fraction | None) -> tuple[Surface, Fraction]:
    """The surface and its unit [m]."""
    if request.segment is None:
        return read_surface(request.file, unit), unit_of(request.file, unit)
    figure, _ = figure_of(request.file)
    if request.segment not in figure.segments:
        hint = nearest(request.segment, figure.segments)
        raise UsageError(f"the figure has no segment `{request.segment}`; {hint}")
    segment = figure.segments[request.segment]
    if unit is not None and Path(segment.psurf or "").suffix.lower() == PSURF:
        raise UsageError(
            f"--unit {request.unit}: `{segment.psurf}` is in cm, as the psurfs of all figures are; "
            "--unit is for files that do not say it"
        )
    return surface_of(figure, segment, unit), unit_of(segment.psurf or "", unit)


def _text(found: _Found) -> str:
    body, principal = found.body, found.body.principal
    size = float(np.sqrt(np.trace(body.inertia) / body.mass))
    parts = [
        _head(found),
        aligned(
            [
                ["volume", f"{found.solid.volume:.9g} m^3"],
                ["mass", f"{body.mass:.9g} kg"],
                ["centre of mass", f"{_row(body.centre, size)} m"],
            ],
            left=2,
        ),
        f"inertia about the centre of mass [kg m^2]\n{_table(body.inertia)}",
        "principal moments [kg m^2], and the axis of each in a row, right-handed\n"
        + aligned(
            [
                [f"{moment:.9g}", *(f"{round(part, 6) + 0.0:.6f}" for part in axis)]
                for moment, axis in zip(
                    principal.moments.tolist(), principal.axes.T.tolist(), strict=True
                )
            ],
            left=0,
        ),
    ]
    if found.about is not None:
        about = _row(found.about, size)
        parts.append(f"inertia about ({about}) m [kg m^2]\n{_table(body.about(found.about))}")
    if found.request.segment is not None:
        parts.append(_pasted(found))
    return "\n\n".join(parts)


def _head(found: _Found) -> str:
    solid = found.solid
    bodies = sum(not shell.is_void for shell in solid.shells)
    voids = len(solid.shells) - bodies
    name = solid.surface.name
    count = "1 body" if bodies == 1 else f"{bodies} bodies"
    rows = [
        ["density", f"{found.density:.9g} kg/m^3 ({found.request.density}), the same everywhere"],
        ["lengths", f"1 in the file is {float(found.unit):g} m"],
        ["formula", FORMULA],
        ["surface", f"closed; {counted(solid.surface.face_count, 'face')}, all look outwards"],
    ]
    if len(solid.turned):
        turned = solid.turned[:NAMED].tolist()
        names = ", ".join(solid.surface.face_name(face) for face in turned)
        more = len(solid.turned) - len(turned)
        names += f" and {more} more" if more else ""
        rows.append(["turned", f"{counted(len(solid.turned), 'face')}: {names}"])
    if solid.joined:
        rows.append(["joined", f"vertices at the place of others: {solid.joined}"])
    return f"{name}: {count}, {counted(voids, 'void')}\n" + aligned(rows, left=2)


def _pasted(found: _Found) -> str:
    lines = list(statements_of(found.body).values())
    products = products_of(found.body)
    if not products.are_small:
        lines += _left_out(products)
    return f"for segment `{found.request.segment}`\n" + "\n".join(f"  {line}" for line in lines)


def _left_out(products: Products) -> Iterable[str]:
    """Comments that go with moments which are not the whole of the inertia."""
    yield (
        f"# products of inertia of up to {100.0 * products.ratio:.2g} % of the moments are left "
        "out:"
    )
    yield f"# the principal axes are turned by {degrees(products.angle):.2g} deg from the segment's"


def _row(position: Array, size: float) -> str:
    """A position [m] of a body of this size, without what is rounding."""
    return " ".join(_number(value, size) for value in position.tolist())


def _table(tensor: Array) -> str:
    largest = float(np.abs(tensor).max())
    rows: Sequence[Sequence[float]] = tensor.tolist()
    return aligned([["", *(_number(value, largest) for value in row)] for row in rows])


def _number(value: float, scale: float) -> str:
    return f"{value:.9g}" if abs(value) > ROUNDING * scale else "0"


def _data(found: _Found) -> dict[str, object]:
    body, solid, products = found.body, found.solid, products_of(found.body)
    data: dict[str, object] = {
        "file": solid.surface.name,
        "density_kg_m3": found.density,
        "unit_m": float(found.unit),
        "formula": FORMULA,
        "closed": True,
        "winding": "outwards",
        "turned_faces": [face + 1 for face in solid.turned.tolist()],
        "joined_vertices": solid.joined,
        "shells": [
            {
                "first_face": shell.first_face + 1,
                "faces": shell.face_count,
                "volume_m3": shell.volume,
                "void": shell.is_void,
            }
            for shell in solid.shells
        ],
        "volume_m3": solid.volume,
        "mass_kg": body.mass,
        "centre_of_mass_m": body.centre.tolist(),
        "inertia_kg_m2": body.inertia.tolist(),
        "principal_moments_kg_m2": body.principal.moments.tolist(),
        "principal_axes": body.principal.axes.T.tolist(),
        "products_ratio": products.ratio,
    }
    if found.about is not None:
        data["about"] = {
            "point_m": found.about.tolist(),
            "inertia_kg_m2": body.about(found.about).tolist(),
        }
    if found.request.segment is not None:
        data["segment"] = found.request.segment
        data["statements"] = statements_of(body)
    return data
