"""Spans of the keys of a TOML text, which `tomllib` does not return.

The text is known to be TOML: only headers and `key =` are searched for. The keys of an inline table
`KEY = {...}` in `[TABLE]` are those of `TABLE.KEY`, as below a header `[TABLE.KEY]`; in a list
of inline tables they have the span of their table.
"""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import takewhile

from generator.diagnostics import Source, Span

_TOKEN = re.compile(
    r'''
      (?P<blank>   [ \t\r]++ | \#[^\n]*+ )
    | (?P<newline> \n )
    | (?P<string>  """ (?: [^\\] | \\. )*? "{3,5} | \'\'\' .*? '{3,5}
                 | " (?: [^"\\\n] | \\. )*+ " | ' [^'\n]*+ ' )
    | (?P<mark>    [\[\]{}=,] )
    | (?P<word>    [^\s\#"'\[\]{}=,]++ )
    ''',
    re.VERBOSE | re.DOTALL,
)


@dataclass(frozen=True)
class _Token:
    kind: str
    span: Span

    def is_mark(self, mark: str) -> bool:
        return self.kind == "mark" and self.span.text == mark


@dataclass
class TomlSpans:
    """Spans of the tables and keys of one text; `index` counts the `[[table]]` of one name."""

    source: Source
    headers: dict[tuple[str, int], Span] = field(default_factory=dict[tuple[str, int], Span])
    keys: dict[tuple[str, int, str], Span] = field(default_factory=dict[tuple[str, int, str], Span])
    values: dict[tuple[str, int, str], Span] = field(
        default_factory=dict[tuple[str, int, str], Span]
    )
    items: dict[tuple[str, int, str], list[Span]] = field(
        default_factory=dict[tuple[str, int, str], list[Span]]
    )
    parts: dict[tuple[str, int, str, int], list[Span]] = field(
        default_factory=dict[tuple[str, int, str, int], list[Span]]
    )

    def table(self, name: str, index: int = 0) -> Span:
        """The header of a table; of the whole text, named "", the first character."""
        start = Span(self.source, 0, 1)
        return self.headers.get((name, index)) or self.values.get(("", 0, name)) or start

    def key(self, table: str, index: int, key: str) -> Span:
        """A key, or its header where it is a table, or the table that it is in."""
        header = self.headers.get((key, 0)) if not table else None
        return self.keys.get((table, index, key)) or header or self.table(table, index)

    def value(
        self, table: str, index: int, key: str, item: int | None = None, part: int | None = None
    ) -> Span:
        """A value, or one item of an array, or one part of an item, or else the key's place."""
        place = (table, index, key)
        if item is not None and part is not None:
            parts = self.parts.get((*place, item), [])
            if part < len(parts):
                return parts[part]
        items = self.items.get(place, [])
        if item is not None and item < len(items):
            return items[item]
        return self.values.get(place) or self.key(table, index, key)


def locate_keys(source: Source) -> TomlSpans:
    """Locate all tables and keys of a text that is known to be TOML."""
    places = TomlSpans(source)
    table, index = "", 0
    count: Counter[str] = Counter()
    for statement in _statements(source):
        if statement[0].is_mark("["):
            names = _key_parts(statement)
            span = statement[0].span.extend_to(statement[-1].span)
            if len(names) > 1:  # a table within a table counts as a key of the outer one
                outer = max(count[names[0]] - 1, 0)
                places.keys.setdefault((names[0], outer, names[1]), span)
                table, index = ".".join(names), 0
                places.headers.setdefault((table, index), span)
                continue
            table, index = names[0], count[names[0]]
            count[table] += 1
            places.headers[table, index] = span
            continue
        _locate_entry(places, table, index, statement)
    return places


def _locate_entry(places: TomlSpans, table: str, index: int, tokens: list[_Token]) -> None:
    """Locate a `key = value`, and those in its value."""
    head = list(takewhile(lambda token: not token.is_mark("="), tokens))
    names, value = _key_parts(head), tokens[len(head) + 1 :]
    for name in names:  # a dotted key is a key of each table that it names
        place = (table, index, name)
        places.keys.setdefault(place, _span(head))
        places.values.setdefault(place, _span(value))
        if value[0].is_mark("["):
            items = list(_items(value[1:-1]))
            places.items.setdefault(place, [_span(item) for item in items])
            for k, item in enumerate(items):
                if item[0].is_mark("["):
                    parts = [_span(part) for part in _items(item[1:-1])]
                    places.parts.setdefault((*place, k), parts)
        table, index = f"{table}.{name}" if table else name, 0
    if value[0].is_mark("{"):
        places.headers.setdefault((table, index), _span(value))
        for item in _items(value[1:-1]):
            _locate_entry(places, table, index, item)


def _tokens(source: Source) -> Iterator[_Token]:
    for match in _TOKEN.finditer(source.text):
        if match.lastgroup != "blank":
            yield _Token(match.lastgroup or "", Span(source, match.start(), match.end()))


def _statements(source: Source) -> Iterator[list[_Token]]:
    """The tokens of each header and each `key = value`, without the ends of lines."""
    statement: list[_Token] = []
    depth = 0
    for token in _tokens(source):
        if token.kind == "newline":
            if depth == 0 and statement:
                yield statement
                statement = []
            continue
        depth += _depth_change(token)
        statement.append(token)
    if statement:
        yield statement


def _depth_change(token: _Token) -> int:
    opening = token.is_mark("[") or token.is_mark("{")
    return 1 if opening else -1 if token.is_mark("]") or token.is_mark("}") else 0


def _span(tokens: list[_Token]) -> Span:
    return tokens[0].span.extend_to(tokens[-1].span)


def _items(tokens: list[_Token]) -> Iterator[list[_Token]]:
    """The tokens between the commas of an array."""
    depth = 0
    item: list[_Token] = []
    for token in tokens:
        if token.is_mark(",") and depth == 0:
            yield item
            item = []
            continue
        depth += _depth_change(token)
        item.append(token)
    if item:
        yield item


def _key_parts(tokens: list[_Token]) -> list[str]:
    """The names of a dotted key or a header."""
    parts: list[str] = []
    for token in tokens:
        if token.kind == "string":
            parts.append(token.span.text[1:-1])
        elif token.kind == "word":
            parts += [part for part in token.span.text.split(".") if part]
    return parts
