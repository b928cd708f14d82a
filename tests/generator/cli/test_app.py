"""The command line: what it prints where, what it writes, and with which code it ends."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from generator import read_action
from generator.cli.answer import CommandResult, json_text
from generator.cli.app import COMMANDS, app
from generator.cli.progress import item_progress_bar
from generator.recording import ENERGY_KINDS, Ending
from tests.paths import FIGURES, ROOT

PROTOTYPE = FIGURES / "prototype.fig"
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}

SPEED = """
import sys
import generator.cli.app
SLOW = {"exudyn", "scipy", "numpy", "matplotlib", "generator.figure_file"}
print(*sorted(SLOW & set(sys.modules)))
"""


def mover(*words: object) -> Result:
    """Run the command in this process."""
    return CliRunner().invoke(app, [str(word) for word in words])


def mover_process(*words: object, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the command as a user does, from another folder."""
    line = [sys.executable, "-m", "generator.cli.app", *map(str, words)]
    return subprocess.run(
        line, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False
    )


def pendulum_with(tmp_path: Path, *changes: tuple[str, str]) -> Path:
    """A copy of the pendulum with other words in it."""
    text = (FIGURES / "pendulum.fig").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "changed.fig"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_command_starts_without_slow_libraries():
    done = subprocess.run(
        [sys.executable, "-c", SPEED], env=ENVIRONMENT, capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == ""


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_a_command_opens_with_its_line_in_the_list(command: str):
    target, summary = COMMANDS[command]
    module, function = target.split(":")
    assert vars(import_module(module))[function].__doc__.splitlines()[0] == summary
    listed = re.findall(r"^  (\w+)  +(.*?)(?:\.\.\.)?$", mover("--help").stdout, re.MULTILINE)
    assert summary.startswith(dict(listed)[command])
    result = mover(command, "-h")
    assert result.exit_code == 0
    assert summary in " ".join(result.stdout.split())


def count(steps: int = 1, *, show_progress: bool, as_json: bool) -> CommandResult:
    """Count, and show it."""
    if show_progress and not as_json:
        with item_progress_bar(steps, "steps") as done:
            for k in range(steps):
                done(str(k))
    return CommandResult(f"counted {steps}", steps)


COUNT = """
from generator.cli import app
app.COMMANDS["count"] = ("tests.generator.cli.test_app:count", "Count, and show it.")
app.main()
"""


@pytest.mark.skipif(os.name != "posix", reason="needs a terminal")
@pytest.mark.parametrize(
    ("words", "said", "shown"),
    [((), "counted 3\n", True), (("--json",), "3\n", False), (("--quiet",), "", False)],
)
def test_a_bar_is_shown_on_a_terminal_only(words: Sequence[str], said: str, shown: bool):
    pty = pytest.importorskip("pty")
    terminal, inner = pty.openpty()
    done = subprocess.run(
        [sys.executable, "-c", COUNT, "count", "--steps", "3", *words],
        env={**ENVIRONMENT, "TERM": "xterm"},
        stdout=subprocess.PIPE,
        stderr=inner,
        check=False,
    )
    os.close(inner)
    seen = b""
    with suppress(OSError):  # how a terminal says that the other end is closed
        while chunk := os.read(terminal, 1000):
            seen += chunk
    assert (done.returncode, done.stdout.decode()) == (0, said), seen
    assert (b"3 of 3 steps" in seen) is shown
    assert bool(seen) is shown


def test_the_version_is_told():
    assert mover("--version").stdout.startswith("mover ")


# simulate


def test_a_run_from_another_folder_writes_an_action_file(tmp_path: Path):
    done = mover_process(
        "simulate", "prototype", "--stop", 0.1, "-o", "fall.action", folder=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert "energy [J]" in done.stdout
    assert "fall.action" in done.stdout
    assert "warning: total mass 49.28 kg" in done.stderr
    assert "pass" not in done.stderr
    action = read_action(tmp_path / "fall.action")
    assert action.times.tolist() == pytest.approx(np.arange(6) * 0.02)
    assert sum(part.shape[1] for part in action.displacements.values()) == 22
    assert action.header.outcome is Ending.DONE
    assert action.header.springs == "prototype.springs.toml"
    assert action.header.law == "conservative"


def test_the_json_of_a_run(tmp_path: Path):
    files = [tmp_path / "fall.action", tmp_path / "fall.csv"]
    result = mover("simulate", "prototype", "--stop", 0.1, "--json", "-o", files[0], "-o", files[1])
    assert result.exit_code == 0
    said = json.loads(result.stdout)
    assert said["figure"] == "prototype"
    assert said["outcome"] == "done"
    assert said["simulated_s"] == pytest.approx(0.1)
    assert said["wall_s"] > 0.0
    assert said["build_s"] > 0.0
    assert said["steps"] > 0
    assert 0.0 < said["step_s"] <= 0.02
    assert said["tolerance_rad"] == 1e-3
    assert 0.0 < said["error_estimate_rad"] <= 1e-3
    assert said["held_until_s"] == pytest.approx(0.1)
    assert set(said["energy"]) == set(ENERGY_KINDS)
    assert all(set(ends) == {"first", "last"} for ends in said["energy"].values())
    assert said["energy"]["gravity"]["last"] < said["energy"]["gravity"]["first"]
    assert 0.0 <= said["constraint_drift_m"] < 1e-4
    assert said["files"] == [str(path) for path in files]
    assert all(path.stat().st_size > 0 for path in files)


def test_a_quiet_run_says_nothing(tmp_path: Path):
    path = tmp_path / "swing.csv"
    result = mover("simulate", "prototype", "--stop", 0.02, "--quiet", "-o", path)
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")
    assert path.exists()


def test_a_fixed_step_has_no_error_estimate():
    result = mover("simulate", "pendulum", "--stop", 0.1, "--step", 0.001, "--json")
    said = json.loads(result.stdout)
    assert (said["step_s"], said["steps"]) == (0.001, 100)
    assert said["error_estimate_rad"] is None
    assert said["tolerance_rad"] is None


def start_of(path: Path, *words: object) -> dict[str, list[float]]:
    """Displacements of a pendulum's first frame [rad or m]."""
    result = mover("simulate", "pendulum", "--stop", 0.02, "--step", 0.01, *words, "-o", path)
    assert result.exit_code == 0, result.output
    return {name: part[0].tolist() for name, part in read_action(path).displacements.items()}


def test_set_and_velocity_are_in_degrees(tmp_path: Path):
    words = ("--set", "shoulder=30,0,-45", "--gravity", "0,0,0", "--springs", "none")
    path = tmp_path / "swing.action"
    (start,) = start_of(path, *words).values()
    assert start == pytest.approx([np.radians(30.0), 0.0, np.radians(-45.0)], abs=1e-12)
    start_of(path, *words, "--velocity", "shoulder=100,0,0")
    (moved,) = read_action(path).displacements.values()
    assert moved[1, 0] - moved[0, 0] == pytest.approx(np.radians(2.0), rel=1e-3)


def test_a_free_figure_has_a_row_named_after_its_segment(tmp_path: Path):
    words = ("--free-root", "--gravity", "0,0,0", "--velocity", "link1=0,0,0,0,50,0")
    path = tmp_path / "flight.action"
    start_of(path, *words)
    action = read_action(path)
    assert list(action.displacements) == ["link1"]
    moved = action.displacements["link1"]
    assert moved.shape[1] == 6
    assert moved[-1, 4] - moved[0, 4] == pytest.approx(0.01, abs=1e-9)


def test_law_start_and_python_torques_reach_the_run(tmp_path: Path):
    path = tmp_path / "late.action"
    words = ("--start", 1, "--stop", 1.04, "--law", "weighted", "--python-torques")
    result = mover("simulate", "prototype", "--step", 0.004, *words, "-o", path)
    assert result.exit_code == 0, result.output
    action = read_action(path)
    assert action.times.tolist() == pytest.approx([1.0, 1.02, 1.04])
    assert action.header.law == "weighted"


def test_loads_do_work(tmp_path: Path):
    loads = tmp_path / "push.csv"
    loads.write_text(
        "site,kind,time [s],x [N],y [N],z [N]\n"
        "link1.CM,globalforce,0,5,5,5\nlink1.CM,globalforce,1,5,5,5\n",
        encoding="utf-8",
    )
    result = mover("simulate", "pendulum", "--stop", 0.1, "--loads", loads, "--json")
    assert abs(json.loads(result.stdout)["energy"]["work"]["last"]) > 1e-6


def test_a_failed_run_writes_what_was_simulated(tmp_path: Path):
    path = tmp_path / "snap.action"
    result = mover("simulate", "prototype", "--springs", "printed", "--stop", 0.5, "-o", path)
    assert result.exit_code == 3
    assert "the frames up to" in result.stderr
    action = read_action(path)
    assert action.header.outcome in (Ending.TURNED_OVER, Ending.SOLVER_FAILED)
    assert 0.0 < action.times[-1] < 0.5
    assert action.header.message.split()[1] in action.displacements


def test_a_run_that_takes_too_long_ends(tmp_path: Path):
    path = tmp_path / "long.csv"
    words = ("--stop", 5, "--step", 0.001, "--wall-limit", 0.2, "--json", "-o", path)
    result = mover("simulate", "prototype", *words)
    assert result.exit_code == 3
    said = json.loads(result.stdout)
    assert said["outcome"] == "wall time used up"
    assert said["simulated_s"] < 5.0
    assert path.exists()


@pytest.mark.skipif(os.name != "posix", reason="needs a shell")
def test_there_may_be_no_error_stream():
    line = f"{sys.executable} -m generator.cli.app simulate pendulum --stop 0.1 2>&-"
    done = subprocess.run(line, shell=True, stdout=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 0
    assert "Finished 0.1 s" in done.stdout


@pytest.mark.skipif(os.name != "posix", reason="needs SIGINT")
def test_ctrl_c_keeps_what_was_simulated(tmp_path: Path):
    pty = pytest.importorskip("pty")
    terminal, inner = pty.openpty()
    line = [sys.executable, "-m", "generator.cli.app", "simulate", "prototype"]
    line += ["--stop", "300", "-o", "fall.action"]
    run = subprocess.Popen(
        line,
        cwd=tmp_path,
        env={**ENVIRONMENT, "TERM": "xterm"},
        stdout=subprocess.PIPE,
        stderr=inner,
    )
    os.close(inner)
    seen = b""
    while b"real time" not in seen:
        seen += os.read(terminal, 1000)
    run.send_signal(signal.SIGINT)
    try:
        while chunk := os.read(terminal, 1000):
            seen += chunk
    except OSError:  # how a terminal says that the other end is closed
        pass
    said, _ = run.communicate()
    assert run.returncode == 3
    assert b"pass 1, step" in seen
    assert b"interrupted at" in said
    action = read_action(tmp_path / "fall.action")
    assert action.header.outcome is Ending.INTERRUPTED
    assert 0.0 < action.times[-1] < 300.0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("-o", "fall.gif"), "`.gif` is not a known suffix; known are .action, .csv"),
        (("-o", "fall"), "the suffix is missing"),
        (("--stop", "0"), "the stop time 0 s is not after the start 0 s"),
        (("--stop", "1e9"), "use a longer --frame or an earlier --stop"),
        (("--stop", "soon"), "Invalid value for '--stop'"),
        (("--wall-limit", "0"), "the wall limit must be positive"),
        (("-o", "a.csv", "-o", "./a.csv"), "a.csv: the file is listed twice"),
        (("--free-root", "--velocity", "shoulder=1,2,3"), "the figure has no joint `shoulder`"),
        (("--stop", "inf"), "--stop inf: the number must be finite"),
        (("--frame", "nan"), "--frame nan: the number must be finite"),
        (("--frame", "0"), "frame must be positive"),
        (("--frame", "1e-9"), "more than 1,000,000 frames"),
        (("--step", "-1"), "the step must be positive"),
        (("--step", "0.001", "--tolerance", "0.1"), "--step and --tolerance exclude each other"),
        (("--law", "cubic"), "cubic"),
        (("--gravity", "0,-9.81"), "expected three numbers"),
        (("--gravity", "0,0,inf"), "the numbers must be finite"),
        (("--set", "shoulder"), "expected JOINT=a,b,c"),
        (
            ("--set", "shouldre=1,2,3"),
            "the figure has no joint `shouldre`; did you mean `shoulder`?",
        ),
        (("--set", "shoulder=1,2"), "`shoulder` takes 3 values (deg,deg,deg), not 2"),
        (("--set", "shoulder=1,2,x"), "`x` is not a finite number"),
        (("--set", "shoulder=1,2,1e999"), "`1e999` is not a finite number"),
        (("--set", "shoulder=1,2,3", "--set", "shoulder=1,2,3"), "`shoulder` is set twice"),
        (("--velocity", "shouldre=1,2,3"), "--velocity shouldre=1,2,3: the figure has no joint"),
        (("--strict",), "--strict"),
    ],
)
def test_a_wrong_command_line_ends_with_2(words: Sequence[str], message: str):
    result = mover("simulate", "pendulum", *words)
    assert result.exit_code == 2
    assert message in result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--velocity", "shoulder=1e300,0,0"), "`1e300` is beyond 1e6 deg"),
        (("--set", "shoulder=0,1e100,0"), "`1e100` is beyond 1e6 deg"),
        (("--gravity", "0,1e300,0"), "the numbers must be at most 1e+09"),
    ],
)
def test_numbers_beyond_all_that_is_meant_are_a_matter_of_usage(words: Sequence[str], said: str):
    result = mover("simulate", "pendulum", *words, "--stop", 0.1, "--json")
    assert result.exit_code == 2
    assert said in result.stderr
    assert said in json.loads(result.stdout)["error"]


def test_numbers_that_json_does_not_have_are_null():
    data = {"a": [1.0, float("nan"), (float("inf"), 2)], "b": {"c": -float("inf"), "d": "nan"}}
    assert json.loads(json_text(data)) == {
        "a": [1.0, None, [None, 2]],
        "b": {"c": None, "d": "nan"},
    }
    assert json_text({"a": 1.5}) == '{\n  "a": 1.5\n}'


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("simulate", "pendulum", "--stop", "soon"), "Invalid value for '--stop'"),
        (("simulate",), "Missing argument 'FIGURE'"),
        (("shoulder", "prototype", "--side", "left", "--latitude", "abc"), "'--latitude'"),
        (("com", "prototype", "--strict"), "No such option: --strict"),
        (("dance", "prototype"), "No such command 'dance'"),
        (("--strict",), "No such option: --strict"),
    ],
)
def test_what_the_parser_refuses_is_told_in_json_too(words: Sequence[str], said: str):
    plain, result = mover(*words), mover(*words, "--json")
    assert (plain.exit_code, result.exit_code) == (2, 2)
    assert plain.stdout == ""
    assert said in plain.stderr
    assert result.stderr == plain.stderr
    assert said in json.loads(result.stdout)["error"]


def test_a_missing_figure_ends_with_1(tmp_path: Path):
    done = mover_process("simulate", "prototipe", "-o", "fall.action", folder=tmp_path)
    assert done.returncode == 1
    assert "did you mean `prototype`?" in done.stderr
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--springs", "none.toml"), "cannot be read"),
        (("--springs", "printed"), "there is no `pendulum.optional` beside the figure"),
        (("--loads", "none.csv"), "`none.csv` cannot be read"),
        (("-o", "none/fall.action"), "cannot be written: there is no directory `none`"),
        (("-o", ".csv/fall.csv", "-o", "none/fall.csv"), "there is no directory `.csv`"),
    ],
)
def test_a_wrong_input_ends_with_1(words: Sequence[str], message: str):
    result = mover("simulate", "pendulum", *words, "--json")
    assert result.exit_code == 1
    assert message in result.stderr
    assert message in json.loads(result.stdout)["faults"][0]["message"]


@pytest.mark.parametrize("option", ["figure", "--loads", "--springs"])
def test_a_run_does_not_write_over_what_it_reads(option: str, tmp_path: Path):
    names = {"figure": "pendulum.action", "--loads": "push.csv", "--springs": "own.csv"}
    path = tmp_path / names[option]
    texts = {
        "figure": (FIGURES / "pendulum.fig").read_text(encoding="utf-8"),
        "--loads": "site,kind,time [s],x [N],y [N],z [N]\nlink1.CM,globalforce,0,5,5,5\n",
        "--springs": "1 1\n0 1 0 0\n0 0\n0 0 0\n",
    }
    path.write_text(texts[option], encoding="utf-8")
    words = (path,) if option == "figure" else ("pendulum", option, path)
    result = mover("simulate", *words, "--stop", 0.02, "-o", tmp_path / "." / path.name)
    assert result.exit_code == 1
    assert f"`{path}` cannot be written: the run reads it" in result.stderr
    assert path.read_text(encoding="utf-8") == texts[option]


def test_a_run_may_start_before_zero(tmp_path: Path):
    path = tmp_path / "early.csv"
    words = ("--start", -0.06, "--stop", -0.02, "-o", path)
    result = mover("simulate", "pendulum", *words)
    assert result.exit_code == 0, result.output
    assert path.exists()


def test_a_directory_in_place_of_the_file_is_found_before_the_run(tmp_path: Path):
    (tmp_path / "fall.csv").mkdir()
    result = mover("simulate", "pendulum", "-o", tmp_path / "fall.csv")
    assert result.exit_code == 1
    assert "cannot be written: it is a directory" in result.stderr


def test_a_figure_without_mass_is_not_simulated(tmp_path: Path):
    path = pendulum_with(tmp_path, ("mass = ", "# mass = "))
    result = mover("simulate", path)
    assert result.exit_code == 1
    assert "moves but has no mass" in result.stderr


def test_a_chain_that_no_joint_can_hold_is_refused_with_its_place(tmp_path: Path):
    path = pendulum_with(tmp_path, ("R(1,0,0)*R(0,1,0)", "R(0,1,0)*R(0,1,0)"))
    result = mover("simulate", path)
    assert result.exit_code == 1
    assert "perpendicular" in result.stderr
    assert "changed.fig:" in result.stderr


def test_a_pose_that_cannot_close_a_loop_ends_with_1():
    figure = json.loads(mover("describe", "fourbar", "--json").stdout)
    words = [word for j in figure["joints"] for word in ("--set", f"{j['name']}=50")]
    result = mover("simulate", "fourbar", *words, "--stop", 0.1)
    assert result.exit_code == 1
    assert result.stderr.count("error:") == 1


# check


def test_check_passes_the_prototype_with_its_warning():
    result = mover("check", "prototype")
    assert result.exit_code == 0
    assert "warning: total mass 49.28 kg" in result.stdout
    assert result.stdout.endswith("prototype: no errors, 1 warning; the figure can be simulated\n")


def test_check_tells_all_errors_with_their_places(tmp_path: Path):
    path = pendulum_with(tmp_path, ("mass = ", "mas = "), ("root = ", "rot = "))
    result = mover("check", path)
    assert result.exit_code == 1
    assert "did you mean `mass`?" in result.stdout
    assert "did you mean `root`?" in result.stdout
    assert "the figure cannot be used" in result.stdout
    said = json.loads(mover("check", path, "--json").stdout)
    assert said["error"] == "the input is wrong"
    assert said["verdict"].endswith("the figure cannot be used")
    faults = said["faults"]
    assert {fault["severity"] for fault in faults} >= {"error"}
    assert all(fault["file"] == str(path) and fault["line"] > 0 for fault in faults)


def test_check_says_what_cannot_be_simulated(tmp_path: Path):
    path = pendulum_with(tmp_path, ("mass = ", "# mass = "))
    result = mover("check", path)
    assert result.exit_code == 0
    assert "the figure can be read, but not simulated" in result.stdout


def test_check_finds_a_figure_that_cannot_move(tmp_path: Path):
    path = tmp_path / "stone.fig"
    path.write_text("figure { segment stone { site base { } } root = stone.base; }")
    for command in ("check", "simulate"):
        result = mover(command, path)
        assert result.exit_code == 1
        assert "none of its segments moves" in result.output


def test_check_finds_a_loop_that_cannot_close(tmp_path: Path):
    text = (FIGURES / "fourbar.fig").read_text(encoding="utf-8")
    path = tmp_path / "wide.fig"
    path.write_text(text.replace("trans(30cm,0cm,0cm)", "trans(3m,0cm,0cm)"), encoding="utf-8")
    assert path.read_text(encoding="utf-8") != text
    result = mover("check", path)
    assert result.exit_code == 1
    assert "opens the loop" in result.stdout
    assert mover("check", "fourbar").exit_code == 0


def test_check_looks_into_the_springs(tmp_path: Path):
    springs = tmp_path / "own.springs.toml"
    springs.write_text('[[spring]]\njoints = ["wiast"]\nstiffness_Nm_rad = 1.0\n', encoding="utf-8")
    result = mover("check", "prototype", "--springs", springs)
    assert result.exit_code == 1
    assert "did you mean `waist`?" in result.stdout


# describe and cite


def test_the_prototype_is_described():
    said = json.loads(mover("describe", "prototype", "--json").stdout)
    assert said["degrees_of_freedom"] == 22
    assert said["total_mass_kg"] == pytest.approx(49.278, abs=1e-3)
    assert len(said["segments"]) == 11
    assert [s["name"] for s in said["segments"] if s["ground"]] == ["body_root"]
    kinds = [joint["kind"] for joint in said["joints"]]
    assert (kinds.count("spherical"), kinds.count("revolute")) == (6, 4)
    knee = said["springs"]["joints"]["left_knee"]["axes"][0]
    assert knee["axis"] == "-y"
    assert knee["viscous"] == pytest.approx(0.08)
    (law,) = knee["laws"]
    assert law["law"] == "cubic"
    assert law["sense"] == -1
    assert law["dead_zone_deg"] == pytest.approx([0.0, 89.0], abs=0.1)
    assert "root_torso" not in said["springs"]["joints"]


def test_the_description_is_readable():
    result = mover("describe", "pendulum")
    assert result.exit_code == 0
    assert result.stdout.startswith(
        "pendulum: 1 moving segment, 1 joint, 3 degrees of freedom, 0.025 kg\n"
    )
    assert "40 deg 20 deg" in result.stdout
    assert "spherical" in result.stdout


def test_stiffness_and_limits_are_described(tmp_path: Path):
    limits = "llimit = (-10deg,-20deg,-30deg); ulimit = (10deg,20deg,30deg); damp = (1,1,1);"
    path = pendulum_with(tmp_path, ("type = ", limits + " type = "))
    result = mover("describe", path)
    assert "linear " in result.stdout
    assert "stops at -20 deg .. 20 deg" in result.stdout
    said = json.loads(mover("describe", path, "--json").stdout)
    laws = [law["law"] for law in said["springs"]["joints"]["shoulder"]["axes"][0]["laws"]]
    assert laws == ["linear", "stop"]


def test_a_figure_cites_the_thesis_and_its_springs():
    said = json.loads(mover("cite", "prototype", "--json").stdout)
    texts = [entry["reference"] for entry in said["references"]]
    assert texts[0].startswith("E. M. Otani")
    assert any("Engin" in text for text in texts)
    assert len(set(texts)) == len(texts)
    knee = [entry for entry in said["references"] if "left_knee -y" in entry["used_for"]]
    assert len(knee) == 1
    plain = mover("cite", "prototype").stdout
    assert all(text in plain for text in texts)


def test_a_reader_that_leaves_early_sees_no_traceback(tmp_path: Path):
    line = f"{sys.executable} -m generator.cli.app describe prototype --json | head -c 10"
    done = subprocess.run(
        line, shell=True, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=True
    )
    assert "Traceback" not in done.stderr
    assert done.stdout.startswith("{")


@pytest.mark.skipif(sys.platform != "linux", reason="needs a device that is full")
@pytest.mark.parametrize("words", ["describe pendulum", "--help", "check pendulum --json"])
def test_an_output_that_is_full_is_told(words: str):
    line = f"{sys.executable} -m generator.cli.app {words} > /dev/full"
    done = subprocess.run(
        line, shell=True, env=ENVIRONMENT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stderr == "error: the output could not be written: No space left on device\n"


@pytest.mark.skipif(sys.platform != "linux", reason="needs a device that is full")
@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("com prototype --set x=1 --json", 2),
        ("com prototype --strict --json", 2),
        ("com nobody --json", 1),
        ("com prototype --json", 0),
    ],
)
def test_an_error_stream_that_is_full_changes_nothing(words: str, code: int):
    line = f"{sys.executable} -m generator.cli.app {words} 2> /dev/full"
    done = subprocess.run(
        line, shell=True, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True, check=False
    )
    assert done.returncode == code
    assert ("error" in json.loads(done.stdout)) == (code != 0)


INTERRUPTED = """
import builtins
find = builtins.__import__
def interrupted(name, *others, **more):
    if name == MODULE:
        raise KeyboardInterrupt
    return find(name, *others, **more)
builtins.__import__ = interrupted
from generator.cli.app import main
main()
"""


@pytest.mark.parametrize(
    "module",
    ["typer", "generator.cli.answer", "generator.diagnostics", "numpy"],
)
def test_ctrl_c_while_modules_are_loaded_is_told(module: str):
    code = INTERRUPTED.replace("MODULE", repr(module))
    done = subprocess.run(
        [sys.executable, "-c", code, "com", "prototype", "--json"],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 3
    assert done.stderr == "error: interrupted before anything was computed\n"
    assert json.loads(done.stdout) == {"error": "interrupted before anything was computed"}


@pytest.mark.skipif(os.name != "posix", reason="needs a shell that closes streams")
def test_the_output_may_be_closed(tmp_path: Path):
    line = f"{sys.executable} -m generator.cli.app simulate pendulum --stop 0.02 -o swing.csv >&-"
    done = subprocess.run(
        line, shell=True, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "swing.csv").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="needs names that are any bytes")
def test_a_name_that_is_no_text_can_be_told(tmp_path: Path):
    path = pendulum_with(tmp_path).rename(tmp_path / "odd\udcff.fig")
    line = [sys.executable, "-m", "generator.cli.app", "check", path.name]
    environment = {**ENVIRONMENT, "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, check=False)
    assert done.returncode == 0
    assert b"odd\\udcff.fig: no errors" in done.stdout


@pytest.mark.parametrize("command", ["check", "describe", "cite", "simulate"])
def test_no_command_takes_what_is_no_figure(command: str, tmp_path: Path):
    path = tmp_path / "noise.fig"
    path.write_bytes(bytes(range(256)))
    result = mover(command, path)
    assert result.exit_code == 1
    assert "noise.fig" in result.output


def test_the_names_of_the_python_face():
    import generator

    assert set(generator.__all__) <= set(dir(generator))
    assert all(getattr(generator, name) is not None for name in generator.__all__)
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = generator.simulat
