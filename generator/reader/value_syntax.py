"""The grammar of values.

    value   := term ("*" term)*
    term    := NUMBER unit? | STRING | NAME | NAME "." NAME | NAME list | list
    list    := "(" (item ("," item)*)? ")"
    item    := NUMBER unit? | STRING | NAME
    unit    := NAME+ ("/" NAME+)?

The first word of a unit may be glued to the number. Lists hold no lists, so nothing recurses.
"""

from generator.reader.stream import Stream
from generator.reader.tokens import Kind, Token
from generator.reader.tree import Call, Items, Number, Product, Reference, Term, Text, Value, Word
from generator.reader.units import is_unit_word
from generator.source import Span

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
