"""A surface that is known to enclose a body, and the mass properties of that body."""

from dataclasses import dataclass

from generator.errors import Fault, InputError, errors_among
from generator.geometry.examination import Shell
from generator.geometry.soundness import examine_surface
from generator.geometry.surface import Indices, Surface
from generator.geometry.tetrahedra import Tetrahedra
from generator.inertia import MassProperties


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed surface whose faces all look outwards; made by `solid_of`.

    Attributes:
        surface: as it was used: with faces turned and vertices joined, if that was needed.
        shells: the closed parts of the surface: bodies, and voids in them.
        turned: the faces that had to be turned, by index.
        joined: how many vertices lay where others do and were joined to close the surface.
        warnings: what is odd, but does no harm.
        tetrahedra: the signed tetrahedra that add up to the body.
    """

    surface: Surface
    shells: tuple[Shell, ...]
    turned: Indices
    joined: int
    warnings: tuple[Fault, ...]
    tetrahedra: Tetrahedra

    @property
    def volume(self) -> float:
        """Volume of the body [m3]."""
        return self.tetrahedra.volume

    def mass_properties(self, density: float) -> MassProperties:
        """The body, filled with `density` [kg/m3]. Raises ValueError unless it is above zero."""
        if not density > 0.0:
            raise ValueError(f"a density is above zero, not {density}")
        return self.tetrahedra.mass_properties(density)


def solid_of(surface: Surface, *, fix_winding: bool = False) -> Solid:
    """The body within a surface.

    With `fix_winding` faces that look to the wrong side are turned instead of refused.

    Raises InputError, with all faults, for a surface that encloses no body.
    """
    found = examine_surface(surface, fix_winding=fix_winding)
    if found.tetrahedra is None or errors_among(found.faults):
        raise InputError(found.faults)
    return Solid(
        surface=found.surface,
        shells=found.shells,
        turned=found.turned,
        joined=found.joined,
        warnings=tuple(found.faults),
        tetrahedra=found.tetrahedra,
    )


def mass_properties(
    surface: Surface, density: float, *, fix_winding: bool = False
) -> MassProperties:
    """Mass, centre of mass and inertia of the body within a surface.

    Args:
        surface: closed, with faces that look outwards; see `solid_of`.
        density: [kg/m3], the same everywhere.
        fix_winding: whether to turn faces that look to the wrong side.

    Raises:
        InputError: the surface encloses no body.
        ValueError: the density is not above zero.
    """
    return solid_of(surface, fix_winding=fix_winding).mass_properties(density)
