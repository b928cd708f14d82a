"""The tokens of a file as a parser walks over them."""

from collections import deque
from collections.abc import Iterator

from generator.reader.findings import EnoughFaults, Findings
from generator.reader.tokens import Kind, Token, tokenize
from generator.reader.vocabulary import WORDS
from generator.source import Source, Span

DEEPEST = 32
"""Braces nested deeper than this are no slip of the pen; the grammar knows three levels."""


class Stream:
    """Looks ahead over tokens, takes them one by one, and skips what cannot be read."""

    def __init__(self, source: Source, findings: Findings) -> None:
        """Start at the first token; the text is cut into tokens only as far as it is read."""
        self.source = source
        self.findings = findings
        self._rest: Iterator[Token] = tokenize(source, findings)
        self._ahead: deque[Token] = deque([next(self._rest)])
        self._last: Token | None = None

    @property
    def here(self) -> Token:
        """The next token, not yet taken."""
        return self._ahead[0]

    def peek(self, count: int) -> Token:
        """The token `count` places after `here`; the end token stands for all after it."""
        while len(self._ahead) <= count and self._ahead[-1].kind is not Kind.END:
            self._ahead.append(next(self._rest))
        return self._ahead[min(count, len(self._ahead) - 1)]

    def take(self) -> Token:
        """The next token, taken; the end is never taken."""
        self.peek(1)
        self._last = self._ahead.popleft()
        return self._last

    def take_mark(self, mark: str) -> Token | None:
        """The next token if it is this mark, taken; otherwise None and nothing is taken."""
        return self.take() if self.here.is_mark(mark) else None

    def span(self, token: Token) -> Span:
        """Where a token stands."""
        return Span(self.source, token.start, token.end)

    def after_last(self) -> Span:
        """The last character that was taken: where something that is missing belongs."""
        end = self._last.end if self._last else 0
        return Span(self.source, max(0, end - 1), end)

    def expect(self, mark: str, after: str) -> bool:
        """Take `mark`; when it is not there, report so behind the last token and say False."""
        if self.take_mark(mark):
            return True
        self.findings.malformation(
            f"`{mark}` is missing after {after}", self.after_last(), f"found {self.here} instead"
        )
        return False

    @property
    def at_statement(self) -> bool:
        """Whether the next token looks like the start of a statement."""
        return self.here.new_line and self.here.kind is Kind.NAME and self.here.text in WORDS

    def skip_statement(self) -> None:
        """Pass over the rest of a statement that could not be read, its `;` included."""
        while self.here.kind is not Kind.END and not self.here.is_mark("}"):
            if self.here.is_mark("{"):
                self.skip_block()
                return
            if self.at_statement:
                return
            if self.take().is_mark(";"):
                return

    def skip_block(self) -> None:
        """Pass over `{ ... }` with all that is in it. Raises EnoughFaults when it is too deep."""
        depth, opening = 0, self.here
        while self.here.kind is not Kind.END:
            token = self.take()
            if token.is_mark("{"):
                depth += 1
            elif token.is_mark("}"):
                depth -= 1
            if depth > DEEPEST:
                self.findings.malformation(
                    f"braces nested more than {DEEPEST} deep",
                    self.span(token),
                    f"a figure has at most three levels; the outermost of these stands in "
                    f"line {self.span(opening).line}; reading stopped here",
                )
                raise EnoughFaults
            if depth == 0:
                return
