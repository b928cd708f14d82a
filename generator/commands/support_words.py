"""What `--support` and `--below` mean, and how a support is called in sentences."""

import re
from collections.abc import Sequence

from generator.commands.answer import UsageError
from generator.figure import Figure, SiteRef, Vector
from generator.posture.support import (
    FixedSupport,
    LowFaces,
    Patch,
    Support,
    UnknownSupportError,
    patch_of_faces,
    patch_of_site,
)

EXPECTED = "SEGMENT, SEGMENT:FACE,FACE or SEGMENT.SITE"

_SITE = re.compile(r"(\w+)\.(\w+)")
_FACES = re.compile(r"(\w+)(?::\s*([0-9]{1,9}(?:\s*,\s*[0-9]{1,9})*))?")


def support_asked(figure: Figure, texts: Sequence[str], below: float | None, up: Vector) -> Support:
    """The support that the options ask for.

    Args:
        figure: that stands on it.
        texts: of the form `SEGMENT`, `SEGMENT:FACE,FACE` or `SEGMENT.SITE`.
        below: height up to which all faces support [m].
        up: normal of the ground.

    Raises:
        UsageError: a text cannot be read or does not fit the figure, or not one way is chosen.
        InputError: a psurf is missing or wrong.
    """
    if bool(texts) == (below is not None):
        raise UsageError("what supports the figure is said by --support or by --below, one of them")
    if below is not None:
        return LowFaces(figure, below, up)
    return FixedSupport([_patch(figure, text) for text in texts])


def _patch(figure: Figure, text: str) -> Patch:
    try:
        site = _SITE.fullmatch(text)
        if site is not None:
            return patch_of_site(figure, SiteRef(site[1], site[2]))
        faces = _FACES.fullmatch(text)
        if faces is None:
            raise UsageError(f"--support {text}: expected {EXPECTED}")
        numbers = None if faces[2] is None else [int(word) for word in faces[2].split(",")]
        return patch_of_faces(figure, faces[1], numbers)
    except UnknownSupportError as failure:
        raise UsageError(f"--support {text}: {failure}") from None
