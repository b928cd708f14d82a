"""Draw docs/pictures/compare.png: the page that the commands of docs/compare.md write.

Run with `python -m docs.pictures.compare` in the project's folder, with the extra `test`.
"""

import re
import shlex
from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.browser import launch_browser
from tests.command import run

FOLDER = Path(__file__).parent
COMMANDS = re.findall(
    r"^mover (.+)$", (FOLDER.parent / "compare.md").read_text(encoding="utf-8"), re.MULTILINE
)
MOMENT = 0.55
"""Time that the picture shows [s]."""


def main() -> None:
    """Run the commands, and draw the page in a real browser without a window."""
    with TemporaryDirectory() as name, launch_browser() as browser, chdir(name):
        for line in COMMANDS:
            run(*shlex.split(line))
        tab = browser.new_page(viewport={"width": 1280, "height": 720})
        tab.goto(Path("compare.html").resolve().as_uri())
        tab.evaluate("time => page.ready.then(() => page.seek(time))", MOMENT)
        tab.wait_for_timeout(2500.0)
        tab.screenshot(path=FOLDER / "compare.png", timeout=120e3)


if __name__ == "__main__":
    main()
