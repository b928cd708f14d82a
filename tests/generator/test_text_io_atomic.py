"""Files are written whole or not at all, and refused with a reason."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from unittest.mock import Mock

import pytest

from generator.text_io import unwritable_reason, write_atomic


def test_a_file_that_cannot_be_finished_leaves_nothing(tmp_path: Path):
    path = tmp_path / "fall.action"
    path.write_text("old", encoding="utf-8")
    with pytest.raises(UnicodeEncodeError):
        write_atomic(path, "new \ud800")
    assert path.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_interrupted_writer_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "fsync", Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        write_atomic(tmp_path / "fall.action", "text")
    assert list(tmp_path.iterdir()) == []


def test_a_link_is_followed(tmp_path: Path):
    (tmp_path / "there").mkdir()
    link = tmp_path / "fall.action"
    link.symlink_to(tmp_path / "there" / "real.action")
    write_atomic(link, "text")
    assert link.is_symlink()
    assert (tmp_path / "there" / "real.action").read_text(encoding="utf-8") == "text"


def test_why_a_file_cannot_be_written(tmp_path: Path):
    assert unwritable_reason(tmp_path / "fall.action") is None
    assert unwritable_reason(tmp_path) == "it is a directory"
    missing = tmp_path / "none" / "fall.action"
    assert unwritable_reason(missing) == f"there is no directory `{tmp_path / 'none'}`"
    assert unwritable_reason(tmp_path / ("n" * 300)) == "file name too long"
    assert list(tmp_path.iterdir()) == []


def test_a_folder_without_permission_is_found_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "open", Mock(side_effect=PermissionError(13, "Permission denied")))
    assert unwritable_reason(tmp_path / "fall.action") == "permission denied"


WRITE_FOR_EVER = """
import sys
from pathlib import Path
from generator.text_io import write_atomic
whole = "x" * 2_000_000
print("ready", flush=True)
while True:
    write_atomic(Path(sys.argv[1]), whole)
"""


@pytest.mark.skipif(os.name != "posix", reason="needs SIGKILL")
def test_a_killed_writer_leaves_a_whole_file_or_none(tmp_path: Path):
    moments = random.Random(7)
    cut = 0
    for k in range(8):
        path = tmp_path / str(k) / "fall.action"
        path.parent.mkdir()
        writer = subprocess.Popen(
            [sys.executable, "-c", WRITE_FOR_EVER, str(path)], stdout=subprocess.PIPE
        )
        assert writer.stdout is not None
        assert writer.stdout.readline() == b"ready\n"
        time.sleep(moments.uniform(0.0, 0.03))
        writer.send_signal(signal.SIGKILL)
        writer.communicate()
        assert not path.exists() or path.stat().st_size == 2_000_000
        cut += any(part.suffix == ".part" for part in path.parent.iterdir())
    assert cut > 0
