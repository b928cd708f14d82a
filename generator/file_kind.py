"""Kinds of text files: found, read and parsed in one way, whatever their content."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Concatenate, Generic, ParamSpec, TypeVar

import figures
from generator.diagnostics import Diagnostics, Parsed, Source, error, spelling_hint
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
    """

    noun: str
    suffix: str
    parser: Callable[Concatenate[Source, Diagnostics, P], T | None]
    is_shipped: bool = False

    def shipped(self) -> dict[str, Path]:
        """Return the files of this kind that come with the program, by name."""
        folder = Path(figures.__path__[0])
        paths = sorted(folder.glob(f"*{self.suffix}")) if self.is_shipped else ()
        return {path.name.removesuffix(self.suffix): path for path in paths}

    def find(self, path_or_name: str | Path) -> Path:
        """Return the path of an existing file, else of a shipped one, else the path unchanged."""
        path = Path(path_or_name)
        return path if is_file(path) else self.shipped().get(str(path_or_name), path)

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
            hint = spelling_hint(name.removesuffix(self.suffix), self.shipped())
            return Parsed(None, (error(message, hint=hint),))
        return parse_file(path, self._parser_with(*args, **kwargs), name)

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
