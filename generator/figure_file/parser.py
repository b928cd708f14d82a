"""The grammar: from tokens to the syntax tree of one figure.

    file      := "figure" NAME? "{" statement* "}"
    statement := block | arrow | connect | field
    block     := ("attribute" | "segment" | "joint" | "site") NAME "{" statement* "}"
    arrow     := "site" NAME "->" field
    connect   := "connect" NAME "." NAME "to" NAME "." NAME ";"
    field     := NAME "=" value ";"

Values are in `value_syntax.py`. Which block may stand in which keeps the recursion at three levels.
After a fault the parser goes on at the next statement, so that all faults are found at once.

The syntax tree of a figure file: what is written and where, before it means anything.

The grammar of values.

    value   := term ("*" term)*
    term    := NUMBER unit? | STRING | NAME | NAME "." NAME | NAME list | list
    list    := "(" (item ("," item)*)? ")"
    item    := NUMBER unit? | STRING | NAME
    unit    := NAME+ ("/" NAME+)?

The first word of a unit may be glued to the number. Lists hold no lists, so nothing recurses.
"""

from dataclasses import dataclass

from generator.diagnostics import Findings, Source, Span, closest, nearest, shorten
from generator.figure_file.lexer import BLOCKS, Kind, Stream, Token, block_home, home_of, known_in
from generator.units import is_unit_word


@dataclass(frozen=True, slots=True)
class Word:
    """A bare name."""

    text: str
    span: Span


@dataclass(frozen=True, slots=True)
class Text:
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
class Reference:
    """`segment.site`."""

    segment: Word
    site: Word
    span: Span


@dataclass(frozen=True, slots=True)
class Items:
    """`(a, b, c)`."""

    items: tuple["Number | Word | Text", ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Call:
    """`name(a, b, c)`."""

    name: Word
    arguments: Items
    span: Span


@dataclass(frozen=True, slots=True)
class Product:
    """`a * b * c`, two factors or more."""

    factors: tuple["Call | Number | Word | Text | Reference | Items", ...]
    span: Span


Term = Call | Number | Word | Text | Reference | Items
Value = Term | Product


@dataclass(frozen=True, slots=True)
class Field:
    """`name = value;`. The value is None when it could not be read."""

    name: Word
    value: Value | None


@dataclass(frozen=True, slots=True)
class Connect:
    """`connect a.s to b.t;`."""

    name: Word
    parent: Reference
    child: Reference
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


LONGEST_UNIT = 9
"""Most words and slashes in a unit."""

Item = Number | Word | Text


def parse_value(stream: Stream, after: str) -> Value | None:
    """`term ("*" term)*`; None, with a fault noted, when it cannot be read."""
    factors: list[Term] = []
    while True:
        term = _term(stream, after)
        if term is None:
            return None
        factors.append(term)
        if not stream.here.is_mark("*"):
            break
        stream.take()
        after = "`*`"
    if len(factors) == 1:
        return factors[0]
    return Product(tuple(factors), factors[0].span.to(factors[-1].span))


def _term(stream: Stream, after: str) -> Term | None:
    """One factor of a value."""
    here = stream.here
    if here.is_mark("("):
        return _items(stream)
    if here.kind is Kind.NAME and stream.peek(1).is_mark("("):
        name = _word(stream)
        arguments = _items(stream)
        return arguments and Call(name, arguments, name.span.to(arguments.span))
    if here.kind is Kind.NAME and stream.peek(1).is_mark("."):
        segment = _word(stream)
        dot = stream.take()
        if stream.here.kind is not Kind.NAME:
            stream.findings.malformation(
                "the name of a site is missing after `.`", stream.span(dot), f"found {stream.here}"
            )
            return None
        site = _word(stream)
        return Reference(segment, site, segment.span.to(site.span))
    return _item(stream, after)


def _items(stream: Stream) -> Items | None:
    """`"(" (item ("," item)*)? ")"`."""
    opening = stream.take()
    items: list[Item] = []
    while not stream.here.is_mark(")") or items:
        item = _item(stream, "`,`" if items else "`(`")
        if item is None:
            return None
        items.append(item)
        if stream.here.is_mark(")"):
            break
        if stream.here.is_mark(";"):
            stream.expect(")", "the last value of this list")
            return Items(tuple(items), stream.span(opening).to(items[-1].span))
        if not stream.expect(",", "this value") and not _begins_item(stream.here):
            return None
    closing = stream.take()
    return Items(tuple(items), stream.span(opening).to(stream.span(closing)))


def _begins_item(token: Token) -> bool:
    return token.kind in (Kind.NUMBER, Kind.STRING, Kind.NAME) and not token.new_line


def _item(stream: Stream, after: str) -> Item | None:
    """`NUMBER unit? | STRING | NAME`; None, with a fault noted, when it is something else."""
    here = stream.here
    match here.kind:
        case Kind.NUMBER:
            return _number(stream)
        case Kind.NAME if not stream.at_statement:
            return _word(stream)
        case Kind.STRING:
            stream.take()
            return Text(here.text, stream.span(here))
        case _:
            stream.findings.malformation(
                f"a value is missing after {after}",
                stream.after_last() if here.new_line else stream.span(here),
                f"found {here} instead",
            )
            return None


def _number(stream: Stream) -> Number:
    """`NUMBER unit?`, where a unit is `NAME+ ("/" NAME+)?` on the same line."""
    token = stream.take()
    span = stream.span(token)
    words = [token.unit] if token.unit else []
    unit_start = token.end - len(token.unit)
    while len(words) < LONGEST_UNIT and _continues_unit(stream):
        part = stream.take()
        unit_start = unit_start if words else part.start
        words.append(part.text)
        span = span.to(stream.span(part))
    unit_span = Span(span.source, unit_start, span.end)
    return Number(token.text, " ".join(words).replace(" / ", "/"), span, unit_span)


def _continues_unit(stream: Stream) -> bool:
    """Whether the next token belongs to the unit of the number before it."""
    here, after = stream.here, stream.peek(1)
    if here.new_line:
        return False
    if here.is_mark("/"):
        return after.kind is Kind.NAME
    if here.kind is not Kind.NAME:
        return False
    return is_unit_word(here.text) or any(after.is_mark(mark) for mark in (",", ")", ";", "/"))


def _word(stream: Stream) -> Word:
    token = stream.take()
    return Word(token.text, stream.span(token))


def parse(source: Source, findings: Findings) -> Block | None:
    """The figure block of `source`; None when there is none.

    Raises EnoughFaults when too much is wrong to go on.
    """
    return _Parser(source, findings).file()


def parse_fragment(source: Source, findings: Findings) -> Block:
    """The statements of a text that stands for the inside of a figure block: `statement*`.

    Raises EnoughFaults when too much is wrong to go on.
    """
    return _Parser(source, findings).fragment()


class _Parser:
    """Recursive descent over the blocks. `_open` are the blocks around the present place."""

    def __init__(self, source: Source, findings: Findings) -> None:
        self._stream = Stream(source, findings)
        self._findings = findings
        self._open: list[tuple[str, str]] = []
        self._closed, self._closed_kind = "", ""

    def file(self) -> Block | None:
        """`"figure" NAME? "{" statement* "}"` and then the end."""
        stream = self._stream
        first = stream.here
        if first.kind is Kind.END:
            self._findings.malformation(
                "there is no figure in this file", stream.span(first), "it starts with `figure {`"
            )
            return None
        if not first.is_name("figure"):
            loose = first.kind is Kind.NAME and first.text in known_in("figure")
            self._findings.malformation(
                f"a figure file starts with `figure {{`, not with {first}",
                stream.span(first),
                "all blocks stand in `figure { ... }`" if loose else _meant(first),
            )
            if loose:
                return self._rest_of_file(Block(Word("figure", stream.span(first)), None, (), None))
            opens = 2 if stream.peek(1).kind is Kind.NAME else 1
            if first.kind is not Kind.NAME or not stream.peek(opens).is_mark("{"):
                return None
        figure = self._block()
        return figure and self._rest_of_file(figure)

    def fragment(self) -> Block:
        """`statement*` and then the end, as the body of a figure without a name."""
        first = self._stream.here
        body = Block(Word("figure", self._stream.span(first)), None, (), None)
        if first.is_name("figure"):
            self._findings.malformation(
                "a whole figure stands here, and not only some blocks of one",
                self._stream.span(first),
                "leave out `figure {` and its `}`",
            )
            return body
        return self._rest_of_file(body)

    def _rest_of_file(self, figure: Block) -> Block:
        """What stands after the figure's `}` is out of place, but read as part of the figure."""
        stream, strays = self._stream, list[Statement]()
        told = figure.opening is None
        self._open.append(("figure", ""))
        while stream.here.kind is not Kind.END:
            here = stream.here
            if here.is_mark("}"):
                self._findings.malformation(
                    "this `}` closes nothing", stream.span(here), self._closed
                )
                stream.take()
                continue
            if not told:
                told = True
                self._findings.malformation(
                    f"{here} stands after the end of the figure", stream.span(here), self._closed
                )
            statement = self._statement("figure")
            if statement:
                strays.append(statement)
        return Block(figure.kind, figure.name, (*figure.body, *strays), figure.opening)

    def _block(self) -> Block | None:
        """`KIND NAME "{" statement* "}"`; the name of a figure may be left out."""
        stream = self._stream
        kind = self._word()
        name = self._name(kind) if stream.here.kind is Kind.NAME else self._no_name(kind)
        known = kind.text if kind.text in BLOCKS else "figure"
        title = shorten(f"{kind.text} {name.text}" if name else kind.text)
        opening = stream.here
        if not stream.expect("{", f"`{title}`") and not (
            stream.at_statement and opening.text in known_in(known)
        ):
            stream.skip_statement()
            return None
        span = stream.span(opening) if opening.is_mark("{") else kind.span
        self._open.append((known, title))
        body: list[Statement] = []
        while not stream.here.is_mark("}"):
            if stream.here.kind is Kind.END or self._belongs_outside(known, title, span):
                closing = None
                break
            statement = self._statement(known)
            if statement:
                body.append(statement)
        else:
            closing = stream.span(stream.take())
            self._closed = (
                f"the `}}` in line {closing.line} closed the `{{` of `{title}` in line {span.line}"
            )
            self._closed_kind = known
        self._open.pop()
        if closing is None and stream.here.kind is Kind.END:
            self._findings.malformation(
                f"the `{{` of `{title}` is never closed", span, self._closed
            )
        return Block(kind, name, tuple(body), span)

    def _no_name(self, kind: Word) -> Word | None:
        """A block without a bare name: fine for a figure, a fault elsewhere."""
        if self._stream.here.kind in (Kind.STRING, Kind.NUMBER):
            return self._name(kind)
        if kind.text != "figure":
            self._findings.malformation(f"this {kind.text} has no name", kind.span)
        return None

    def _name(self, kind: Word) -> Word:
        """The name of a block; a string or a number in its place is a fault."""
        token = self._stream.take()
        span = self._stream.span(token)
        if token.kind is not Kind.NAME:
            self._findings.malformation(
                f"{token} cannot be the name of a {kind.text}",
                span,
                "a name is made of letters, digits and `_`, starts with no digit, and has no "
                "quotes",
            )
        return Word(token.text + token.unit, span)

    def _belongs_outside(self, kind: str, title: str, opening: Span) -> bool:
        """Whether a block starts here that can only stand further out: a `}` is missing."""
        here = self._stream.here
        if here.kind is not Kind.NAME or here.text not in BLOCKS or here.text in known_in(kind):
            return False
        if self._stream.peek(1).is_mark("="):
            return False
        if not any(here.text in BLOCKS[around] for around, _ in self._open[:-1]):
            return False
        self._findings.malformation(
            f"`{here.text}` cannot stand in `{title}`",
            self._stream.span(here),
            f"is a `}}` missing before it? The `{{` of `{title}` in line {opening.line} is open",
        )
        return True

    def _statement(self, kind: str) -> Statement | None:
        """One statement of a block of this kind; None when it could not be read."""
        stream = self._stream
        here, after = stream.here, stream.peek(1)
        if here.kind is not Kind.NAME:
            return self._no_statement(here)
        if here.text == "connect" and not after.is_mark("="):
            return self._in_place(here, kind, self._connect())
        if after.is_mark("="):
            return self._in_place(here, kind, self._field())
        if here.text == "site" and after.kind is not Kind.MARK and stream.peek(2).is_mark("->"):
            return self._in_place(here, kind, self._arrow())
        if here.text in BLOCKS[kind]:
            return self._block()
        stream.take()
        if after.is_mark("{") or stream.peek(1).is_mark("{"):
            self._findings.malformation(
                f"unknown block {here} in a {kind}",
                stream.span(here),
                _where(here.text, kind),
            )
        else:
            self._findings.malformation(
                f"`=` is missing after {here}" if home_of(here.text) else f"{here} begins nothing",
                stream.span(here),
                f"a field is written `{shorten(here.text)} = VALUE;`"
                if home_of(here.text)
                else _where(here.text, kind),
            )
        stream.skip_statement()
        return None

    def _in_place(self, first: Token, kind: str, read: Statement | None) -> Statement | None:
        """What was read, if a block of this kind may hold it; else a fault, and None.

        Words that mean nothing anywhere are left to the next step, which knows what is near.
        """
        home = "segment" if isinstance(read, Block) else home_of(first.text)
        if read is None or home is None or kind == "attribute" or first.text in known_in(kind):
            return read
        hint = f"it belongs in a {home}"
        self._findings.malformation(
            f"`{first.text}` cannot stand in a {kind}",
            self._stream.span(first),
            f"{hint}; {self._closed}" if home == self._closed_kind else hint,
        )
        return None

    def _no_statement(self, here: Token) -> None:
        """Something that begins no statement."""
        if here.is_mark(";"):
            self._stream.take()  # an empty statement says nothing and harms nothing
            return
        self._findings.malformation(
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
        if self._stream.here.kind is Kind.NAME and self._stream.peek(1).is_mark("="):
            return Block(kind, name, (self._field(),), None)
        self._findings.malformation(
            f"a field is missing after `site {shorten(name.text)}->`",
            self._stream.after_last(),
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
        if parent and stream.here.is_name("to"):
            stream.take()
            child = self._reference()
            if child:
                span = name.span.to(child.span)
                if not stream.take_mark(";"):
                    self._end_of_statement()
                return Connect(name, parent, child, span)
        self._findings.malformation(
            f"`connect` cannot be read: {stream.here} stands where it breaks off",
            stream.span(stream.here),
            "write `connect SEGMENT.SITE to SEGMENT.SITE;`",
        )
        stream.skip_statement()
        return None

    def _reference(self) -> Reference | None:
        """`NAME "." NAME`; None when it is not there."""
        stream = self._stream
        if stream.here.kind is not Kind.NAME or not stream.peek(1).is_mark("."):
            return None
        segment = self._word()
        stream.take()
        if stream.here.kind is not Kind.NAME:
            return None
        site = self._word()
        return Reference(segment, site, segment.span.to(site.span))

    def _end_of_statement(self) -> None:
        """The `;` is missing: go on at the next statement."""
        self._stream.expect(";", "this value")
        if not self._stream.here.new_line:
            self._stream.skip_statement()

    def _word(self) -> Word:
        """The next token, a name, as a word of the tree."""
        token = self._stream.take()
        return Word(token.text, self._stream.span(token))


def _meant(first: Token) -> str:
    """A hint for a first word that may be a slip of `figure`."""
    return "did you mean `figure`?" if closest(first.text, ["figure"]) else ""


def _where(word: str, kind: str) -> str:
    """Where a word belongs that is unknown in this kind of block."""
    home = block_home(word)
    return f"a {word} stands in a {home}" if home else nearest(word, known_in(kind))
