"""From the bytes of a file to a text, or to the fault that says why it is none."""

import codecs
from pathlib import Path

from generator.errors import Fault, error
from generator.source import Source, Span

LARGEST = 32_000_000
"""Bytes of the largest file that is read: a device without end must not be read for ever."""

_WIDE_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def read_text(path: Path, name: str) -> tuple[Source, Fault | None]:
    """The text of the file at `path` under the `name` that the user knows, and what is wrong.

    UTF-8 with or without a byte-order mark; all three ends of line are read as one.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)
    except IsADirectoryError:
        return Source(name, ""), error(f"`{name}` is a directory, not a file")
    except OSError as failure:
        reason = (failure.strerror or "unknown reason").lower()
        return Source(name, ""), error(f"`{name}` cannot be read: {reason}")
    if len(data) > LARGEST:
        return Source(name, ""), error(f"`{name}` is larger than {LARGEST // 1_000_000} MB")
    data = data.removeprefix(codecs.BOM_UTF8)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as failure:
        return _not_utf8(data, name, failure.start)
    source = Source(name, unified(text))
    zero = source.text.find("\0")
    if zero != -1:
        return source, error(
            "this is a binary file, not a text", Span(source, zero, zero + 1), "found a zero byte"
        )
    return source, None


def unified(text: str) -> str:
    r"""`text` with every end of line (`\r\n`, `\r`, `\n`) written as `\n`."""
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _not_utf8(data: bytes, name: str, place: int) -> tuple[Source, Fault]:
    """The fault of a file that is not UTF-8, at its first such byte."""
    if data.startswith(_WIDE_MARKS):
        source = Source(name, unified(data.decode("utf-16", errors="replace")))
        return source, error("this file is UTF-16", Span(source, 0, 1), "save it as UTF-8")
    before = unified(data[:place].decode("utf-8"))
    source = Source(name, before + unified(data[place:].decode("latin-1")))
    byte = data[place]
    return source, error(
        f"byte 0x{byte:02X} is not UTF-8",
        Span(source, len(before), len(before) + 1),
        f"save the file as UTF-8; in Latin-1 this byte is `{chr(byte)}`"
        if chr(byte).isprintable()
        else "the file should be a text in UTF-8",
    )
