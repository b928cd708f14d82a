"""Options of a run: what is said of them in several places is the same."""

import re
from collections.abc import Sequence
from dataclasses import fields
from inspect import signature
from typing import Any

import pytest

from generator.cli.inputs import given_options
from generator.cli.settle import settle
from generator.cli.simulate import simulate
from generator.diagnostics import UsageError
from generator.input_files.live import LiveStart
from generator.run_options import LIVE_ROWS, PANELS, RUN_OPTIONS, VARYING_OPTIONS, RunOption
from generator.simulation.plan import Plan, option_faults
from generator.toml_file.rows import Number
from tests.command import run
from tests.paths import DOCS

PAGE = (DOCS / "commands.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("option", RUN_OPTIONS.values(), ids=lambda option: option.key)
def test_the_command_has_every_option_and_its_page_names_it(option: RunOption):
    assert option.field in signature(simulate).parameters
    assert f"`{option.flag}" in PAGE
    assert {*option.needs, *option.excludes} <= RUN_OPTIONS.keys()


def test_the_help_has_every_option_in_one_section():
    keys = [key for panel in PANELS.values() for key in panel]
    assert sorted(keys) == sorted(RUN_OPTIONS)
    text = run("simulate", "--help").stdout
    titles = re.findall(r"^([A-Z][a-z ]+):$", text, re.MULTILINE)
    assert titles == ["Arguments", *PANELS, "Options"]
    for panel, keys in PANELS.items():
        _, _, section = text.partition(f"\n{panel}:\n")
        flags = re.findall(r"^  (?:-\w, )?(--[a-z-]+)", section.partition("\n\n")[0], re.MULTILINE)
        own = [RUN_OPTIONS[key].flag for key in keys]
        assert flags == (own or ["--output", "--replay"])


def test_the_default_in_the_help_is_that_of_the_plan():
    compared = set[str]()
    for option in RUN_OPTIONS.values():
        found = re.search(r"\[default: ([0-9.e-]+)\]", option.help)
        if found is not None and isinstance(option.row, Number) and hasattr(Plan, option.field):
            assert float(found[1]) == getattr(Plan, option.field)
            compared.add(option.key)
    assert compared == {"stop", "start", "frame", "tolerance", "wall_limit"}


def test_numbers_that_vary_are_fields_of_a_plan():
    names = {each.name for each in fields(Plan)}
    assert {RUN_OPTIONS[key].field for key in VARYING_OPTIONS} <= names


ELSEWHERE = {"floor", "friction"}
"""Options that are no field of a plan: a law belongs to the springs, a floor is a prop."""


def test_every_other_option_is_a_field_of_a_plan():
    """So that no option is accepted and left unused; those of files have a form of their own."""
    names = {each.name for each in fields(Plan)}
    unused = {key for key, option in RUN_OPTIONS.items() if option.field not in names}
    assert {key for key in unused if not RUN_OPTIONS[key].is_text} == ELSEWHERE


def test_the_start_of_a_live_simulation_has_the_keys_of_its_file():
    assert {each.name for each in fields(LiveStart)} == LIVE_ROWS.keys()


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"height": 1.0}, "height needs free_root: the figure hangs from the ground"),
        ({"self_contact": True}, "self_contact needs scene"),
    ],
)
def test_a_contradiction_is_one_sentence_in_the_notation_of_the_asker(
    values: dict[str, Any], sentence: str
):
    with pytest.raises(ValueError, match=f"^{sentence}$"):
        Plan(**values)
    (fault,) = option_faults(values, {"free_root", "scene"}, "<{}>".format)
    assert fault.sentence.startswith(f"<{next(iter(values))}> needs <")
    with pytest.raises(UsageError, match=r"^--[a-z-]+ needs --(free-root|scene)"):
        given_options({"free_root": False, "scene": None, **values})


@pytest.mark.parametrize("known", [("floor", "scene"), ("scene",), ()])
def test_a_command_names_only_options_that_it_has(known: Sequence[str]):
    faults = [fault.sentence for fault in option_faults({"height": 1.0}, known, str)]
    listed = " or ".join(known)
    assert faults == ([f"height needs {listed}: the figure hangs from the ground"] if known else [])


def test_settle_takes_options_of_a_run():
    own = {option.field for option in RUN_OPTIONS.values()}
    others = {"name", "output", "show_progress"}
    assert signature(settle).parameters.keys() - own == others
