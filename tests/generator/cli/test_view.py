"""`mover view`: what its files are, its signals and its refusals; `refusals/view.txt` has more."""

import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from generator import read_figure, read_springs
from generator.cli.view import ViewInputs, load_inputs
from springs import SphericalLaw
from tests.browser import PageClient, open_address
from tests.command import answer, mover, run
from tests.motions import clip
from tests.paths import FIGURES
from tests.processes import ENVIRONMENT, child_processes, has_ended

# A background job of a shell ignores SIGINT, and its children inherit that.
START = (
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from generator.cli.app import main; main()"
)
MOVER = [sys.executable, "-c", START, "view"]


def load(path: Path, **options: object) -> ViewInputs:
    every = {"figure_name": None, "second": None, "springs_choice": None, "law": None}
    return load_inputs(path, **{**every, **options})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pose, a motion with and without its run, and springs."""
    from generator.motion_files import motion_writer

    folder = tmp_path_factory.mktemp("view")
    for name in ("hang.npz", "hang.action"):
        motion_writer(folder / name)(clip("prototype"), folder / name)
    for name in ("fly.npz", "fly.action"):
        motion_writer(folder / name)(clip("flying"), folder / name)
    (folder / "bent.pose").write_text("joint left_knee { displacement = (30deg); }\n")
    spring = '[[spring]]\njoints = ["left_knee"]\nstiffness_Nm_rad = 7\n'
    (folder / "stiff.springs.toml").write_text(f'figure = "prototype"\n{spring}')
    (folder / "nameless.springs.toml").write_text(spring)
    return folder


def test_a_pose_is_that_of_its_file(folder: Path):
    shown = load(folder / "bent.pose", figure_name="prototype")
    assert shown.placement.displacements["left_knee"] == pytest.approx(np.radians([30.0]))
    assert shown.motion is None


@pytest.mark.parametrize("name", ["hang.npz", "hang.action", "fly.npz", "fly.action"])
def test_a_motion_names_its_figure_and_springs(folder: Path, name: str):
    shown = load(folder / name, second=folder / "hang.action")
    assert shown.figure.path == FIGURES / "prototype.fig"
    assert shown.springs == read_springs(None, shown.figure)
    assert shown.motion is not None
    assert (shown.motion.recording is None) == name.endswith(".action")
    assert shown.second is not None
    assert not shown.warnings


@pytest.mark.parametrize(
    ("name", "choice"),
    [
        ("none", "none"),
        ("prototype.springs.toml", None),
        ("prototype.coupled.springs.toml over prototype.springs.toml", "coupled"),
    ],
)
def test_springs_of_a_motion_are_those_of_all_tabs(
    folder: Path, tmp_path: Path, name: str, choice: str | None
):
    text = (folder / "hang.action").read_text(encoding="utf-8")
    other = tmp_path / "other.action"
    other.write_text(re.sub("^springs .*$", f"springs {name}", text, flags=re.MULTILINE))
    shown = load(other)
    assert shown.springs_choice == choice
    assert shown.springs == read_springs(choice, shown.figure)
    assert not shown.warnings


@pytest.mark.parametrize("law", SphericalLaw)
def test_spherical_joints_have_the_law_of_the_motion(
    folder: Path, tmp_path: Path, law: SphericalLaw
):
    text = (folder / "hang.action").read_text(encoding="utf-8")
    other = tmp_path / "other.action"
    other.write_text(re.sub("^law .*$", f"law {law.value}", text, flags=re.MULTILINE))
    shown = load(other)
    assert shown.springs == read_springs(None, shown.figure, law)


def moved_motion(folder: Path, target: Path) -> Path:
    """Return a motion whose springs are not beside its figure."""
    text = (folder / "hang.action").read_text(encoding="utf-8")
    moved = target / "moved.action"
    moved.write_text(re.sub("^springs .*$", "springs my.springs.toml", text, flags=re.MULTILINE))
    return moved


def test_springs_that_are_not_found_are_replaced_with_a_warning(folder: Path, tmp_path: Path):
    moved = moved_motion(folder, tmp_path)
    shown = load(moved)
    (only,) = shown.warnings
    assert "`my.springs.toml`" in only.message
    assert shown.springs.origin in only.hint
    assert not load(moved, springs_choice="none").warnings


@pytest.mark.parametrize(
    ("name", "figure"), [("stiff.springs.toml", None), ("nameless.springs.toml", "prototype")]
)
def test_springs_bring_their_figure(folder: Path, name: str, figure: str | None):
    shown = load(folder / name, figure_name=figure)
    assert shown.figure.path == FIGURES / "prototype.fig"
    assert shown.springs == read_springs(folder / name, shown.figure)


@pytest.mark.parametrize("name", ["", ".", "a.fig", "a.pose", "a.npz", "a.springs.toml"])
def test_a_directory_is_refused(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    Path(name).mkdir(exist_ok=True)
    refused = mover("view", name)
    assert refused.exit_code == 2
    expected = f"{name} is a directory" if name else "is empty"
    assert expected in refused.stderr


def test_a_page_is_exported_without_viser(folder: Path, tmp_path: Path):
    (tmp_path / "viser.py").write_text("raise ModuleNotFoundError(name='viser')")
    line = [*MOVER, folder / "hang.action", "--export", "hang.html"]
    environment = {
        **ENVIRONMENT,
        "PYTHONPATH": f"{tmp_path}{os.pathsep}{ENVIRONMENT['PYTHONPATH']}",
    }
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "wrote hang.html" in done.stdout
    assert (tmp_path / "hang.html").read_text(encoding="utf-8").startswith("<!")
    done = subprocess.run([*MOVER, "pendulum"], cwd=tmp_path, env=environment,
                          capture_output=True, text=True)  # fmt: skip
    expected = (
        'error: the page needs viser: in the project\'s folder, `pip install -e ".[viewer]"`\n'
    )
    assert (done.returncode, done.stdout, done.stderr) == (2, "", expected)


def test_an_export_says_what_was_written(folder: Path, tmp_path: Path):
    page = tmp_path / "hang.html"
    said = answer("view", folder / "hang.npz", "--export", page, "--springs", "none")
    assert said["files"] == [str(page)]
    assert said["frames"] == len(clip("prototype").times)
    assert f"wrote {page}" in run("view", folder / "hang.npz", "--export", page).stdout


class TestPage:
    """The process with a server."""

    @pytest.fixture(autouse=True)
    def _viser(self):
        pytest.importorskip("viser", reason="viser is missing")

    def test_a_wrong_port_is_a_usage_error(self):
        assert mover("view", "pendulum", "--port", "99999999").exit_code == 2

    @pytest.mark.skipif(os.name != "posix", reason="needs signals")
    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
    def test_signals_end_the_page(self, folder: Path, number: signal.Signals):
        def end(process: subprocess.Popen[str], address: str) -> None:
            assert b"<html" in open_address(address)[:2000]
            process.send_signal(number)

        code, out, rest = serve([folder / "hang.npz", "--no-browser", "--json"], end)
        assert (code, rest) == (0, "Ctrl-C ends the page.\n")
        assert '"frames"' in out
        assert '"address"' in out

    @pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="the system has no /proc")
    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
    def test_a_live_simulation_ends_with_the_page(self, number: signal.Signals):
        from tests.generator.viewer.conftest import wait_until

        children: list[int] = []

        def end(process: subprocess.Popen[str], address: str) -> None:
            assert process.stderr is not None
            assert process.stderr.readline() == "Ctrl-C ends the page.\n"
            PageClient(address).set("Start", True)
            wait_until(lambda: children.extend(child_processes(process.pid)) or len(children) > 1)
            process.send_signal(number)

        code, _, rest = serve(["pendulum", "--no-browser"], end)
        if number == signal.SIGKILL:  # a child that is still starting may tell that its parent died
            assert code == -number
        else:
            assert (code, rest) == (0, "")
        wait_until(lambda: all(map(has_ended, children)))

    @pytest.mark.skipif(os.name != "posix", reason="needs signals")
    def test_a_page_for_others_warns_and_ends_at_ctrl_c_during_its_start(
        self, folder: Path, tmp_path: Path
    ):
        (tmp_path / "sitecustomize.py").write_text(
            "import os, signal, webbrowser\n"
            "webbrowser.open = lambda _: os.kill(os.getpid(), signal.SIGINT)\n"
        )
        line = [moved_motion(folder, tmp_path), "--host", "0.0.0.0"]
        path = f"{tmp_path}{os.pathsep}{ENVIRONMENT['PYTHONPATH']}"
        variables = {"PYTHONPATH": path, "BROWSER": "one"}
        code, out, rest = serve(line, lambda *_: None, variables)
        assert code == 0
        assert (
            f"warning: other machines reach the page too, at http://{socket.gethostname()}:" in rest
        )
        assert rest.count("warning: the springs of the motion, `my.springs.toml`, are not") == 1
        assert "Traceback" not in rest
        assert out.count("\n") == 1


def serve(
    line: Sequence[object],
    act: Callable[[subprocess.Popen[str], str], None],
    variables: dict[str, str] | None = None,
) -> tuple[int, str, str]:
    """Return exit code, output and the rest of the errors of a page after an action.

    The action gets the process and the address.
    """
    process = subprocess.Popen(
        [*MOVER, *map(str, line)],
        env={**ENVIRONMENT, **(variables or {})},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert process.stderr is not None
        address = process.stderr.readline().strip()
        assert address.startswith("http://127.0.0.1:"), address
        act(process, address)
        code = process.wait(60.0)
        return code, process.stdout.read(), process.stderr.read()
    finally:
        process.kill()
        process.communicate()


def test_the_figure_is_the_named_one(folder: Path):
    assert load(FIGURES / "pendulum.fig").figure == read_figure("pendulum")
