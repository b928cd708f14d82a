"""The files of an exported model, and all that they do not hold."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from generator.losses import Losses
from generator.text_io import write_atomic


@dataclass(frozen=True)
class ModelFiles:
    """The files of a model: the model itself, and meshes or tables that belong to it.

    Attributes:
        path: of the model, a file or a folder.
        contents: text or bytes by path, the model last: it is not whole without the others. A path
            is in the folder of the model, or in a folder there.
        losses: the parts of the figure and its springs that the files do not hold.
    """

    path: Path
    contents: Mapping[Path, str | bytes]
    losses: Losses

    def write(self) -> Losses:
        """Write the files, each whole or not at all, and return the losses.

        Raises OSError when a file cannot be written.
        """
        for path, content in self.contents.items():
            if path.parent != self.path.parent:
                path.parent.mkdir(exist_ok=True)
            write_atomic(path, content)
        return self.losses


def geometry_folder(path: Path) -> Path:
    """Return the folder of the meshes of the model at `path`: `arm_geometry` of `arm.osim`."""
    return path.with_name(f"{path.stem}_geometry")
