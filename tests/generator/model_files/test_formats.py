"""The table of model formats: every suffix means one format."""

from pathlib import Path

import pytest

from generator.diagnostics import UsageError
from generator.model_files.formats import MODEL_FORMATS, model_format, suffixes
from generator.motion_files import MOTION_FORMATS as MOTIONS


def test_no_suffix_stands_for_two_formats():
    said = [*suffixes(), *MOTIONS]
    assert len(set(said)) == len(said)
    assert all(suffix == suffix.lower() and suffix.startswith(".") for suffix in said)


def test_the_suffix_chooses_and_a_name_wins_over_it():
    assert model_format(Path("a.FIG")) is MODEL_FORMATS["peabody"]
    assert model_format(Path("a.txt"), "peabody") is MODEL_FORMATS["peabody"]


def test_what_is_not_known_is_told_with_what_is():
    with pytest.raises(UsageError, match=r"`\.fog` is not a known suffix.*\.fig"):
        model_format(Path("a.fog"))
    with pytest.raises(UsageError, match="the suffix is missing"):
        model_format(Path("a"))
    with pytest.raises(UsageError, match="did you mean `peabody`"):
        model_format(Path("a.fig"), "peabod")
