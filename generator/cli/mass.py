"""`mover mass`: what the body within a surface weighs, and how it resists being turned."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import degrees
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from generator.cli.answer import CommandResult, format_count, format_table
from generator.cli.inputs import load_figure
from generator.cli.options import (
    Density,
    density_from_option,
    length_unit_from_option,
    vector_from_option,
)
from generator.diagnostics import UsageError, spelling_hint
from generator.geometry.completion import ProductsOfInertia, mass_statements, products_of_inertia
from generator.geometry.psurf import PSURF_FILE
from generator.geometry.read import read_segment_surface, read_surface, surface_unit
from generator.geometry.surface import Surface
from generator.geometry.validate import Solid, build_solid
from generator.inertia import MassProperties
from generator.rotations import Array

FORMULA = (
    "signed tetrahedra from one point near the body to the triangles of each face "
    "(thesis 5.3, eq. 5.2 to 5.38, with the sign of det A kept)"
)

ROUNDING_TOLERANCE = 1e-14
"""Values smaller than this, relative to their neighbours, are shown as zero."""

MAX_FACES_LISTED = 20
"""Largest number of flipped faces listed."""


@dataclass(frozen=True)
class _MassResult:
    """The body within a surface.

    Attributes:
        segment: its name in a figure; None where the surface is a file of its own.
        solid: the surface, checked.
        density: the same everywhere [kg/m^3].
        density_option: the density in the words of the user.
        unit: of lengths in the file [m].
        body: mass properties.
        about: a point for another inertia tensor [m].
    """

    segment: str | None
    solid: Solid
    density: float
    density_option: str
    unit: Fraction
    body: MassProperties
    about: Array | None


def mass(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE", help="A surface: .pss .stl .obj .ply .glb; with --segment a figure."
        ),
    ],
    density: Density,
    unit: Annotated[
        str | None,
        typer.Option(
            help="Length unit of the file: mm, cm, m, in, ft. Always cm in .pss, m in .glb."
        ),
    ] = None,
    about: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z", help="Also give the inertia about this point, in the file's unit."
        ),
    ] = None,
    segment: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Segment of the figure whose psurf is used."),
    ] = None,
    fix_winding: Annotated[
        bool, typer.Option("--fix-winding", help="Flip faces that point inward.")
    ] = False,
) -> CommandResult:
    """Compute the mass properties of a closed surface."""
    kg_per_m3 = density_from_option("--density", density)
    surface, metres = _load_surface(file, segment, unit)
    point = None
    if about is not None:
        point = np.array(vector_from_option("--about", about)) * float(metres)
    solid = build_solid(surface, fix_winding=fix_winding)
    try:
        body = solid.mass_properties(kg_per_m3)
    except ValueError as failure:
        raise UsageError(f"--density {density}: {failure}") from None
    result = _MassResult(segment, solid, kg_per_m3, density, metres, body, point)
    return CommandResult(_text(result), _data(result), diagnostics=solid.warnings)


def _load_surface(
    file: str, segment_name: str | None, unit_option: str | None
) -> tuple[Surface, Fraction]:
    """Read the surface in a file, or of a segment of a figure, and its unit [m]."""
    unit = None if unit_option is None else length_unit_from_option("--unit", unit_option)
    if segment_name is None:
        return read_surface(file, unit), surface_unit(file, unit)
    figure, _ = load_figure(file)
    if segment_name not in figure.segments:
        hint = spelling_hint(segment_name, figure.segments)
        raise UsageError(f"the figure has no segment `{segment_name}`; {hint}")
    segment = figure.segments[segment_name]
    if unit is not None and Path(segment.psurf or "").suffix.lower() == PSURF_FILE.suffix:
        raise UsageError(
            f"--unit {unit_option}: `{segment.psurf}` is in cm, as the psurfs of all figures are; "
            "--unit is for files that do not say it"
        )
    return read_segment_surface(figure, segment, unit), surface_unit(segment.psurf or "", unit)


def _text(result: _MassResult) -> str:
    body, principal = result.body, result.body.principal_inertia
    size = float(np.sqrt(np.trace(body.inertia) / body.mass))
    parts = [
        _summary_text(result),
        format_table(
            [
                ["volume", f"{result.solid.volume:.9g} m^3"],
                ["mass", f"{body.mass:.9g} kg"],
                ["centre of mass", f"{_format_position(body.centre, size)} m"],
            ],
            left_columns=2,
        ),
        f"inertia about the centre of mass [kg m^2]\n{_format_tensor(body.inertia)}",
        "principal moments [kg m^2], and the axis of each in a row, right-handed\n"
        + format_table(
            [
                [f"{moment:.9g}", *(f"{round(part, 6) + 0.0:.6f}" for part in axis)]
                for moment, axis in zip(
                    principal.moments.tolist(), principal.axes.T.tolist(), strict=True
                )
            ],
            left_columns=0,
        ),
    ]
    if result.about is not None:
        about = _format_position(result.about, size)
        tensor = _format_tensor(body.inertia_about(result.about))
        parts.append(f"inertia about ({about}) m [kg m^2]\n{tensor}")
    if result.segment is not None:
        parts.append(_segment_statements(result))
    return "\n\n".join(parts)


def _summary_text(result: _MassResult) -> str:
    solid = result.solid
    bodies = sum(not shell.is_void for shell in solid.shells)
    voids = len(solid.shells) - bodies
    name = solid.surface.name
    count = "1 body" if bodies == 1 else f"{bodies} bodies"
    rows = [
        ["density", f"{result.density:.9g} kg/m^3 ({result.density_option}), the same everywhere"],
        ["lengths", f"1 in the file is {float(result.unit):g} m"],
        ["formula", FORMULA],
        [
            "surface",
            f"closed; {format_count(solid.surface.face_count, 'face')}, all facing outward",
        ],
    ]
    if len(solid.flipped):
        turned = solid.flipped[:MAX_FACES_LISTED].tolist()
        names = ", ".join(solid.surface.face_name(face) for face in turned)
        more = len(solid.flipped) - len(turned)
        names += f" and {more} more" if more else ""
        rows.append(["flipped", f"{format_count(len(solid.flipped), 'face')}: {names}"])
    if solid.merged_vertex_count:
        rows.append(["joined", f"vertices at the place of others: {solid.merged_vertex_count}"])
    return f"{name}: {count}, {format_count(voids, 'void')}\n" + format_table(rows, left_columns=2)


def _segment_statements(result: _MassResult) -> str:
    lines = list(mass_statements(result.body).values())
    products = products_of_inertia(result.body)
    if not products.are_negligible:
        lines += _omitted_products_comments(products)
    return f"for segment `{result.segment}`\n" + "\n".join(f"  {line}" for line in lines)


def _omitted_products_comments(products: ProductsOfInertia) -> Iterable[str]:
    """Yield comments on products of inertia that the figure language cannot hold."""
    yield (
        f"# products of inertia of up to {100.0 * products.ratio:.2g} % of the moments are left "
        "out:"
    )
    yield f"# the principal axes are turned by {degrees(products.angle):.2g} deg from the segment's"


def _format_position(position: Array, size: float) -> str:
    """Format a position [m] of a body of this size, with rounding errors as zero."""
    return " ".join(_format_number(value, size) for value in position.tolist())


def _format_tensor(tensor: Array) -> str:
    largest = float(np.abs(tensor).max())
    rows: Sequence[Sequence[float]] = tensor.tolist()
    return format_table([["", *(_format_number(value, largest) for value in row)] for row in rows])


def _format_number(value: float, scale: float) -> str:
    return f"{value:.9g}" if abs(value) > ROUNDING_TOLERANCE * scale else "0"


def _data(result: _MassResult) -> dict[str, object]:
    body, solid, products = result.body, result.solid, products_of_inertia(result.body)
    data: dict[str, object] = {
        "file": solid.surface.name,
        "density_kg_m3": result.density,
        "unit_m": float(result.unit),
        "formula": FORMULA,
        "closed": True,
        "winding": "outwards",
        "turned_faces": [face + 1 for face in solid.flipped.tolist()],
        "joined_vertices": solid.merged_vertex_count,
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
        "principal_moments_kg_m2": body.principal_inertia.moments.tolist(),
        "principal_axes": body.principal_inertia.axes.T.tolist(),
        "products_ratio": products.ratio,
    }
    if result.about is not None:
        data["about"] = {
            "point_m": result.about.tolist(),
            "inertia_kg_m2": body.inertia_about(result.about).tolist(),
        }
    if result.segment is not None:
        data["segment"] = result.segment
        data["statements"] = mass_statements(body)
    return data
