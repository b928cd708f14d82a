"""Kinds of text files: found, read and parsed in one way, whatever their content."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Concatenate, Generic, ParamSpec, TypeVar

import figures
from generator.diagnostics import Diagnostics, Parsed, Source, error, spelling_hint, warning
from generator.text_io import is_file, make_source, parse_file, parse_source, path_exists

T = TypeVar("T")
P = ParamSpec("P")


@dataclass(frozen=True)
class FileKind(Generic[T, P]):
    """A kind of text file, with the parser of its text.

    What the parser needs beside the text, such as the figure of a pose, follows the path or the
    text in each call.

    Attributes:
        noun: name of the kind in sentences, as `scene`.
        suffix: end of the names of its files.
        parser: parses a text; errors go to the diagnostics, which may raise TooManyErrors.
        is_shipped: whether files of this kind come with the program and are found by their names.
        prefers_shipped: Whether a shipped file comes before one of its name in the working folder;
            figures do, so that what is said of `prototype` is said of the same body everywhere.
    """

    noun: str
    suffix: str
    parser: Callable[Concatenate[Source, Diagnostics, P], T | None]
    is_shipped: bool = False
    prefers_shipped: bool = False

    def shipped(self) -> dict[str, Path]:
        """Return the files of this kind that come with the program, by name."""
        folder = Path(figures.__path__[0])
        paths = sorted(folder.glob(f"*{self.suffix}")) if self.is_shipped else ()
        return {path.name.removesuffix(self.suffix): path for path in paths}

    def find(self, path_or_name: str | Path, folder: Path = Path()) -> Path:
        """Return the path of an existing file, of one without its suffix, or of a shipped one.

        The path unchanged if there is none. A file in the folder comes before a shipped one of its
        name, unless the kind prefers those.

        Args:
            path_or_name: Path, relative to the folder, or name.
            folder: Folder of the file that names it; the working folder by default.
        """
        path = folder / path_or_name
        if is_file(path) or not self.is_shipped:
            return path
        found = [self._own(path), self.shipped().get(str(path_or_name))]
        return next(filter(None, found[::-1] if self.prefers_shipped else found), path)

    def _own(self, path: Path) -> Path | None:
        """Return the path with the suffix of the kind, if there is such a file."""
        own = Path(f"{path}{self.suffix}")
        return own if is_file(own) else None

    def beside(self, path: Path) -> Path:
        """Return the path of a file of this kind that belongs to another file."""
        return path.with_name(path.stem + self.suffix)

    def read(self, path_or_name: str | Path, *args: P.args, **kwargs: P.kwargs) -> T:
        """Read a file, or a shipped one by its name. Warnings pass.

        Raises InputError with all errors.
        """
        return self.parse_file(path_or_name, *args, **kwargs).require_value()

    def parse_file(self, path_or_name: str | Path, *args: P.args, **kwargs: P.kwargs) -> Parsed[T]:
        """Parse a file, or a shipped one by its name; bad input becomes diagnostics."""
        name, path = str(path_or_name), self.find(path_or_name)
        if self.is_shipped and not path_exists(path):
            message = f"there is no file `{name}` and no shipped {self.noun} of that name"
            hint = spelling_hint(path.name.removesuffix(self.suffix), self.shipped())
            return Parsed(None, (error(message, hint=hint),))
        parsed = parse_file(path, self._parser_with(*args, **kwargs), name)
        own = self._own(Path(name)) if self.prefers_shipped and str(path) != name else None
        if own is None or own.samefile(path):
            return parsed
        passed_over = warning(
            f"this is the shipped {self.noun} `{name}`, not `{own}` of the working folder",
            hint=f"name that file `{own}`",
        )
        return replace(parsed, diagnostics=(*parsed.diagnostics, passed_over))

    def parse_text(self, text: str, *args: P.args, **kwargs: P.kwargs) -> Parsed[T]:
        """Parse a text, which diagnostics call `<text>`; bad input becomes diagnostics."""
        return self.parse(make_source(text), *args, **kwargs)

    def parse(self, source: Source, *args: P.args, **kwargs: P.kwargs) -> Parsed[T]:
        """Parse a text that has a name, or a file; bad input becomes diagnostics."""
        return parse_source(source, self._parser_with(*args, **kwargs))

    def _parser_with(
        self, *args: P.args, **kwargs: P.kwargs
    ) -> Callable[[Source, Diagnostics], T | None]:
        return lambda source, diagnostics: self.parser(source, diagnostics, *args, **kwargs)
