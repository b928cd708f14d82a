"""Props that a figure may touch."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from generator.contact.box import Box
from generator.contact.plane import Plane
from generator.contact.shape import Shape, Vector
from generator.diagnostics import ModelError
from generator.rotations import Array
from springs.contact import DEFAULT_SURFACE, Surface
from springs.contact_part import PartLaw
from springs.layer import Layer
from springs.short_repr import short_repr

SHAPES: tuple[type[Shape], ...] = (Plane, Box)
"""Classes of shapes, in the order in which compiled code numbers them."""

FLOOR = "floor"
"""Name of the plane that the option `--floor` adds."""


@short_repr
@dataclass(frozen=True)
class Prop:
    """A fixed body that a figure may touch."""

    name: str
    shape: Shape
    surface: Surface


@short_repr
@dataclass(frozen=True)
class Cover:
    """A layer over a part of the body, such as a helmet.

    Attributes:
        part: Name of the part.
        layer: Its stiffness, in series with the part and with what this touches.
        origin: File and line of the cover, for errors.
    """

    part: str
    layer: Layer
    origin: str = field(default="", compare=False)


@short_repr
@dataclass(frozen=True)
class Scene:
    """The props around a figure, and the covers of parts of its body.

    Raises ModelError for two props of one name, and for two covers of one part.
    """

    props: tuple[Prop, ...] = ()
    covers: tuple[Cover, ...] = ()

    @classmethod
    def floor(cls, up: Vector = (0.0, 1.0, 0.0), surface: Surface = DEFAULT_SURFACE) -> "Scene":
        """Return a floor alone."""
        return cls((floor_prop(up, surface),))

    def __post_init__(self) -> None:
        """Check the names."""
        names = Counter(prop.name for prop in self.props)
        for name, count in names.items():
            if count > 1:
                raise ModelError(f"two props are called `{name}`")
        parts = Counter(cover.part for cover in self.covers)
        for part, count in parts.items():
            if count > 1:
                raise ModelError(f"two covers are over the part `{part}`")

    def cover(
        self, laws: Mapping[str, PartLaw], regions: Mapping[str, str] | None = None
    ) -> dict[str, PartLaw]:
        """Return the laws of parts of the body by name, with the covers of this scene.

        Args:
            laws: Laws of the parts.
            regions: Part that each region is within; a cover of the part is over its regions too.

        Raises:
            ModelError: The body does not have a part that is covered, or it is a region.
        """
        covered, regions = dict(laws), regions or {}
        for cover in self.covers:
            place = f"{cover.origin}: " if cover.origin else ""
            if not laws:
                raise ModelError(
                    f"{place}the scene covers the part `{cover.part}`, but the figure has no "
                    "parts, as a person made with `mover person` has"
                )
            if cover.part not in laws:
                raise ModelError(
                    f"{place}the scene covers the part `{cover.part}`, which the body does not "
                    f"have; its parts are {', '.join(laws)}"
                )
            if cover.part in regions:
                raise ModelError(
                    f"{place}`{cover.part}` is a region of `{regions[cover.part]}`: cover that part"
                )
            whole = replace(laws[cover.part], cover=cover.layer)
            covered[cover.part] = whole
            for region, part in regions.items():
                if part == cover.part:
                    covered[region] = replace(laws[region], cover=cover.layer, within=whole)
        return covered

    @property
    def shape_numbers(self) -> list[int]:
        """Number of each prop's class in compiled code."""
        return [SHAPES.index(type(prop.shape)) for prop in self.props]


NO_SCENE = Scene()
"""Scene without props."""


def floor_prop(up: Vector, surface: Surface = DEFAULT_SURFACE) -> Prop:
    """Return a plane through the world's origin, below which everything is floor."""
    return Prop(FLOOR, Plane((0.0, 0.0, 0.0), up), surface)


def with_floor(scene: Scene, height: float | None) -> Scene:
    """Return a scene whose floor is at a height along y [m]; of None, without a floor."""
    others = tuple(prop for prop in scene.props if prop.name != FLOOR)
    if height is None:
        return replace(scene, props=others)
    floor = Prop(FLOOR, Plane((0.0, height, 0.0), (0.0, 1.0, 0.0)), DEFAULT_SURFACE)
    return replace(scene, props=(floor, *others))


def floor_height(scene: Scene) -> float | None:
    """Return the height of the floor of a scene along y [m]; None without a floor."""
    shapes = [prop.shape for prop in scene.props if prop.name == FLOOR]
    return float(shapes[0].pose[1, 3]) if shapes else None


def add_floor(scene: Scene, up: Vector, friction: float | None = None) -> Scene:
    """Return a scene with a floor below its props.

    Args:
        scene: Other props.
        up: Normal of the floor.
        friction: Coefficient of its friction; None for that of the default surface.

    Raises:
        ModelError: the scene has a floor.
    """
    if any(prop.name == FLOOR for prop in scene.props):
        raise ModelError(f"the scene has a prop `{FLOOR}` already")
    surface = DEFAULT_SURFACE if friction is None else replace(DEFAULT_SURFACE, friction=friction)
    return replace(scene, props=(floor_prop(up, surface), *scene.props))


class Penetration(NamedTuple):
    """Depth of a sphere in a prop [m], negative outside, with the prop and the sphere's segment."""

    depth: float
    prop: str
    segment: str


def deepest_start(
    scene: Scene, centres: Array, radii: Array, segments: Sequence[str]
) -> Penetration | None:
    """Return the sphere that is deepest in a prop; None without spheres or props.

    Args:
        scene: scene with the props.
        centres: centres of the spheres in the world [m], shape (n, 3).
        radii: [m], shape (n,).
        segments: segment of each sphere.
    """
    deepest: Penetration | None = None
    for prop in scene.props:
        pose = prop.shape.pose
        local = (centres - pose[:3, 3]) @ pose[:3, :3]
        x, y, z = np.moveaxis(local, -1, 0)
        depths = radii - prop.shape.distance((x, y, z))[0]
        if not len(depths):
            continue
        k = int(np.argmax(depths))
        if deepest is None or depths[k] > deepest.depth:
            deepest = Penetration(float(depths[k]), prop.name, segments[k])
    return deepest
