"""Files that a written file replaces, and files that it leaves alone."""

import os
import stat
from io import StringIO
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import Diagnostics, Source
from generator.text_io import (
    csv_cell,
    csv_value,
    format_csv_comment,
    format_csv_rows,
    make_source,
    once_per_source,
    read_csv_rows,
    unwritable_reason,
    write_atomic,
)

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs modes and special files")


def mode_of(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.fixture
def open_mask():
    """A mask that takes group's and others' right to write, as most have it."""
    before = os.umask(0o022)
    yield
    os.umask(before)


@pytest.mark.parametrize("mode", [0o600, 0o644, 0o666, 0o755])
@pytest.mark.usefixtures("open_mask")
def test_the_mode_of_a_file_is_kept(tmp_path: Path, mode: int):
    path = tmp_path / "fall.action"
    path.write_text("old", encoding="utf-8")
    path.chmod(mode)
    assert unwritable_reason(path) is None
    write_atomic(path, "new")
    assert (path.read_text(encoding="utf-8"), mode_of(path)) == ("new", mode)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.usefixtures("open_mask")
def test_a_new_file_has_the_mode_of_new_files(tmp_path: Path):
    write_atomic(tmp_path / "fall.action", "new")
    assert mode_of(tmp_path / "fall.action") == 0o644


@pytest.mark.parametrize("mode", [0o444, 0o400])
def test_a_read_only_file_is_left_alone(tmp_path: Path, mode: int):
    path = tmp_path / "fall.action"
    path.write_text("old", encoding="utf-8")
    path.chmod(mode)
    assert unwritable_reason(path) == "it is read-only"
    with pytest.raises(PermissionError, match="read-only"):
        write_atomic(path, "new")
    assert (path.read_text(encoding="utf-8"), mode_of(path)) == ("old", mode)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("linked", [False, True])
def test_what_is_no_regular_file_is_left_alone(tmp_path: Path, linked: bool):
    fifo = path = tmp_path / "queue"
    os.mkfifo(fifo)
    if linked:
        path = tmp_path / "fall.action"
        path.symlink_to(fifo)
    assert unwritable_reason(path) == "it is not a regular file"
    with pytest.raises(OSError, match="not a regular file"):
        write_atomic(path, "new")
    assert stat.S_ISFIFO(fifo.stat().st_mode)


def test_a_folder_is_left_alone(tmp_path: Path):
    with pytest.raises(IsADirectoryError):
        write_atomic(tmp_path, "new")
    assert list(tmp_path.parent.glob(".*.part")) == []


def test_a_link_that_leads_nowhere_is_told_by_where_it_leads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    Path("first.pose").symlink_to("second.pose")
    Path("second.pose").symlink_to("nowhere/x.pose")
    for name in ("first.pose", "second.pose"):
        assert unwritable_reason(Path(name)) == "there is no directory `nowhere`"
    Path("nowhere").mkdir()
    write_atomic(Path("first.pose"), "text")
    assert Path("nowhere/x.pose").read_text(encoding="utf-8") == "text"


def test_links_that_go_round_are_told(tmp_path: Path):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    assert unwritable_reason(tmp_path / "a") == "too many levels of symbolic links"
    with pytest.raises(OSError, match="symbolic links"):
        write_atomic(tmp_path / "a", "text")


@pytest.mark.parametrize(
    "text", ["=1+1", "+x", "-x", "@sum", "\t=1", "\r=1", "-1-1", "'=1", "-nan"]
)
def test_a_formula_becomes_a_text(text: str):
    assert csv_cell(text) == f"'{text}"


@pytest.mark.parametrize("text", ["-1.5", "+2", "-1.5e-07", "-inf", "", "x=1", "'x", "'", "a'"])
def test_numbers_and_other_texts_are_unchanged(text: str):
    assert csv_cell(text) == csv_value(text) == text


TEXTS = st.text(st.sampled_from("=+-@\t'\",; x1.e\né") | st.characters(codec="utf-8"))


@given(TEXTS)
def test_no_cell_is_a_formula_and_each_gives_its_text(text: str):
    cell = csv_cell(text)
    assert csv_value(cell) == text
    if cell[:1] in tuple("=+-@\t\r"):
        float(cell)


@given(st.lists(TEXTS, min_size=1, unique=True), st.data())
def test_a_table_gives_its_texts(titles: list[str], data: st.DataObject):
    row = st.lists(TEXTS, min_size=len(titles), max_size=len(titles))
    rows = data.draw(st.lists(row, min_size=1))
    lines = StringIO(format_csv_rows([titles, *rows]), newline="")
    expected = [dict(zip(titles, row, strict=True)) for row in rows]
    found, records = read_csv_rows(lines)
    assert (found, list(records)) == (titles, expected)


def test_numbers_of_a_table_stay_numbers():
    assert format_csv_rows([("a", -1.5, "-2"), ("=a", -1, None)]) == "a,-1.5,-2\n'=a,-1,\n"


def test_a_comment_has_no_formula_between_its_commas():
    assert format_csv_comment("gravity 0,-9.81,0 of x,=1+1") == "# gravity 0,-9.81,0 of x,'=1+1\n"


def word_parser(parsed: list[str]):
    """Parser of the words of a text, which warns of a `?` and tells what it parsed."""

    def parse(source: Source, diagnostics: Diagnostics) -> tuple[str, ...] | None:
        parsed.append(source.text)
        if "?" in source.text:
            diagnostics.warning("a question", None)
        return tuple(source.text.split())

    return once_per_source(parse)


def test_a_text_is_parsed_once_until_it_changes():
    parsed: list[str] = []
    parse = word_parser(parsed)
    first = parse(make_source("a b"), Diagnostics())
    assert parse(make_source("a b"), Diagnostics()) is first
    assert parse(make_source("a c"), Diagnostics()) == ("a", "c")
    assert parse(make_source("a b", "other"), Diagnostics()) == first
    assert parse(make_source("a b", path=Path("other")), Diagnostics()) == first
    assert parsed == ["a b", "a c", "a b", "a b"]


def test_a_text_with_a_diagnostic_is_parsed_each_time():
    parsed: list[str] = []
    parse = word_parser(parsed)
    for _ in range(2):
        diagnostics = Diagnostics()
        assert parse(make_source("why?"), diagnostics) == ("why?",)
        assert len(diagnostics.entries) == 1
    assert parsed == ["why?"] * 2


def test_few_texts_are_kept_and_no_large_ones():
    parsed: list[str] = []
    parse = word_parser(parsed)
    for number in (*range(100), 0):
        parse(make_source(f"{number}"), Diagnostics())
    assert parsed[-1] == "0"
    large = "a" * 2**21
    for _ in range(2):
        parse(make_source(large), Diagnostics())
    assert parsed[-2:] == [large, large]
