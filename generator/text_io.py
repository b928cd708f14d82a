"""Text files: reading with diagnostics, and atomic writing."""

import codecs
import csv
import errno
import os
import platform
import re
import shutil
import stat
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from io import BufferedReader, BufferedWriter
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar
from zlib import crc32

from generator.diagnostics import (
    Diagnostic,
    Diagnostics,
    Parsed,
    Source,
    Span,
    TooManyErrors,
    error,
)

T = TypeVar("T")

MAX_FILE_BYTES = 32_000_000
"""Bytes of the largest file that is read: an endless device must not be read for ever."""

_UTF16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)

_CONTROL = re.compile(rb"[\0-\x08\x0e-\x1f]")
"""Control characters that no text has, in whatever encoding of one byte."""


def open_regular_file(path: Path) -> BufferedReader:
    """Open a file to read its bytes.

    Raises OSError, also for a directory, and for a pipe or a device, which may have no end.
    """
    # Opening a pipe would wait for its writer.
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    try:
        descriptor = os.open(path, flags)
    except ValueError:
        raise OSError(errno.EINVAL, "its name has a zero byte") from None
    mode = os.fstat(descriptor).st_mode
    if stat.S_ISREG(mode):
        return open(descriptor, "rb")
    os.close(descriptor)
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a directory")
    raise OSError(errno.EINVAL, "it is not a regular file")


def path_exists(path: Path) -> bool:
    """Return whether there is a file or a folder of this name."""
    try:
        return path.exists()
    except OSError:  # a name longer than any file's
        return False


def is_file(path: Path) -> bool:
    """Return whether there is a file of this name."""
    return path_exists(path) and path.is_file()


def is_folder(path: Path) -> bool:
    """Return whether there is a folder of this name."""
    return path_exists(path) and path.is_dir()


def load_text(path: Path, name: str) -> tuple[Source, Diagnostic | None]:
    """The text of the file at `path`, called `name`, and the error that keeps it from being read.

    UTF-8 with or without a byte-order mark; all three ends of line are read as one.
    """
    try:
        with open_regular_file(path) as file:
            data = file.read(MAX_FILE_BYTES + 1)
    except IsADirectoryError:
        return Source(name, ""), error(f"`{name}` is a directory, not a file")
    except OSError as failure:
        return Source(name, ""), error(f"`{name}` cannot be read: {os_error_reason(failure)}")
    if len(data) > MAX_FILE_BYTES:
        return Source(name, ""), error(f"`{name}` is larger than {MAX_FILE_BYTES // 1_000_000} MB")
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as failure:
        return _decoding_error(data, name, failure.start)
    source = make_source(text, name, path)
    zero = source.text.find("\0")
    if zero != -1:
        return source, error(
            "this is a binary file, not a text", Span(source, zero, zero + 1), "found a zero byte"
        )
    return source, None


def normalise_newlines(text: str) -> str:
    r"""`text` with every end of line (`\r\n`, `\r`, `\n`) written as `\n`."""
    return text.replace("\r\n", "\n").replace("\r", "\n")


def make_source(text: str, name: str = "<text>", path: Path | None = None) -> Source:
    """Return a text with one kind of end of line, with its name in diagnostics and its file."""
    return Source(name, normalise_newlines(text), path)


def parse_file(
    path: str | Path, parse: Callable[[Source, Diagnostics], T | None], name: str | None = None
) -> Parsed[T]:
    """Parse the text of a file; bad input raises nothing.

    Args:
        path: path of the file.
        parse: the parser of the text; it reports to the diagnostics and may raise TooManyErrors.
        name: name of the file in diagnostics [default: the path].
    """
    source, unreadable = load_text(Path(path), str(path) if name is None else name)
    return Parsed(None, (unreadable,)) if unreadable is not None else parse_source(source, parse)


def parse_source(source: Source, parse: Callable[[Source, Diagnostics], T | None]) -> Parsed[T]:
    """Parse a source; bad input raises nothing."""
    diagnostics, value = Diagnostics(), None
    with suppress(TooManyErrors):
        value = parse(source, diagnostics)
    return Parsed(None if diagnostics.has_errors else value, diagnostics.sorted_by_position())


_KEPT_SOURCES, _KEPT_SIZE = 8, 2**20
"""Number of texts whose content is kept, and largest number of characters of each."""


def once_per_source(
    parse: Callable[[Source, Diagnostics], T | None],
) -> Callable[[Source, Diagnostics], T | None]:
    """Return a parser that keeps the contents of its last texts without a diagnostic.

    A file that is read again is not parsed again where its text is the same.

    Args:
        parse: parser whose result depends on the text alone, and does not change.
    """
    kept: dict[tuple[Source, Path | None], T] = {}

    def parse_once(source: Source, diagnostics: Diagnostics) -> T | None:
        key, is_clean = (source, source.path), not diagnostics.entries
        if is_clean and (known := kept.get(key)) is not None:
            return known
        value = parse(source, diagnostics)
        if value is not None and not diagnostics.entries and len(source.text) <= _KEPT_SIZE:
            while len(kept) >= _KEPT_SOURCES:
                kept.pop(next(iter(kept)), None)
            kept[key] = value
        return value

    return parse_once


def _decoding_error(data: bytes, name: str, offset: int) -> tuple[Source, Diagnostic]:
    """The text of a file that is not UTF-8, and an error at the first such byte."""
    if data.startswith(_UTF16_MARKS):
        source = Source(name, normalise_newlines(data.decode("utf-16", errors="replace")))
        return source, error("this file is UTF-16", Span(source, 0, 1), "save it as UTF-8")
    before = normalise_newlines(data[:offset].decode("utf-8"))
    source = Source(name, before + normalise_newlines(data[offset:].decode("latin-1")))
    byte, place = data[offset], Span(source, len(before), len(before) + 1)
    if control := _CONTROL.search(data):
        hint = f"found the control character 0x{control[0][0]:02X}"
        return source, error("this is a binary file, not a text", place, hint)
    return source, error(
        f"byte 0x{byte:02X} is not UTF-8",
        place,
        f"save the file as UTF-8; in Latin-1 this byte is `{chr(byte)}`"
        if chr(byte).isprintable()
        else "the file should be a text in UTF-8",
    )


_CREATE_FLAGS = os.O_WRONLY | os.O_CREAT | os.O_EXCL

_DEFAULT_MODE = 0o666
"""Mode of a file that was not there before, less what the user's mask takes away."""

_MAX_SYMLINKS = 40
"""So many links one behind the other are followed, as the system itself does."""


_FORMULA = re.compile(r"'*[=+\-@\t\r]")
"""Beginning of a text that a spreadsheet takes for a formula, quoted or not."""

_NUMBER = re.compile(
    r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?|[+-]?inf", re.ASCII | re.IGNORECASE
)


def csv_cell(text: str) -> str:
    """Return a text that a spreadsheet does not take for a formula: with `'` before `= + - @`.

    Tabulators and carriage returns, which spreadsheets skip, are such beginnings too. Numbers stay
    as they are. `csv_value` returns the text.
    """
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def csv_value(cell: str) -> str:
    """Return the text of which `csv_cell` made a cell."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def csv_lines(rows: Iterable[Iterable[object]]) -> Iterator[str]:
    """Yield the lines of comma-separated values, whose texts are not formulas."""
    # A text with a character of the line's end is quoted, and a carriage return ends lines too.
    line: list[str] = []
    sink: Any = SimpleNamespace(write=line.append)
    writer = csv.writer(sink, lineterminator="\r\n")
    for row in rows:
        writer.writerow([csv_cell(cell) if isinstance(cell, str) else cell for cell in row])
        yield line.pop().removesuffix("\r\n") + "\n"


def format_csv_rows(rows: Iterable[Iterable[object]]) -> str:
    """Return comma-separated values, whose texts are not formulas."""
    return "".join(csv_lines(rows))


def format_csv_comment(text: str) -> str:
    """Return a line of a table that begins with `#`, without a formula after one of its commas."""
    return f"# {','.join(map(csv_cell, text.split(',')))}\n"


def read_csv_rows(lines: Iterable[str]) -> tuple[list[str], Iterator[dict[str, str]]]:
    """Return the titles of a table, and its rows by title. Raises csv.Error for a damaged one.

    A row of another length than that of the titles has only what both have.
    """
    rows = ([csv_value(cell) for cell in row] for row in csv.reader(lines))
    titles = next(rows, list[str]())
    return titles, (dict(zip(titles, row, strict=False)) for row in rows if row)


def write_atomic(path: Path, content: str | bytes) -> None:
    """Put `content`, a text in UTF-8, into the file at `path`.

    It goes to a temporary file in the same folder, which takes the place of `path` once the
    disk has it all. Who kills the program before that finds the old file, or none, and at worst the
    temporary one (`.NAME.PROCESS-xxxxxxxx-xxxxxxxx.part`), which the next program that writes to
    the folder removes. A link is followed, and the file that it names replaced; the new file has
    the mode of the old one. Only regular files are replaced, and no read-only ones, though the
    system would let the owner of the folder do it.

    Raises OSError when the file cannot be written.
    """
    with open_atomic(path) as stream:
        stream.write(content.encode() if isinstance(content, str) else content)


@contextmanager
def open_atomic(path: Path) -> Generator[BufferedWriter]:
    """Open a file whose content takes the place of `path` at the end of the block.

    An exception in the block leaves the file as it was; see `write_atomic`.

    Raises OSError when the file cannot be written.
    """
    target = _real_path(path)
    mode = _existing_mode(path)
    remove_stale_parts(target.parent)
    part = temporary_path(target)
    descriptor = os.open(part, _CREATE_FLAGS, _DEFAULT_MODE if mode is None else mode)
    try:
        with open(descriptor, "wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        move_into_place(part, path)
    except BaseException:
        remove_part(part)
        raise


def move_into_place(part: Path, path: Path) -> None:
    """Rename a complete temporary file, or folder of files, to its path; links are followed.

    A new or empty folder is renamed as one. Into a folder that has files, the new files are moved
    one after the other, and others in it are kept. A file keeps the mode of the one before.

    Raises OSError for what must not be replaced.
    """
    if part.is_dir():
        try:
            os.rename(part, _real_path(path))
        except OSError:
            if not path.is_dir():
                raise
            for file in sorted(part.iterdir()):
                move_into_place(file, path / file.name)
            part.rmdir()
        return
    mode = _existing_mode(path)
    if mode is not None:
        part.chmod(mode)  # the mask has taken some of it away
    os.replace(part, _real_path(path))


def remove_part(part: Path) -> None:
    """Remove a temporary file, or folder of files, if it still exists."""
    with suppress(OSError):
        if part.is_dir():
            shutil.rmtree(part)
        else:
            part.unlink()


def unwritable_reason(path: Path) -> str | None:
    """The reason why `path` cannot be written, found by trying its folder; None when it can."""
    target = _real_path(path)
    part = temporary_path(target)
    try:
        if not target.parent.is_dir():
            return f"there is no directory `{_link_target(path).parent}`"
        _existing_mode(path)
        os.close(os.open(part, _CREATE_FLAGS, _DEFAULT_MODE))
        part.unlink()
    except OSError as failure:
        return os_error_reason(failure)
    return None


def os_error_reason(failure: OSError) -> str:
    """Return the reason of a failure, as part of a sentence."""
    return (failure.strerror or "unknown reason").lower()


def _existing_mode(path: Path) -> int | None:
    """The mode of the file that is to be replaced, None where there is none yet.

    Raises OSError for what must not be replaced.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a directory")
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is not a regular file")
    # The system asks root for no permission; a file that nobody may write is kept all the same.
    if not mode & (stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH) or not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, "it is read-only")
    return stat.S_IMODE(mode)


def _real_path(path: Path) -> Path:
    return Path(os.path.realpath(path))


def _link_target(path: Path) -> Path:
    """The path that links lead to, in the words of the user and of the links."""
    for _ in range(_MAX_SYMLINKS):
        if not path.is_symlink():
            break
        path = path.parent / path.readlink()
    return path


def temporary_path(target: Path) -> Path:
    """Return a new hidden name in the folder of a file, for what will take its place."""
    token = f"{os.getpid()}-{_machine()}-{os.urandom(4).hex()}"
    return target.with_name(f".{target.name[:50]}.{token}.part")


_PART_NAME = re.compile(r"\..+\.([0-9]+)-([0-9a-f]{8})-[0-9a-f]{8}\.part", re.DOTALL)


def remove_stale_parts(folder: Path) -> None:
    """Remove the temporary files that killed programs of this machine have left in a folder."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            match = _PART_NAME.fullmatch(entry.name)
            if match and match[2] == _machine() and not _is_running(int(match[1])):
                remove_part(Path(entry.path))


@cache
def _machine() -> str:
    """Return 8 digits for the machine, or the container, whose process numbers are ours."""
    space = ""
    with suppress(OSError):
        space = os.readlink("/proc/self/ns/pid")
    return f"{crc32(f'{platform.node()} {space}'.encode()):08x}"


def _is_running(process: int) -> bool:
    """Return whether a process may be running; True where that cannot be found out."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        pass
    return True
