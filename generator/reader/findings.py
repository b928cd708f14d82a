"""The faults found so far in one input, and when it is enough."""

from dataclasses import dataclass, field, replace

from generator.errors import Fault, Severity, error, errors_among, warning
from generator.source import Span

ENOUGH = 100
"""No reader wants more errors, or more warnings, than this at once."""


class EnoughFaults(Exception):  # noqa: N818 - it ends the reading, it is not an error of its own
    """So many errors were found that reading on tells nothing new."""


@dataclass
class Findings:
    """Collects the faults of one input.

    `malformed` says that the grammar was broken somewhere, `partial` that a part of the input is
    unknown: what seems to be absent may then be there, so absences are not reported.
    """

    faults: list[Fault] = field(default_factory=list[Fault])
    malformed: bool = False
    partial: bool = False
    _errors: int = 0

    def error(self, message: str, span: Span | None, hint: str = "") -> None:
        """Note an error. Raises EnoughFaults when there are too many to go on."""
        self._errors += 1
        if self._errors < ENOUGH:
            self.faults.append(error(message, span, hint))
            return
        stopped = f"reading stopped here, after {ENOUGH} errors"
        self.faults.append(error(message, span, _joined(hint, stopped)))
        raise EnoughFaults

    def warning(self, message: str, span: Span | None, hint: str = "") -> None:
        """Note a warning."""
        self.faults.append(warning(message, span, hint))

    def malformation(self, message: str, span: Span, hint: str = "") -> None:
        """Note an error of grammar, unless it echoes the one before at the same place."""
        if self.faults and self.faults[-1].span == span:
            return
        self.malformed = self.partial = True
        self.error(message, span, hint)

    @property
    def has_errors(self) -> bool:
        """Whether anything stops the command."""
        return self._errors > 0

    def in_order(self) -> tuple[Fault, ...]:
        """The faults in the order of the text.

        Of the warnings only the first 100; the last of them says how many more there were.
        """
        warnings = [f for f in sorted(self.faults, key=_start) if f.severity is Severity.WARNING]
        more = len(warnings) - ENOUGH
        if more > 0:
            last, told = warnings[ENOUGH - 1], f"and {more} more warning{'s' if more > 1 else ''}"
            warnings[ENOUGH - 1 :] = [replace(last, hint=_joined(last.hint, told))]
        return tuple(sorted([*errors_among(self.faults), *warnings], key=_start))


def _start(fault: Fault) -> int:
    return fault.span.start if fault.span else -1


def _joined(first: str, second: str) -> str:
    return f"{first}; {second}" if first else second
