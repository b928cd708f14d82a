"""`mover mass`: what the body within a surface weighs, and how it resists being turned."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import degrees
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

from generator.cli import answer
from generator.cli.inputs import load_figure
from generator.cli.options import (
    Density,
    density_from_option,
    length_unit_from_option,
    option,
    vector_from_option,
)
from generator.diagnostics import UsageError, spelling_hint
from generator.geometry.completion import ProductsOfInertia, mass_statements, products_of_inertia
from generator.geometry.psurf import PSURF_FILE
from generator.geometry.read import read_segment_surface, read_surface, surface_unit
from generator.geometry.surface import Surface
from generator.geometry.validate import Solid, build_solid
from generator.rotations import Array

FORMULA = (
    "signed tetrahedra from one point near the body to the triangles of each face "
    "(thesis 5.3, eq. 5.2 to 5.38, with the sign of det A kept)"
)

ROUNDING_TOLERANCE = 1e-14
"""Values smaller than this, relative to their neighbours, are shown as zero."""

MAX_FACES_LISTED = 20
"""Largest number of flipped faces listed."""


class ShellData(NamedTuple):
    """A closed part of a surface."""

    first_face: int
    faces: int
    volume_m3: float
    void: bool


class About(NamedTuple):
    """Inertia about a point."""

    point_m: Array
    inertia_kg_m2: Array


@dataclass(frozen=True)
class MassResult(answer.CommandResult):
    """Mass properties of the body within a surface."""

    file: str
    density_kg_m3: float
    unit_m: float
    formula: str = field(default=FORMULA, init=False)
    closed: bool = field(default=True, init=False)
    winding: str = field(default="outwards", init=False)
    turned_faces: Sequence[int]
    joined_vertices: int
    shells: Sequence[ShellData]
    volume_m3: float
    mass_kg: float
    centre_of_mass_m: Array
    inertia_kg_m2: Array
    principal_moments_kg_m2: Array
    principal_axes: Array
    products_ratio: float
    about: About | None = field(metadata=answer.OMITTED_IF_NONE)
    segment: str | None = field(metadata=answer.OMITTED_IF_NONE)
    statements: Mapping[str, str] | None = field(metadata=answer.OMITTED_IF_NONE)
    solid: Solid = field(metadata=answer.HIDDEN)
    density_option: str = field(metadata=answer.HIDDEN)
    products: ProductsOfInertia = field(metadata=answer.HIDDEN)

    def paragraphs(self) -> answer.Paragraphs:
        """Return the surface, its mass, inertia and principal axes."""
        size = float(np.sqrt(np.trace(self.inertia_kg_m2) / self.mass_kg))
        yield self._summary()
        centre = _format_position(self.centre_of_mass_m, size)
        rows = [
            ["volume", f"{self.volume_m3:.9g} m^3"],
            ["mass", f"{self.mass_kg:.9g} kg"],
            ["centre of mass", f"{centre} m"],
        ]
        yield answer.Table(rows, 2)
        inertia = _format_tensor(self.inertia_kg_m2)
        yield f"inertia about the centre of mass [kg m^2]\n{inertia}"
        moments, axes = self.principal_moments_kg_m2.tolist(), self.principal_axes.tolist()
        rows = [
            [f"{moment:.9g}", *(f"{round(part, 6) + 0.0:.6f}" for part in axis)]
            for moment, axis in zip(moments, axes, strict=True)
        ]
        title = "principal moments [kg m^2], and the axis of each in a row, right-handed"
        yield f"{title}\n{answer.Table(rows, 0)}"
        if self.about is not None:
            point = _format_position(self.about.point_m, size)
            yield (
                f"inertia about ({point}) m [kg m^2]\n{_format_tensor(self.about.inertia_kg_m2)}"
            )
        if self.statements is not None:
            lines = [f"for segment `{self.segment}`", *self.statements.values()]
            if not self.products.are_negligible:
                share, angle = 100.0 * self.products.ratio, degrees(self.products.angle)
                lines += [
                    f"# products of inertia of up to {share:.2g} % of the moments are left out:",
                    f"# the principal axes are turned by {angle:.2g} deg from the segment's",
                ]
            yield "\n  ".join(lines)

    def _summary(self) -> str:
        """Return the bodies, and a table on the surface."""
        surface, flipped = self.solid.surface, self.solid.flipped.tolist()
        bodies = sum(not shell.void for shell in self.shells)
        voids = answer.format_count(len(self.shells) - bodies, "void")
        count = "1 body" if bodies == 1 else f"{bodies} bodies"
        faces = answer.format_count(surface.face_count, "face")
        density = f"{self.density_kg_m3:.9g} kg/m^3 ({self.density_option})"
        rows = [
            ["density", f"{density}, the same everywhere"],
            ["lengths", f"1 in the file is {self.unit_m:g} m"],
            ["formula", self.formula],
            ["surface", f"closed; {faces}, all facing outward"],
        ]
        if flipped:
            names = ", ".join(map(surface.face_name, flipped[:MAX_FACES_LISTED]))
            more = len(flipped) - MAX_FACES_LISTED
            names += f" and {more} more" if more > 0 else ""
            rows.append(["flipped", f"{answer.format_count(len(flipped), 'face')}: {names}"])
        if self.joined_vertices:
            rows.append(["joined", f"vertices at the place of others: {self.joined_vertices}"])
        return f"{self.file}: {count}, {voids}\n{answer.Table(rows, 2)}"


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
        str | None, option("X,Y,Z", "Also give the inertia about this point, in the file's unit.")
    ] = None,
    segment: Annotated[
        str | None, option("NAME", "Segment of the figure whose psurf is used.")
    ] = None,
    fix_winding: Annotated[
        bool, typer.Option("--fix-winding", help="Flip faces that point inward.")
    ] = False,
) -> answer.CommandResult:
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
    principal, products = body.principal_inertia, products_of_inertia(body)
    return MassResult(
        file=solid.surface.name,
        density_kg_m3=kg_per_m3,
        unit_m=float(metres),
        turned_faces=[face + 1 for face in solid.flipped.tolist()],
        joined_vertices=solid.merged_vertex_count,
        shells=[
            ShellData(shell.first_face + 1, shell.face_count, shell.volume, shell.is_void)
            for shell in solid.shells
        ],
        volume_m3=solid.volume,
        mass_kg=body.mass,
        centre_of_mass_m=body.centre,
        inertia_kg_m2=body.inertia,
        principal_moments_kg_m2=principal.moments,
        principal_axes=principal.axes.T,
        products_ratio=products.ratio,
        about=None if point is None else About(point, body.inertia_about(point)),
        segment=segment,
        statements=None if segment is None else mass_statements(body),
        solid=solid,
        density_option=density,
        products=products,
        diagnostics=solid.warnings,
    )


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


def _format_position(position: Array, size: float) -> str:
    """Format a position [m] of a body of this size, with rounding errors as zero."""
    return " ".join(_format_number(value, size) for value in position.tolist())


def _format_tensor(tensor: Array) -> str:
    largest = float(np.abs(tensor).max())
    rows: Sequence[Sequence[float]] = tensor.tolist()
    return str(
        answer.Table([["", *(_format_number(value, largest) for value in row)] for row in rows])
    )


def _format_number(value: float, scale: float) -> str:
    return f"{value:.9g}" if abs(value) > ROUNDING_TOLERANCE * scale else "0"
