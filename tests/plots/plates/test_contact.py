"""The plate of contact: its claims, and the table of the page against the cases."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from plots.contact_cases import ContactCase
from plots.plates.contact import DAMPINGS, IMPACT_SPEEDS, ROD_ANGLES, Cases
from tests.paths import DOCS
from tests.plots.drawn import data, maker, plate

pytestmark = pytest.mark.slow
"""They share the drawing of the plate with the test of the gallery, which checks its claims."""

ROD_ROWS = (0.3, 0.5, 0.81)


@pytest.fixture(scope="module")
def cases() -> Cases:
    return data("contact")


def test_claims_fail_for_other_numbers(cases: Cases) -> None:
    """Every claim about closed forms fails if one of its cases is off by a hundredth."""

    def off(case: ContactCase) -> ContactCase:
        return replace(case, measured=1.01 * case.measured)

    def off_last(some):
        *first, last = some
        return {**{key: some[key] for key in first}, last: off(some[last])}

    groups = ("impacts", "peaks", "creeping", "slipping", "balls", "turned", "stopping")
    changed = {name: off_last(getattr(cases, name)) for name in (*groups, "beginning")}
    wrong = replace(
        cases, **changed, rod=[*cases.rod[:-1], off(cases.rod[-1])], resting=off(cases.resting)
    )
    failing = [k for k, claim in enumerate(maker("contact").build(wrong).claims) if not claim.holds]
    assert failing == [0, 1, 2, 3, 4, 5, 7, 9, 10]
    only_turned = replace(cases, turned=changed["turned"])
    assert [k for k, c in enumerate(maker("contact").build(only_turned).claims) if not c.holds] == [
        8
    ]


def test_claims_fail_for_a_run_with_another_energy_momentum_or_acceleration(cases: Cases) -> None:
    run = cases.tumbling
    assert run.contact is not None
    friction = run.energy["friction"] + 1e-6 * run.times
    segments = {
        name: replace(contact, impulse=(1e-6, *contact.impulse[1:]))
        for name, contact in run.contact.segments.items()
    }
    wrong = replace(
        run,
        energy={**run.energy, "friction": friction},
        contact=replace(run.contact, segments=segments),
        agreement_with_exudyn=None,
    )
    claims = maker("contact").build(replace(cases, tumbling=wrong)).claims
    assert [k for k, claim in enumerate(claims) if not claim.holds] == [11, 12, 13]


def table_of_page() -> list[tuple[str, Sequence[str], Sequence[str]]]:
    page = (DOCS / "contact-validation.md").read_text(encoding="utf-8")
    section = page.partition("## Checked against closed forms")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| (.+) \| ([-\d., ]+) \| ([-\d., ]+) \|$", section, re.MULTILINE)
    return [(label, measured.split(", "), closed.split(", ")) for label, measured, closed in rows]


def test_the_table_of_the_page_has_what_is_measured_now(cases: Cases) -> None:
    """To the digits that it shows; where this fails, the page needs the new numbers."""
    rod = dict(zip(ROD_ANGLES, cases.rod, strict=True))
    groups = [[cases.impacts[a, speed, 3e4] for speed in IMPACT_SPEEDS] for a in DAMPINGS]
    groups += [
        list(some.values())
        for some in (
            cases.peaks,
            cases.creeping,
            cases.slipping,
            cases.stopping,
            cases.beginning,
            cases.balls,
        )
    ]
    groups += [[rod[angle] for angle in ROD_ROWS], [cases.resting]]
    table = table_of_page()
    assert len(table) == len(groups)
    for (label, measured, closed), group in zip(table, groups, strict=True):
        scale = 1e3 if "[mm/s]" in label else 1.0
        assert len(measured) == len(closed) == len(group)
        for text, other, case in zip(measured, closed, group, strict=True):
            digit = 10.0 ** -len(text.partition(".")[2])
            assert float(text) == pytest.approx(scale * case.measured, abs=0.6 * digit)
            assert float(other) == pytest.approx(scale * case.closed_form, abs=0.6 * digit)


def test_the_numbers_drawn_are_those_of_the_cases(cases: Cases) -> None:
    tables = plate("contact").tables
    impacts = tables["restitution"]
    for k, (key, case) in enumerate(cases.impacts.items()):
        row = [float(column[k]) for column in impacts.values()]
        assert row == [*key, case.measured, case.closed_form]
    energy = tables["energy"]
    total = np.sum([values for name, values in energy.items() if name != "time [s]"], axis=0)
    assert np.ptp(total) < 1e-9
