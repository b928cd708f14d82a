"""The surface of a figure's segment: its psurf, which lies beside the figure's file."""

from fractions import Fraction

from generator.errors import InputError, error
from generator.figure import Figure, Segment
from generator.geometry.read import UnknownSurfaceError, read_surface
from generator.geometry.surface import Surface
from generator.reader.draft import place_of


def surface_of(figure: Figure, segment: Segment, unit: Fraction | None = None) -> Surface:
    """The surface of a segment, told in the segment's frame.

    Any format of `read_surface` will do; `unit` [m] overrides what 1 means in it.

    Raises InputError when the segment has no psurf, or one that cannot be read.
    """
    place = place_of(segment.origins, "psurf")
    if segment.psurf is None:
        message = f"segment `{segment.name}` has no psurf, so it has no shape"
        raise InputError([error(message, place, 'add `psurf = "FILE.pss";`')])
    if figure.path is None:
        message = f"the psurf of `{segment.name}` cannot be found: the figure is in no file"
        raise InputError([error(message, place)])
    try:
        return read_surface(figure.path.parent / segment.psurf, unit)
    except UnknownSurfaceError as failure:
        raise InputError([error(str(failure), place)]) from None
