"""Tokens of a figure file: names, numbers with their units, strings and marks; its keywords."""

import re
import unicodedata
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final

from generator.diagnostics import Diagnostics, Source, Span, TooManyErrors, shorten

CHILD_BLOCKS: Final[dict[str, tuple[str, ...]]] = {
    "figure": ("attribute", "segment", "joint"),
    "attribute": (),
    "segment": ("site",),
    "site": (),
    "joint": (),
}
"""For each kind of block, the blocks that may stand in it."""

BLOCK_FIELDS: Final[dict[str, tuple[str, ...]]] = {
    "figure": ("root",),
    "attribute": (),
    "segment": ("psurf", "attribute", "mass", "inertia", "contact"),
    "site": ("location", "globalforce", "localforce", "globalmoment", "localmoment"),
    "joint": (
        "connect",
        "type",
        "displacement",
        "stiff",
        "rest",
        "damp",
        "llimit",
        "ulimit",
        "follow",
    ),
}
"""For each kind of block, its fields. An attribute's fields are free."""

KEYWORDS: Final = frozenset(CHILD_BLOCKS) | frozenset(
    word for words in BLOCK_FIELDS.values() for word in words
)
"""Every word with a meaning of its own; one of them at the start of a line begins a statement."""


def keywords_in(kind: str) -> tuple[str, ...]:
    """All words that may begin a statement in a block of this kind."""
    return (*BLOCK_FIELDS[kind], *CHILD_BLOCKS[kind])


def field_parent(word: str) -> str | None:
    """The kind of block in which the field `word` stands, if it is one."""
    return next((kind for kind, words in BLOCK_FIELDS.items() if word in words), None)


def block_parent(word: str) -> str | None:
    """The kind of block in which blocks of the kind `word` stand, if it is one."""
    return next((kind for kind, words in CHILD_BLOCKS.items() if word in words), None)


MAX_WORD_LENGTH = 200
"""Longest name, number or string that is read."""

MAX_TOKENS = 200_000
"""A figure of a thousand segments stays below this; so many are read in about a second."""


class TokenKind(Enum):
    """Kind of a token; the value is its name in a sentence."""

    NAME = "a name"
    NUMBER = "a number"
    STRING = "a string"
    MARK = "a mark"
    END = "the end of the file"


@dataclass(frozen=True, slots=True)
class Token:
    """One word. `text` is what it says: a string without its quotes, a number without its unit.

    `unit` is the unit glued to a number. `starts_line` tells whether it is the first of its line.
    """

    kind: TokenKind
    text: str
    start: int
    end: int
    unit: str = ""
    starts_line: bool = False

    def is_mark(self, mark: str) -> bool:
        """Return whether it is this mark."""
        return self.kind is TokenKind.MARK and self.text == mark

    def is_name(self, name: str) -> bool:
        """Return whether it is this name."""
        return self.kind is TokenKind.NAME and self.text == name

    def __str__(self) -> str:
        """As a sentence names it."""
        match self.kind:
            case TokenKind.END:
                return self.kind.value
            case TokenKind.STRING:
                return f'`"{shorten(self.text)}"`'
            case _:
                return f"`{shorten(self.text + self.unit)}`"


# Without possessive repetitions, on groups of which the `re` of Python 3.11.2 fails.
_BLANK = re.compile(r"(?:[ \t\r\n\f\v]+|#[^\n]*|/\*.*?\*/)*", re.DOTALL)

_BLANK_LINES = re.compile(r"(?:[ \t\r\n\f\v]+|#[^\n]*|/\*[^\n]*)*")
"""Blanks once it is known that no more comments are closed: `/*` then counts to the line's end."""

_TOKEN = re.compile(
    r"""
      (?P<number> [+-]? \.? [0-9] (?: [\w.] | (?<=[0-9.][eE]) [+-] (?=[0-9]) )* )
    | (?P<name>   [^\W0-9]\w* )
    | (?P<string> "[^"\n]*" )
    | (?P<mark>   -> | [{}();,=*./] )
    | (?P<bracket> [][] )
    | (?P<quote>  "[^\n]* )
    | (?P<signed> [+-]\w+ )
    | (?P<odd>    [^\w\s{}();,=*./"\#[\]]+ | . )
    """,
    re.VERBOSE | re.DOTALL,
)
_NUMBER = re.compile(
    r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)([A-Za-z][A-Za-z0-9]*)?"
)

_KINDS = {"name": TokenKind.NAME, "mark": TokenKind.MARK}

_PLACEHOLDERS = {
    "name": (TokenKind.NAME, "_"),
    "number": (TokenKind.NUMBER, "0"),
    "signed": (TokenKind.NUMBER, "0"),
    "string": (TokenKind.STRING, ""),
    "quote": (TokenKind.STRING, ""),
}
"""Token that replaces a word that is too long."""


def tokenize(source: Source, diagnostics: Diagnostics) -> Iterator[Token]:
    """The tokens of `source` one by one, the last being the end; errors go to `diagnostics`.

    Comments run from `#` to the end of the line or stand between `/*` and `*/`. What cannot be
    read is reported and left out. Raises TooManyErrors where it gives up.
    """
    text, position, line_end, count, blank = source.text, 0, -1, 0, _BLANK
    while True:
        if match := blank.match(text, position):
            position = match.end()
        if text.startswith("/*", position):
            diagnostics.syntax_error(
                "this comment is never closed",
                Span(source, position, position + 2),
                "a comment that starts with `/*` ends with `*/`",
            )
            blank = _BLANK_LINES
            continue
        match = _TOKEN.match(text, position)
        if match is None:
            break
        count += 1
        if count > MAX_TOKENS:
            diagnostics.syntax_error(
                f"the file is too long: it has more than {MAX_TOKENS:,} words and marks",
                Span(source, position, position + 1),
                "a figure of a thousand segments is shorter; reading stopped here",
            )
            raise TooManyErrors
        new_line = position > line_end
        if new_line:
            found = text.find("\n", position)
            line_end = len(text) if found == -1 else found
        token = _make_token(source, match, new_line, diagnostics)
        position = token.end if token else match.end()
        if token is not None:
            yield token
    yield Token(TokenKind.END, "", position, position, starts_line=True)


def _make_token(
    source: Source, match: re.Match[str], starts_line: bool, diagnostics: Diagnostics
) -> Token | None:
    """The token of one match, or None after reporting what is wrong with it."""
    group, word = match.lastgroup or "", match.group()
    start, end = match.span()
    if len(word) > MAX_WORD_LENGTH and group != "odd":
        diagnostics.syntax_error(
            f"a word of {len(word):,} characters",
            Span(source, start, start + 1),
            f"the longest that is read has {MAX_WORD_LENGTH}",
        )
        kind, value = _PLACEHOLDERS[group]
        return Token(kind, value, start, end, starts_line=starts_line)
    match group:
        case "name" | "mark":
            if not word.isascii():
                diagnostics.syntax_error(
                    f"`{shorten(word)}` has characters that a name cannot have",
                    Span(source, start, end),
                    "a name is made of the letters a-z and A-Z, digits and `_`",
                )
            return Token(_KINDS[group], word, start, end, starts_line=starts_line)
        case "number":
            return _make_number(Span(source, start, end), word, starts_line, diagnostics)
        case "string":
            return Token(TokenKind.STRING, word[1:-1], start, end, starts_line=starts_line)
        case "quote":
            diagnostics.syntax_error(
                "this string is never closed", Span(source, start, start + 1), 'add the closing `"`'
            )
            value = word[1:].rstrip().removesuffix(";")
            return Token(
                TokenKind.STRING, value, start, start + 1 + len(value), starts_line=starts_line
            )
        case "bracket":
            diagnostics.syntax_error(
                f"`{word}` is not part of the language",
                Span(source, start, end),
                "lists stand in round brackets: `(1, 2, 3)`",
            )
            mark = "(" if word == "[" else ")"
            return Token(TokenKind.MARK, mark, start, end, starts_line=starts_line)
        case "signed":
            diagnostics.syntax_error(
                f"`{shorten(word)}` is not a number",
                Span(source, start, end),
                "a number is finite and written in digits",
            )
            return Token(TokenKind.NUMBER, "0", start, end, starts_line=starts_line)
        case _:
            diagnostics.syntax_error(
                f"{_describe_characters(word)} is not part of the language",
                Span(source, start, end),
                _odd_hint(word),
            )
            return None


def _make_number(span: Span, word: str, starts_line: bool, diagnostics: Diagnostics) -> Token:
    """A number with the unit glued to it."""
    parts = _NUMBER.fullmatch(word)
    if parts is None:
        diagnostics.syntax_error(
            f"`{shorten(word)}` is not a number",
            span,
            "a number looks like `12`, `-0.5` or `1.5e-3`, a unit may follow: `12cm`",
        )
        return Token(TokenKind.NUMBER, "0", span.start, span.end, starts_line=starts_line)
    return Token(
        TokenKind.NUMBER,
        parts[1],
        span.start,
        span.end,
        unit=parts[2] or "",
        starts_line=starts_line,
    )


def _describe_characters(word: str) -> str:
    """Name of unknown characters in a sentence."""
    char = word[0]
    if char.isprintable():
        return f"`{shorten(word)}`"
    name = unicodedata.name(char, "a control character")
    return f"the character U+{ord(char):04X} ({name.lower()})"


def _odd_hint(word: str) -> str:
    """Hint for unknown characters."""
    first = word[0]
    if first in "'\u2018\u2019\u201c\u201d`":
        return 'strings stand in straight double quotes: `"floor.pss"`'
    if first in "-+":
        return "the language has no sums; `site NAME->FIELD` is written with `->`"
    if first in "\u00b0\u00ba":
        return "degrees are written `deg`"
    if first == "^":
        return "a power follows its unit directly: `m2`"
    return ""


MAX_BRACE_DEPTH = 32
"""Deepest nesting of braces that is read; the grammar has three levels."""


class TokenStream:
    """Tokens with look-ahead, and recovery after errors."""

    def __init__(self, source: Source, diagnostics: Diagnostics) -> None:
        """Start at the first token; the text is cut into tokens only as far as it is read."""
        self.source = source
        self.diagnostics = diagnostics
        self._tokens: Iterator[Token] = tokenize(source, diagnostics)
        self._lookahead: deque[Token] = deque([next(self._tokens)])
        self._last: Token | None = None

    @property
    def current(self) -> Token:
        """The next token, not yet taken."""
        return self._lookahead[0]

    def peek(self, count: int) -> Token:
        """The token `count` places after the next; the end token stands for all after it."""
        while len(self._lookahead) <= count and self._lookahead[-1].kind is not TokenKind.END:
            self._lookahead.append(next(self._tokens))
        return self._lookahead[min(count, len(self._lookahead) - 1)]

    def take(self) -> Token:
        """The next token, taken; the end is never taken."""
        if len(self._lookahead) == 1:
            self.peek(1)
        self._last = self._lookahead.popleft()
        return self._last

    def take_mark(self, mark: str) -> Token | None:
        """The next token if it is this mark, taken; otherwise None and nothing is taken."""
        return self.take() if self.current.is_mark(mark) else None

    def span(self, token: Token) -> Span:
        """Span of a token."""
        return Span(self.source, token.start, token.end)

    def last_character_span(self) -> Span:
        """Span of the last character that was taken, where a missing token belongs."""
        end = self._last.end if self._last else 0
        return Span(self.source, max(0, end - 1), end)

    def expect(self, mark: str, after: str) -> bool:
        """Take `mark`; when it is not there, report it behind the last token and return False."""
        if self.take_mark(mark):
            return True
        self.diagnostics.syntax_error(
            f"`{mark}` is missing after {after}",
            self.last_character_span(),
            f"found {self.current} instead",
        )
        return False

    @property
    def is_at_statement(self) -> bool:
        """Return whether the next token looks like the start of a statement."""
        return (
            self.current.starts_line
            and self.current.kind is TokenKind.NAME
            and self.current.text in KEYWORDS
        )

    def skip_statement(self) -> None:
        """Pass over the rest of a statement that could not be read, its `;` included."""
        while self.current.kind is not TokenKind.END and not self.current.is_mark("}"):
            if self.current.is_mark("{"):
                self.skip_block()
                return
            if self.is_at_statement:
                return
            if self.take().is_mark(";"):
                return

    def skip_block(self) -> None:
        """Pass over `{ ... }` with all that is in it. Raises TooManyErrors when it is too deep."""
        depth, opening = 0, self.current
        while self.current.kind is not TokenKind.END:
            token = self.take()
            if token.is_mark("{"):
                depth += 1
            elif token.is_mark("}"):
                depth -= 1
            if depth > MAX_BRACE_DEPTH:
                self.diagnostics.syntax_error(
                    f"braces nested more than {MAX_BRACE_DEPTH} deep",
                    self.span(token),
                    f"a figure has at most three levels; the outermost of these stands in "
                    f"line {self.span(opening).line}; reading stopped here",
                )
                raise TooManyErrors
            if depth == 0:
                return
