"""The grammar: from tokens to the syntax tree of one figure.

    file      := "figure" NAME? "{" statement* "}"
    statement := block | arrow | connect | field
    block     := ("attribute" | "segment" | "joint" | "site") NAME "{" statement* "}"
    arrow     := "site" NAME "->" field
    connect   := "connect" NAME "." NAME "to" NAME "." NAME ";"
    field     := NAME "=" value ";"

Nesting of blocks is limited by their kinds, so the recursion has three levels. After an error the
parser continues at the next statement, so that all errors are reported at once. Values:

    value   := term ("*" term)*
    term    := NUMBER unit? | STRING | NAME | NAME "." NAME | NAME list | list
    list    := "(" (item ("," item)*)? ")"
    item    := NUMBER unit? | STRING | NAME | NAME flat
    flat    := "(" (simple ("," simple)*)? ")"
    simple  := NUMBER unit? | STRING | NAME
    unit    := NAME+ ("/" NAME+)?

The first word of a unit may be glued to the number. Lists hold calls, whose arguments are simple:
so nothing recurses.
"""

from dataclasses import dataclass

from generator.diagnostics import Diagnostics, Source, Span, closest_match, shorten, spelling_hint
from generator.figure_file.lexer import (
    CHILD_BLOCKS,
    Token,
    TokenKind,
    TokenStream,
    block_parent,
    field_parent,
    keywords_in,
)
from generator.units import is_unit_word


@dataclass(frozen=True, slots=True)
class Word:
    """A bare name."""

    text: str
    span: Span


@dataclass(frozen=True, slots=True)
class String:
    """A string in quotes."""

    text: str
    span: Span


@dataclass(frozen=True, slots=True)
class Number:
    """A number as written, and its unit as written (`N m/rad`; empty without one)."""

    text: str
    unit: str
    span: Span
    unit_span: Span


@dataclass(frozen=True, slots=True)
class SiteReference:
    """`segment.site`."""

    segment: Word
    site: Word
    span: Span


@dataclass(frozen=True, slots=True)
class ItemList:
    """`(a, b, c)`."""

    items: tuple["Number | Word | String | Call", ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Call:
    """`name(a, b, c)`."""

    name: Word
    arguments: ItemList
    span: Span


@dataclass(frozen=True, slots=True)
class Product:
    """`a * b * c`, two factors or more."""

    factors: tuple["Call | Number | Word | String | SiteReference | ItemList", ...]
    span: Span


ValueTerm = Call | Number | Word | String | SiteReference | ItemList
Value = ValueTerm | Product


@dataclass(frozen=True, slots=True)
class Field:
    """`name = value;`. The value is None when it could not be read."""

    name: Word
    value: Value | None


@dataclass(frozen=True, slots=True)
class Connect:
    """`connect a.s to b.t;`."""

    name: Word
    parent: SiteReference
    child: SiteReference
    span: Span


@dataclass(frozen=True, slots=True)
class Block:
    """`kind name { ... }`, or `site name->field = value;` as a block of one field.

    `opening` is the brace, None where there is none.
    """

    kind: Word
    name: Word | None
    body: tuple["Statement", ...]
    opening: Span | None


Statement = Field | Connect | Block


MAX_UNIT_WORDS = 9
"""Most words and slashes in a unit."""

Item = Number | Word | String


def parse_value(stream: TokenStream, after: str) -> Value | None:
    """`term ("*" term)*`; None, with an error reported, if it cannot be read."""
    factors: list[ValueTerm] = []
    while True:
        term = _term(stream, after)
        if term is None:
            return None
        factors.append(term)
        if not stream.current.is_mark("*"):
            break
        stream.take()
        after = "`*`"
    if len(factors) == 1:
        return factors[0]
    return Product(tuple(factors), factors[0].span.extend_to(factors[-1].span))


def _term(stream: TokenStream, after: str) -> ValueTerm | None:
    """One factor of a value."""
    here = stream.current
    if here.is_mark("("):
        return _items(stream)
    if here.kind is TokenKind.NAME and stream.peek(1).is_mark("("):
        return _call(stream)
    if here.kind is TokenKind.NAME and stream.peek(1).is_mark("."):
        segment = _word(stream)
        dot = stream.take()
        if stream.current.kind is not TokenKind.NAME:
            stream.diagnostics.syntax_error(
                "the name of a site is missing after `.`",
                stream.span(dot),
                f"found {stream.current}",
            )
            return None
        site = _word(stream)
        return SiteReference(segment, site, segment.span.extend_to(site.span))
    return _item(stream, after)


def _call(stream: TokenStream) -> Call | None:
    """`NAME flat`."""
    name = _word(stream)
    arguments = _items(stream, with_calls=False)
    return arguments and Call(name, arguments, name.span.extend_to(arguments.span))


def _items(stream: TokenStream, *, with_calls: bool = True) -> ItemList | None:
    """`"(" (item ("," item)*)? ")"`, or a flat list of simple items."""
    opening = stream.take()
    items: list[Item | Call] = []
    while not stream.current.is_mark(")") or items:
        is_call = stream.current.kind is TokenKind.NAME and stream.peek(1).is_mark("(")
        after = "`,`" if items else "`(`"
        item = _call(stream) if with_calls and is_call else _item(stream, after)
        if item is None:
            return None
        items.append(item)
        if stream.current.is_mark(")"):
            break
        if stream.current.is_mark(";"):
            stream.expect(")", "the last value of this list")
            return ItemList(tuple(items), stream.span(opening).extend_to(items[-1].span))
        if not stream.expect(",", "this value") and not _begins_item(stream.current):
            return None
    closing = stream.take()
    return ItemList(tuple(items), stream.span(opening).extend_to(stream.span(closing)))


def _begins_item(token: Token) -> bool:
    return (
        token.kind in (TokenKind.NUMBER, TokenKind.STRING, TokenKind.NAME) and not token.starts_line
    )


def _item(stream: TokenStream, after: str) -> Item | None:
    """`NUMBER unit? | STRING | NAME`; None, with an error reported, if it is something else."""
    here = stream.current
    match here.kind:
        case TokenKind.NUMBER:
            return _number(stream)
        case TokenKind.NAME if not stream.is_at_statement:
            return _word(stream)
        case TokenKind.STRING:
            stream.take()
            return String(here.text, stream.span(here))
        case _:
            stream.diagnostics.syntax_error(
                f"a value is missing after {after}",
                stream.last_character_span() if here.starts_line else stream.span(here),
                f"found {here} instead",
            )
            return None


def _number(stream: TokenStream) -> Number:
    """`NUMBER unit?`, where a unit is `NAME+ ("/" NAME+)?` on the same line."""
    token = stream.take()
    span = stream.span(token)
    words = [token.unit] if token.unit else []
    unit_start = token.end - len(token.unit)
    while len(words) < MAX_UNIT_WORDS and _continues_unit(stream):
        part = stream.take()
        unit_start = unit_start if words else part.start
        words.append(part.text)
        span = span.extend_to(stream.span(part))
    unit_span = Span(span.source, unit_start, span.end)
    return Number(token.text, " ".join(words).replace(" / ", "/"), span, unit_span)


def _continues_unit(stream: TokenStream) -> bool:
    """Return whether the next token belongs to the unit of the number before it."""
    here, after = stream.current, stream.peek(1)
    if here.starts_line:
        return False
    if here.is_mark("/"):
        return after.kind is TokenKind.NAME
    if here.kind is not TokenKind.NAME:
        return False
    return is_unit_word(here.text) or any(after.is_mark(mark) for mark in (",", ")", ";", "/"))


def _word(stream: TokenStream) -> Word:
    token = stream.take()
    return Word(token.text, stream.span(token))


def parse_figure_block(source: Source, diagnostics: Diagnostics) -> Block | None:
    """The figure block of `source`; None when there is none.

    Raises TooManyErrors when too much is wrong to go on.
    """
    return _Parser(source, diagnostics).file()


def parse_statements(source: Source, diagnostics: Diagnostics) -> Block:
    """The statements of a text that stands for the inside of a figure block: `statement*`.

    Raises TooManyErrors when too much is wrong to go on.
    """
    return _Parser(source, diagnostics).fragment()


class _Parser:
    """Recursive descent over the blocks. `_open_blocks` are the blocks around the present place."""

    def __init__(self, source: Source, diagnostics: Diagnostics) -> None:
        self._stream = TokenStream(source, diagnostics)
        self._diagnostics = diagnostics
        self._open_blocks: list[tuple[str, str]] = []
        self._closing_hint, self._closed_kind = "", ""

    def file(self) -> Block | None:
        """`"figure" NAME? "{" statement* "}"` and then the end."""
        stream = self._stream
        first = stream.current
        if first.kind is TokenKind.END:
            self._diagnostics.syntax_error(
                "there is no figure in this file", stream.span(first), "it starts with `figure {`"
            )
            return None
        if not first.is_name("figure"):
            loose = first.kind is TokenKind.NAME and first.text in keywords_in("figure")
            self._diagnostics.syntax_error(
                f"a figure file starts with `figure {{`, not with {first}",
                stream.span(first),
                "all blocks stand in `figure { ... }`" if loose else _figure_hint(first),
            )
            if loose:
                return self._rest_of_file(Block(Word("figure", stream.span(first)), None, (), None))
            opens = 2 if stream.peek(1).kind is TokenKind.NAME else 1
            if first.kind is not TokenKind.NAME or not stream.peek(opens).is_mark("{"):
                return None
        figure = self._block()
        return figure and self._rest_of_file(figure)

    def fragment(self) -> Block:
        """`statement*` and then the end, as the body of a figure without a name."""
        first = self._stream.current
        body = Block(Word("figure", self._stream.span(first)), None, (), None)
        if first.is_name("figure"):
            self._diagnostics.syntax_error(
                "this is a whole figure, not blocks of one",
                self._stream.span(first),
                "leave out `figure {` and its `}`",
            )
            return body
        return self._rest_of_file(body)

    def _rest_of_file(self, figure: Block) -> Block:
        """Report statements after the figure's `}` and read them as part of the figure."""
        stream, strays = self._stream, list[Statement]()
        is_reported = figure.opening is None
        self._open_blocks.append(("figure", ""))
        while stream.current.kind is not TokenKind.END:
            here = stream.current
            if here.is_mark("}"):
                self._diagnostics.syntax_error(
                    "this `}` closes nothing", stream.span(here), self._closing_hint
                )
                stream.take()
                continue
            if not is_reported:
                is_reported = True
                self._diagnostics.syntax_error(
                    f"{here} stands after the end of the figure",
                    stream.span(here),
                    self._closing_hint,
                )
            statement = self._statement("figure")
            if statement:
                strays.append(statement)
        return Block(figure.kind, figure.name, (*figure.body, *strays), figure.opening)

    def _block(self) -> Block | None:
        """`KIND NAME "{" statement* "}"`; the name of a figure may be left out."""
        stream = self._stream
        kind = self._word()
        name = (
            self._name(kind)
            if stream.current.kind is TokenKind.NAME
            else self._parse_unusual_name(kind)
        )
        known = kind.text if kind.text in CHILD_BLOCKS else "figure"
        title = shorten(f"{kind.text} {name.text}" if name else kind.text)
        opening = stream.current
        if not stream.expect("{", f"`{title}`") and not (
            stream.is_at_statement and opening.text in keywords_in(known)
        ):
            stream.skip_statement()
            return None
        span = stream.span(opening) if opening.is_mark("{") else kind.span
        self._open_blocks.append((known, title))
        body: list[Statement] = []
        while not stream.current.is_mark("}"):
            if stream.current.kind is TokenKind.END or self._belongs_outside(known, title, span):
                closing = None
                break
            statement = self._statement(known)
            if statement:
                body.append(statement)
        else:
            closing = stream.span(stream.take())
            self._closing_hint = (
                f"the `}}` in line {closing.line} closed the `{{` of `{title}` in line {span.line}"
            )
            self._closed_kind = known
        self._open_blocks.pop()
        if closing is None and stream.current.kind is TokenKind.END:
            self._diagnostics.syntax_error(
                f"the `{{` of `{title}` is never closed", span, self._closing_hint
            )
        return Block(kind, name, tuple(body), span)

    def _parse_unusual_name(self, kind: Word) -> Word | None:
        """Parse a block without a bare name: an error, except for a figure."""
        if self._stream.current.kind in (TokenKind.STRING, TokenKind.NUMBER):
            return self._name(kind)
        if kind.text != "figure":
            self._diagnostics.syntax_error(f"this {kind.text} has no name", kind.span)
        return None

    def _name(self, kind: Word) -> Word:
        """The name of a block; a string or a number in its place is an error."""
        token = self._stream.take()
        span = self._stream.span(token)
        if token.kind is not TokenKind.NAME:
            self._diagnostics.syntax_error(
                f"{token} cannot be the name of a {kind.text}",
                span,
                "a name has letters, digits and `_`, does not start with a digit, "
                "and has no quotes",
            )
        return Word(token.text + token.unit, span)

    def _belongs_outside(self, kind: str, title: str, opening: Span) -> bool:
        """Return whether a block starts here that belongs further out; report the missing `}`."""
        here = self._stream.current
        if (
            here.kind is not TokenKind.NAME
            or here.text not in CHILD_BLOCKS
            or here.text in keywords_in(kind)
        ):
            return False
        if self._stream.peek(1).is_mark("="):
            return False
        if not any(here.text in CHILD_BLOCKS[around] for around, _ in self._open_blocks[:-1]):
            return False
        self._diagnostics.syntax_error(
            f"`{here.text}` cannot stand in `{title}`",
            self._stream.span(here),
            f"is a `}}` missing before it? The `{{` of `{title}` in line {opening.line} is open",
        )
        return True

    def _statement(self, kind: str) -> Statement | None:
        """One statement of a block of this kind; None when it could not be read."""
        stream = self._stream
        here, after = stream.current, stream.peek(1)
        if here.kind is not TokenKind.NAME:
            return self._report_non_statement(here)
        if here.text == "connect" and not after.is_mark("="):
            return self._check_placement(here, kind, self._connect())
        if after.is_mark("="):
            return self._check_placement(here, kind, self._field())
        if (
            here.text == "site"
            and after.kind is not TokenKind.MARK
            and stream.peek(2).is_mark("->")
        ):
            return self._check_placement(here, kind, self._arrow())
        if here.text in CHILD_BLOCKS[kind]:
            return self._block()
        stream.take()
        if after.is_mark("{") or stream.peek(1).is_mark("{"):
            self._diagnostics.syntax_error(
                f"unknown block {here} in a {kind}",
                stream.span(here),
                _placement_hint(here.text, kind),
            )
        else:
            self._diagnostics.syntax_error(
                f"`=` is missing after {here}"
                if field_parent(here.text)
                else f"{here} begins nothing",
                stream.span(here),
                f"a field is written `{shorten(here.text)} = VALUE;`"
                if field_parent(here.text)
                else _placement_hint(here.text, kind),
            )
        stream.skip_statement()
        return None

    def _check_placement(self, first: Token, kind: str, read: Statement | None) -> Statement | None:
        """Return the statement if a block of this kind may hold it; else report it and return None.

        Words that mean nothing anywhere are left to the next step, which knows what is near.
        """
        home = "segment" if isinstance(read, Block) else field_parent(first.text)
        if read is None or home is None or kind == "attribute" or first.text in keywords_in(kind):
            return read
        hint = f"it belongs in a {home}"
        self._diagnostics.syntax_error(
            f"`{first.text}` cannot stand in a {kind}",
            self._stream.span(first),
            f"{hint}; {self._closing_hint}" if home == self._closed_kind else hint,
        )
        return None

    def _report_non_statement(self, here: Token) -> None:
        """Report and skip what does not begin a statement."""
        if here.is_mark(";"):
            self._stream.take()  # an empty statement says nothing and harms nothing
            return
        self._diagnostics.syntax_error(
            f"{here} cannot begin a statement",
            self._stream.span(here),
            "a block needs a kind and a name before its `{`" if here.is_mark("{") else "",
        )
        if not here.is_mark("{"):
            self._stream.take()
        self._stream.skip_statement()

    def _arrow(self) -> Block:
        """`"site" NAME "->" field`."""
        kind = self._word()
        name = self._name(kind)
        self._stream.take()
        if self._stream.current.kind is TokenKind.NAME and self._stream.peek(1).is_mark("="):
            return Block(kind, name, (self._field(),), None)
        self._diagnostics.syntax_error(
            f"a field is missing after `site {shorten(name.text)}->`",
            self._stream.last_character_span(),
            f"write `site {shorten(name.text)}->location = ...;`",
        )
        self._stream.skip_statement()
        return Block(kind, name, (), None)

    def _field(self) -> Field:
        """`NAME "=" value ";"`."""
        name = self._word()
        self._stream.take()
        value = parse_value(self._stream, f"`{shorten(name.text)} =`")
        if value is None:
            self._stream.skip_statement()
        elif not self._stream.take_mark(";"):
            self._end_of_statement()
        return Field(name, value)

    def _connect(self) -> Connect | None:
        """`"connect" NAME "." NAME "to" NAME "." NAME ";"`."""
        stream = self._stream
        name = self._word()
        parent = self._reference()
        if parent and stream.current.is_name("to"):
            stream.take()
            child = self._reference()
            if child:
                span = name.span.extend_to(child.span)
                if not stream.take_mark(";"):
                    self._end_of_statement()
                return Connect(name, parent, child, span)
        self._diagnostics.syntax_error(
            f"`connect` cannot be read: {stream.current} stands where it breaks off",
            stream.span(stream.current),
            "write `connect SEGMENT.SITE to SEGMENT.SITE;`",
        )
        stream.skip_statement()
        return None

    def _reference(self) -> SiteReference | None:
        """`NAME "." NAME`; None when it is not there."""
        stream = self._stream
        if stream.current.kind is not TokenKind.NAME or not stream.peek(1).is_mark("."):
            return None
        segment = self._word()
        stream.take()
        if stream.current.kind is not TokenKind.NAME:
            return None
        site = self._word()
        return SiteReference(segment, site, segment.span.extend_to(site.span))

    def _end_of_statement(self) -> None:
        """Report the missing `;` and continue at the next statement."""
        self._stream.expect(";", "this value")
        if not self._stream.current.starts_line:
            self._stream.skip_statement()

    def _word(self) -> Word:
        """The next token, a name, as a word of the tree."""
        token = self._stream.take()
        return Word(token.text, self._stream.span(token))


def _figure_hint(first: Token) -> str:
    """A hint for a first word that may be a slip of `figure`."""
    return "did you mean `figure`?" if closest_match(first.text, ["figure"]) else ""


def _placement_hint(word: str, kind: str) -> str:
    """Hint for a word that is unknown in this kind of block."""
    home = block_parent(word)
    return f"a {word} belongs in a {home}" if home else spelling_hint(word, keywords_in(kind))
