"""Plates are made in processes that may raise or die without harm to the others."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from plots.plate import DrawnPlate, FailedPlate
from plots.run import make_plate, make_plates
from tests import tiny_plates
from tests.tiny_plates import TARGETS


def made(names: list[str], jobs: int) -> dict[str, DrawnPlate | FailedPlate]:
    targets = {name: TARGETS[name] for name in names}
    return {result.name: result for result in make_plates(targets, jobs)}


@pytest.mark.slow
def test_what_cannot_be_made_is_told_and_harms_no_other():
    line = Path(tiny_plates.__file__).read_text(encoding="utf-8").splitlines()
    number = 1 + line.index('    raise ValueError("no\\nmoments")')
    results = made(["raising", "dying", "complaining", "misnamed", "spring"], jobs=1)
    assert isinstance(results.pop("spring"), DrawnPlate)
    assert {name: str(failed) for name, failed in results.items()} == {
        "raising": "the plate `raising` could not be made: "
        f"ValueError: no moments (tiny_plates.py, line {number})",
        "dying": "the plate `dying` could not be made: its process ended with exit code 7",
        "complaining": "the plate `complaining` could not be made: its process ended with exit "
        "code 3: out of memory",
        "misnamed": "the plate `misnamed` could not be made: its maker names it `spring`",
    }


@pytest.mark.parametrize("target", ["plots.no_such_module:plate", "plots.plate:no_such_plate"])
def test_a_plate_without_a_maker(target: str):
    result = make_plate("spring", target)
    assert isinstance(result, FailedPlate)
    assert "no_such" in result.reason


@pytest.mark.slow
def test_settings_that_cannot_be_drawn_with_are_the_reason(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("MPLBACKEND", "nonsense")
    (result,) = made(["spring"], jobs=1).values()
    assert isinstance(result, FailedPlate)
    assert result.reason.startswith("ValueError: ")
    assert "nonsense" in result.reason


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="asks for a process by its number")
def test_a_worker_ends_with_its_parent(tmp_path: Path):
    number = tmp_path / "number"
    script = (
        "from plots.run import make_plate, make_plates; from tests.tiny_plates import TARGETS; "
        "list(make_plates({'endless': TARGETS['endless']}, 1))"
    )
    environment = os.environ | {"ENDLESS_PROCESS": str(number)}
    with subprocess.Popen([sys.executable, "-c", script], env=environment) as asking:
        assert soon(lambda: number.exists() and bool(number.read_text()))
        asking.send_signal(signal.SIGKILL)
    assert soon(lambda: not alive(int(number.read_text())))


def soon(happens: Callable[[], bool]) -> bool:
    """Return whether a condition holds before the time limit."""
    patience = time.monotonic() + 30.0
    while not happens() and time.monotonic() < patience:
        time.sleep(0.02)
    return happens()


def alive(number: int) -> bool:
    """Return whether a process runs; one that has ended does not, even before it is waited for."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{number}/stat")
    return not (status.exists() and status.read_text().rsplit(")", 1)[1].split()[0] == "Z")


def test_no_plates():
    assert made([], jobs=1) == {}


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="asks for a process by its number")
def test_what_the_check_raises_ends_the_processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    number = tmp_path / "number"
    monkeypatch.setenv("ENDLESS_PROCESS", str(number))

    def check() -> None:
        if number.exists() and number.read_text():
            raise TimeoutError

    with pytest.raises(TimeoutError):
        list(make_plates({"endless": TARGETS["endless"]}, 1, check))
    with pytest.raises(ProcessLookupError):
        os.kill(int(number.read_text()), 0)


def test_processes_end_with_the_generator():
    results = make_plates({"spring": TARGETS["spring"], "damper": TARGETS["damper"]}, 1)
    assert isinstance(next(results), DrawnPlate)
    results.close()
    assert list(results) == []
