"""Which file holds the springs of a figure: what stands beside it, or what a user chooses."""

from pathlib import Path

from generator.errors import Fault, error
from generator.reader.springs_file import SUFFIX
from generator.reader.vocabulary import shown

OPTIONAL_SUFFIX = ".optional"

NONE = "none"
PRINTED = "printed"

_FILE_SUFFIXES = (".toml", OPTIONAL_SUFFIX)


def find_springs(
    directory: Path | None, stem: str | None, choice: str | Path | None
) -> tuple[Path | None, Fault | None]:
    """The file to read, None where the figure speaks for itself; or the fault that there is none.

    Args:
        directory: where the figure's file lies; None when it is from no file.
        stem: the file's name without the suffix; None likewise.
        choice: None for what stands beside the figure; "printed" for the `optional` file there; the
            path of a file; or NAME for `STEM.NAME.springs.toml` beside the figure.
    """
    if choice is None:
        return _beside(directory, stem, (SUFFIX, OPTIONAL_SUFFIX)), None
    name = str(choice)
    if name == PRINTED:
        path = _beside(directory, stem, (OPTIONAL_SUFFIX,))
        return path, None if path is not None else _no_printed_values(stem)
    if directory is None or stem is None or not _is_name(choice):
        return Path(choice), None
    for full in (f"{stem}.{name}{SUFFIX}", f"{name}{SUFFIX}"):
        if _is_file(directory / full):
            return directory / full, None
    known = (*named_springs(directory, stem), NONE, PRINTED)
    return None, error(
        f"there are no springs `{shown(name)}` beside the figure `{shown(stem)}`",
        hint=f"there are {', '.join(known)}; else name a file",
    )


def named_springs(directory: Path, stem: str) -> tuple[str, ...]:
    """The names that choose springs beside a figure."""
    paths = directory.glob("*" + SUFFIX)
    names = (path.name.removesuffix(SUFFIX) for path in paths)
    return tuple(sorted(n.removeprefix(f"{stem}.") for n in names if n.startswith(f"{stem}.")))


def _is_name(choice: str | Path) -> bool:
    """Whether a choice looks like a name and not like the path of a file."""
    path = Path(choice)
    is_word = len(path.parts) == 1 and path.suffix not in _FILE_SUFFIXES
    return not str(choice) or (is_word and not _is_file(path))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # longer than any file's name
        return False


def _beside(directory: Path | None, stem: str | None, suffixes: tuple[str, ...]) -> Path | None:
    """The first file with one of these endings beside a figure."""
    if directory is None or stem is None:
        return None
    paths = (directory / f"{stem}{suffix}" for suffix in suffixes)
    return next((path for path in paths if path.exists()), None)


def _no_printed_values(stem: str | None) -> Fault:
    if stem is None:
        return error("a figure from no file has no printed values", hint="name a file of springs")
    name = f"{shown(stem)}{OPTIONAL_SUFFIX}"
    return error(
        f"there is no `{name}` beside the figure", hint="the printed values are those of that file"
    )
