"""A coupled law in a file's own numbers: constants, and exponentials of sums of the angles."""

from collections.abc import Mapping
from typing import Any, cast

from generator.reader.toml_values import Pair, TableReader
from springs.coupled import CoupledExponential, CoupledTerm

OWN_KEYS = ("terms", "constants_Nm", "measured_deg")
TERM_KEYS = ("amplitudes_Nm", "rates_1_rad", "exponent")


def own_law(table: TableReader, coordinates: tuple[str, ...]) -> CoupledExponential | None:
    """The law of `terms`, `constants_Nm` and `measured_deg`; None with a fault noted."""
    count = len(coordinates)
    items = table.items("terms")
    if not items or not all(isinstance(item, dict) for item in items):
        hint = "as in `[{amplitudes_Nm = [1.0, 0.5], rates_1_rad = [2.0, 1.0]}]`"
        table.error("terms", "`terms` must be a list of tables in braces", hint)
        return None
    if not count:
        return None
    terms = [
        _term(_inner(table, cast("Mapping[str, Any]", item), k), count)
        for k, item in enumerate(items)
    ]
    constants = table.numbers("constants_Nm", count)
    measured = _measured(table, count)
    if None in terms or measured is None:
        return None
    return CoupledExponential(
        coordinates,
        tuple(term for term in terms if term is not None),
        constants or (0.0,) * count,
        measured,
    )


def _inner(table: TableReader, content: Mapping[str, Any], k: int) -> TableReader:
    """The reader of one table in braces."""
    return TableReader(content, table.name, table.index, table.places, table.findings, ("terms", k))


def _term(table: TableReader, count: int) -> CoupledTerm | None:
    """One exponential: its torques, how they grow with each angle, its exponent at zero."""
    table.refuse_unknown(TERM_KEYS, "term")
    for key in TERM_KEYS[:2]:
        if key not in table.content:
            hint = f"a list of {count} numbers, one for each coordinate"
            table.findings.error(f"this term has no `{key}`", table.header, hint)
    amplitudes = table.numbers("amplitudes_Nm", count)
    rates = table.numbers("rates_1_rad", count)
    exponent = table.number("exponent")
    if amplitudes is None or rates is None:
        return None
    if not any(rates):
        hint = "such a term is a constant: `constants_Nm`"
        table.error("rates_1_rad", "the rates of a term must not all be zero", hint)
        return None
    return CoupledTerm(amplitudes, rates, exponent or 0.0)


def _measured(table: TableReader, count: int) -> tuple[Pair | None, ...] | None:
    """For each coordinate its range; None with a fault noted."""
    key = "measured_deg"
    if key not in table.content:
        return (None,) * count
    pairs = table.pairs(key, 1, ("deg", "deg"))
    if not pairs:
        return None
    if len(pairs) != count:
        table.error(key, f"`{key}` has {len(pairs)} instead of {count} pairs", "one a coordinate")
        return None
    for k, (low, high) in enumerate(pairs):
        if low >= high:
            table.error(key, f"`{key}` ends before it begins", "[lower, upper]", k)
            return None
    return pairs
