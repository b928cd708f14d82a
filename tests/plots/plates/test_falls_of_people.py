"""The plate of falls beside people: every fact has a row, and failing rows stay."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from benchmarks.falls_of_people import FIGURES, SEED, contact_name, push
from benchmarks.pages import table
from generator import Model, read_figure
from plots.fall_facts import Use, fall_facts
from plots.fall_verdicts import FallTables, compare_all, read_fall_tables
from plots.literature import Measurements
from plots.plate import ClaimKind, Outcome
from plots.plates.falls_of_people import CAUSES, FallsBesidePeople, claims_of, falls_of_people
from tests.plots.drawn import data, plate


def texts(figure: Figure) -> list[str]:
    """The texts of a picture."""
    return [
        text
        for axes in figure.axes
        for text in (
            *(label.get_text() for label in axes.get_yticklabels()),
            *(one.get_text() for one in axes.texts),
        )
    ]


def test_every_fact_has_a_row_with_its_use_and_a_verdict_of_each_body() -> None:
    shown = texts(plate("falls_of_people").figure)
    for fact in fall_facts().facts:
        use = f"sets {fact.parameter}" if fact.use is Use.SETS else "tests"
        rows = [text for text in shown if text.startswith(f"{fact.name} [")]
        assert any(text.endswith(f"{fact.value_text}; {fact.sureness}, {use}") for text in rows)
    falls: FallsBesidePeople = data("falls_of_people")
    verdicts = [text for text in shown if any(f"{body}: " in text for body in FIGURES)]
    expected = [f"{one.body}: {one.verdict}" for one in falls.comparisons]
    assert sorted(text[2:] for text in verdicts) == sorted(expected)


def test_what_chose_a_parameter_is_printed() -> None:
    for fact in fall_facts().facts:
        if fact.use is Use.SETS:
            assert fact.parameter in plate("falls_of_people").sign
            assert fact.name in plate("falls_of_people").sign


def test_a_claim_is_a_comparison_and_states_a_reason_only_where_it_differs() -> None:
    claims = plate("falls_of_people").claims
    assert all(claim.kind is ClaimKind.COMPARISON for claim in claims)
    assert {claim.outcome for claim in claims} == set(Outcome) - {Outcome.HOLDS, Outcome.FAILS}
    assert all(not claim.remark for claim in claims if claim.outcome is not Outcome.DIFFERS)
    assert any(claim.remark for claim in claims)


def test_reasons_are_of_facts_and_criteria_that_exist() -> None:
    labels = {
        (one.fact.key, criterion.label)
        for one in data("falls_of_people").comparisons
        for criterion in one.criteria
    }
    assert CAUSES.keys() <= labels


def changed(column: str, factor: float) -> FallTables:
    """The shipped falls with other numbers in a column."""
    tables = read_fall_tables()
    rows = [{**row, column: str(factor * float(row[column]))} for row in tables.pushes.rows]
    return replace(tables, pushes=Measurements(tables.pushes.provenance, rows))


def test_faster_falls_differ_in_picture_and_table() -> None:
    """A row that fails stays, marked."""
    tables = changed("pelvis_speed_m_per_s", 2.0)
    facts = fall_facts()
    made = FallsBesidePeople(facts, tables, compare_all(tables, facts))
    shown = texts(falls_of_people.build(made).figure)
    assert sum("differs: mean" in text for text in shown) > sum(
        "differs: mean" in text for text in texts(plate("falls_of_people").figure)
    )
    assert len(claims_of(made.comparisons)) == len(plate("falls_of_people").claims)


def test_falls_without_parts_are_drawn_and_not_judged() -> None:
    tables, facts = replace(read_fall_tables(), floors=None, heads=None), fall_facts()
    made = FallsBesidePeople(facts, tables, compare_all(tables, facts))
    drawn = falls_of_people.build(made)
    assert drawn.figure.axes
    floors = [one for one in made.comparisons if one.fact.floor is not None]
    assert {one.outcome for one in floors} == {Outcome.INCOMPARABLE}


def test_the_tables_of_the_page_have_every_fact_source_and_difference() -> None:
    falls: FallsBesidePeople = data("falls_of_people")
    verdicts, differing = table("falls-of-people"), table("falls-that-differ")
    for fact in fall_facts().facts:
        assert f"| {fact.name} | {fact.value_text} [" in verdicts
        found = [one for one in falls.comparisons if one.fact is fact]
        named = f"| {fact.group.value}: {fact.name} |" in differing
        assert named == any(one.outcome is Outcome.DIFFERS for one in found)
    assert verdicts.count("**differs") == sum(
        one.outcome is Outcome.DIFFERS for one in falls.comparisons
    )
    for source in fall_facts().sources:
        assert source.reference in table("fall-sources")


def test_the_tables_are_of_the_shipped_persons() -> None:
    tables = read_fall_tables()
    assert dict(zip(tables.names, tables.bodies.values("figure"), strict=True)) == FIGURES
    for body in FIGURES:
        for tone in ("awake", "limp"):
            seeds = tables.pushes.select_rows(body=body, tone=tone).column("seed")
            assert np.array_equal(seeds, SEED + np.arange(seeds.size))


@pytest.mark.slow
def test_four_falls_are_those_of_the_table() -> None:
    """To within what processors differ by until the pelvis has touched."""
    tables = read_fall_tables()
    model = Model.of(read_figure(FIGURES["man"]))
    (kept,) = tables.bodies.select_rows(body="man").rows
    assert contact_name(model) == kept["contact"]
    stored = tables.pushes.select_rows(body="man", tone="awake").rows[:4]
    for row, kept in zip(push("man", model, "awake", 4), stored, strict=True):
        assert (str(row["seed"]), row["direction_deg"]) == (kept["seed"], kept["direction_deg"])
        for name in ("pelvis_speed_m_per_s", "hand_speed_m_per_s", "descent_ms"):
            assert float(str(row[name])) == pytest.approx(float(kept[name]), rel=1e-2)
