"""Command lines that are refused, with their exit codes and messages: `refusals/*.txt`.

    [2] simulate pendulum --stop 0
    error: the stop time 0 s is not after the start 0 s

They run in a copy of `refusals/files`, which none of them may change. `pytest --update-expected`
with this file rewrites codes and messages; a new line may begin with `[?]`. What the parser of the
command line says itself is in `test_app.py`.
"""

import json
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.command import mover
from tests.paths import FIGURES

REFUSALS = Path(__file__).parent / "refusals"
HEAD = re.compile(r"^(?=\[[0-9?]\] )", re.MULTILINE)


def records() -> Iterator[tuple[Path, str]]:
    for path in sorted(REFUSALS.glob("*.txt")):
        yield from ((path, record) for record in HEAD.split(path.read_text(encoding="utf-8"))[1:])


def command_line(record: str) -> str:
    return record.partition("\n")[0].partition(" ")[2]


def contents(folder: Path) -> dict[Path, bytes | None]:
    """The bytes of all files, and None for each folder."""
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


def replace_in_file(path: Path, old: str, new: str) -> None:
    """Replace text in a file that other workers change at the same time."""
    import fcntl  # not on Windows, where nobody rewrites these files

    with path.open("r+", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        text = file.read()
        file.seek(0)
        file.write(text.replace(old, new))
        file.truncate()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(shutil.copytree(REFUSALS / "files", tmp_path_factory.mktemp("refused") / "files"))


@pytest.mark.parametrize(
    ("path", "record"), [pytest.param(*one, id=command_line(one[1])) for one in records()]
)
def test_a_refusal_says_why_and_changes_no_file(
    path: Path,
    record: str,
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
):
    monkeypatch.chdir(folder)
    before = contents(folder)
    line = command_line(record)
    result = mover(*shlex.split(line), "--json")
    said = result.stderr.replace(str(FIGURES), "FIGURES").rstrip("\n")
    fresh = f"[{result.exit_code}] {line}\n{said}\n"
    if request.config.getoption("--update-expected"):
        replace_in_file(path, record, fresh)
    else:
        assert fresh == record
    data = json.loads(result.stdout)
    faults = data["faults"] if "faults" in data else [{"message": data["error"]}]
    assert faults
    assert all(fault["message"] in result.stderr for fault in faults)
    assert contents(folder) == before
