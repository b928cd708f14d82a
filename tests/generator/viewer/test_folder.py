"""Names typed on the page stay inside its folder, and no file is replaced."""

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import UsageError
from generator.viewer.folder import (
    free_path,
    name_in_folder,
    names_in_folder,
    path_in_folder,
    save_text,
    written_text,
)

SUFFIXES = (".pose",)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a folder, a link to a file outside and one to the folder above."""
    base = tmp_path_factory.mktemp("page")
    inside = base / "inside"
    (inside / "sub").mkdir(parents=True)
    (base / "outside.pose").write_text("")
    (base / "inside-too").mkdir()
    (inside / "out.pose").symlink_to(base / "outside.pose")
    (inside / "up").symlink_to(base)
    (inside / "round.pose").symlink_to(inside / "sub" / "real.pose")
    return inside


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("a.pose", "a.pose"),
        (" a.pose ", "a.pose"),
        ("sub/a.pose", "sub/a.pose"),
        ("sub/../a.POSE", "a.POSE"),
        ("./a b.pose", "a b.pose"),
        ("round.pose", "sub/real.pose"),
        ("new/a.pose", "new/a.pose"),
    ],
)
def test_a_name_inside_is_accepted(folder: Path, text: str, target: str) -> None:
    assert path_in_folder(folder, text, SUFFIXES) == folder.resolve() / target


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "needs a name"),
        ("   ", "needs a name"),
        ("a", "must end in .pose"),
        (".pose", "must end in .pose"),
        ("a.pose.txt", "must end in .pose"),
        ("../a.pose", "not in the folder"),
        ("../inside-too/a.pose", "not in the folder"),
        ("sub/../../a.pose", "not in the folder"),
        ("/etc/a.pose", "not in the folder"),
        ("out.pose", "not in the folder"),
        ("up/outside.pose", "not in the folder"),
        ("up/inside/../a.pose", "not in the folder"),
        ("a\0.pose", "not the name of a file"),
        ("a\n.pose", "not the name of a file"),
        ("\ud800.pose", "not the name of a file"),
    ],
)
def test_every_other_name_is_refused_in_one_sentence(folder: Path, text: str, reason: str) -> None:
    with pytest.raises(UsageError, match=reason) as failure:
        path_in_folder(folder, text, SUFFIXES)
    assert str(failure.value).isprintable()


def test_an_absolute_path_is_refused_even_inside_the_folder(folder: Path) -> None:
    with pytest.raises(UsageError, match="not in the folder"):
        path_in_folder(folder, str(folder / "a.pose"), SUFFIXES)


def test_the_folder_may_be_a_link(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(folder)
    path = path_in_folder(tmp_path / "link", "a.pose", SUFFIXES)
    assert path == folder.resolve() / "a.pose"


@given(
    st.lists(
        st.sampled_from(["..", ".", "/", "up", "sub", "out.pose", "a.pose", " ", "~", "\\", "\0"])
        | st.text(max_size=5),
        max_size=8,
    ).map("/".join)
)
def test_no_text_leads_out_of_the_folder(folder: Path, text: str) -> None:
    try:
        path = path_in_folder(folder, text, SUFFIXES)
    except UsageError:
        return
    assert path.is_relative_to(folder.resolve())
    assert path == path.resolve()
    assert path.suffix.lower() == ".pose"


def test_names_of_a_folder(folder: Path, tmp_path: Path) -> None:
    for name in ("b.pose", "a.pose", "c.txt"):
        (tmp_path / name).write_text("")
    (tmp_path / "d.pose").mkdir()
    assert names_in_folder(tmp_path, ".pose") == ("a.pose", "b.pose")
    assert names_in_folder(tmp_path / "missing", ".pose") == ()


def test_a_file_that_cannot_be_saved_is_an_error_in_one_sentence(tmp_path: Path) -> None:
    save_text(tmp_path / "a.pose", "text")
    assert (tmp_path / "a.pose").read_text() == "text"
    (tmp_path / "b.pose").mkdir()
    with pytest.raises(UsageError, match=r"^`b\.pose` cannot be saved: [^\n]+$"):
        save_text(tmp_path / "b.pose", "text")


@pytest.mark.parametrize(
    ("present", "name", "free"),
    [
        ((), "a.pose", "a.pose"),
        (("a.pose",), "a.pose", "a-2.pose"),
        (("a.pose", "a-2.pose", "a-4.pose"), "a.pose", "a-3.pose"),
        (("a-2.pose",), "a-2.pose", "a-3.pose"),
        (("a-0.pose",), "a-0.pose", "a-0-2.pose"),
        (("a.b.action",), "a.b.action", "a.b-2.action"),
        (("a.springs.toml",), "a.springs.toml", "a-2.springs.toml"),
        (("x.a.live.toml",), "x.a.live.toml", "x.a-2.live.toml"),
        (("A.POSE",), "A.POSE", "A-2.POSE"),
    ],
)
def test_a_name_that_is_taken_gets_a_number(tmp_path: Path, present, name: str, free: str) -> None:
    for each in present:
        (tmp_path / each).write_text("")
    assert free_path(tmp_path / name) == tmp_path / free


def test_folders_and_links_are_not_replaced_either(tmp_path: Path) -> None:
    (tmp_path / "a.pose").mkdir()
    (tmp_path / "b.pose").symlink_to(tmp_path / "missing")
    for name in ("a", "b"):
        assert free_path(tmp_path / f"{name}.pose") == tmp_path / f"{name}-2.pose"


@given(st.from_regex(r"[a-z0-9.-]{0,12}[a-z0-9-](\.springs\.toml|\.pose)", fullmatch=True))
def test_numbered_names_are_new_and_of_the_same_kind(name: str) -> None:
    with TemporaryDirectory() as folder:
        paths = {Path(folder) / name}
        for number in range(2, 5):
            for path in paths:
                path.touch()
            found = free_path(Path(folder) / name)
            assert found not in paths
            assert found.suffixes[-1] == Path(name).suffixes[-1]
            assert found.parent == Path(folder)
            paths.add(found)
            assert len(paths) == number


def test_what_was_written_is_named(folder: Path) -> None:
    path = path_in_folder(folder, "new/../sub/a.pose", SUFFIXES)
    assert name_in_folder(folder, path) == "sub/a.pose"
    assert written_text(path, path) == "a.pose"
    said = written_text(path, path.with_name("a-2.pose"))
    assert said == "a-2.pose; a.pose exists and was kept"
