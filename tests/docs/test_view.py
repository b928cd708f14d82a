"""docs/view.md: the example of a live file is read and written again, all keys are named."""

import re

from generator.input_files import live
from tests.paths import DOCS

PAGE = (DOCS / "view.md").read_text(encoding="utf-8")
EXAMPLE, *_ = re.findall(r"^```toml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


def test_the_live_file_is_read_and_written_again() -> None:
    log = live.LIVE_FILE.parse_text(EXAMPLE).require_value()
    assert len(log.changes) == 3
    assert live.write_live(log).strip() == EXAMPLE.strip()


def test_the_page_names_every_key_of_a_change() -> None:
    for key in live._CHANGE_PARSERS:
        assert f"`{key}" in PAGE, key
