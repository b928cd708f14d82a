"""`mover plots`: draw plates in several processes and write them with a report of all claims."""

import multiprocessing
import os
import platform
import shlex
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from dataclasses import dataclass, field
from enum import StrEnum
from importlib import import_module
from importlib.metadata import version
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import ModuleType
from typing import Annotated, NamedTuple

import typer

from generator.child_processes import (
    blocked_interrupt,
    cores,
    format_exit,
    redirect_output,
    serve_parent_only,
    single_threaded_libraries,
)
from generator.cli.answer import HIDDEN, CommandResult, Paragraphs, Table, format_count
from generator.cli.interrupts import defer_interrupt, hold_interrupts
from generator.cli.outputs import check_writable, unwritable_file_error, write_files
from generator.cli.progress import ItemMonitor, item_progress_bar, no_monitor
from generator.conversion import READABLE_SUFFIXES
from generator.diagnostics import Diagnostic, InputError, MoverError, UsageError, spelling_hint
from generator.text_io import is_file, is_folder, os_error_reason
from plots.medium import REPORT, Medium, drawing_for
from plots.own_plates import OwnFiles
from plots.plate import Claim, DrawnPlate, FailedPlate, Outcome
from plots.report import PICTURE_FORMAT, gallery_page, report, tally

PLATES: Mapping[str, str] = {
    name: f"plots.plates.{module}:{name}"
    for module, names in (
        ("elbow_knee", ("elbow", "knee")),
        ("shoulder", ("shoulder_abduction", "shoulder_flexion", "shoulder_rotation")),
        ("hip_directional", ("hip_directional",)),
        ("hip", ("hip_flexion", "hip_abduction", "hip_rotation")),
        ("waist", ("waist_bend", "waist_flexion", "waist_twist")),
        ("waist_senses", ("waist_senses",)),
        ("clavicle", ("clavicle",)),
        ("two_joint_hip", ("two_joint_hip",)),
        ("off_axis", ("off_axis",)),
        ("fall_on_floor", ("fall_on_floor",)),
        ("verification", ("verification",)),
        ("exported_fall", ("exported_fall",)),
        ("contact", ("contact",)),
        ("floor_falls", ("floor_falls",)),
        ("work_precision", ("work_precision",)),
        ("person_segments", ("person_segments",)),
        ("person_body", ("person_body",)),
        ("person_pendulums", ("person_pendulums",)),
        ("person_posture", ("person_posture",)),
        ("person_reach", ("person_reach",)),
        ("strength_of_legs", ("strength_of_legs",)),
        ("falls_of_people", ("falls_of_people",)),
        ("study_of_falls", ("study_falls", "study_falls_stiffness")),
    )
    for name in names
}
"""Maker of each plate, `module:function`, by plate name, in the order of the gallery."""


REPORT_NAME = "report.html"


class MediumName(StrEnum):
    """Medium of pictures."""

    REPORT = "report"
    PAPER = "paper"


class Width(StrEnum):
    """Width of a picture in a paper [mm]."""

    COLUMN = "85"
    PAGE = "174"


@dataclass(frozen=True)
class PlateList(CommandResult):
    """Names of all plates."""

    names: Sequence[str]

    def paragraphs(self) -> Paragraphs:
        """Return the names."""
        return ("\n".join(self.names),)

    def to_json(self) -> Sequence[str]:
        """Return the names."""
        return self.names


class PlateData(NamedTuple):
    """A plate with its claims."""

    name: str
    title: str
    claims: Sequence[Claim]


@dataclass(frozen=True)
class PlotsResult(CommandResult):
    """Plates that were drawn."""

    claims: int
    hold: int
    plates: Sequence[PlateData]
    failed: Sequence[FailedPlate]
    interrupted: bool
    files: Sequence[Path]
    report: Path | None = field(metadata=HIDDEN)

    def paragraphs(self) -> Paragraphs:
        """Return the plates in a line each, the outcomes of their claims, and the files."""
        lines = [str(Table([(plate.name, _single_line(plate.title)) for plate in self.plates], 2))]
        if self.claims:
            lines.append(tally([claim for plate in self.plates for claim in plate.claims]))
        counts = Counter(path.parent for path in self.files)
        lines += [f"wrote {format_count(n, 'file')} in {folder}" for folder, n in counts.items()]
        if self.report in self.files:
            lines.append(f"the report is {self.report}")
        return ("\n".join(lines),)

    def details(self) -> Paragraphs:
        """Return the claims of each plate."""
        rows: list[list[str]] = []
        for claim in (claim for plate in self.plates for claim in plate.claims):
            bound = f"({claim.bound_text})" if claim.bound_text else ""
            rows.append([claim.verdict, claim.measured_text, bound, _single_line(claim.sentence)])
        lines = iter(str(Table(rows, 4)).splitlines())
        for plate in self.plates:
            paragraph = [f"{plate.name}: {_single_line(plate.title)}"]
            for claim in plate.claims:
                paragraph.append(f"  {next(lines)}")
                if claim.explanation and not claim.holds:
                    paragraph.append(f"    {_single_line(claim.explanation)}")
            yield "\n".join(paragraph)


def plots(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME|MOTION|FOLDER|SHARE.csv]...",
            help="Plates to draw, by their names or the first word of several (person), motions "
            "(.action .npz .mot .sto), folders of `mover sweep`, or tables of `mover inverse` "
            "(.csv). [default: all plates]",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="DIR", help="Folder of the files."),
    ] = None,
    gallery: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.md", help="Write a Markdown page, with pictures in the folder FILE."
        ),
    ] = None,
    strict: Annotated[
        bool,
        typer.Option(
            "--strict",
            help="Fail if a claim does not hold; differences from published curves do not count.",
        ),
    ] = False,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Number of processes [default: number of cores].")
    ] = None,
    springs: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.springs.toml",
            help="Draw the curves of a springs file; with a motion, use its springs.",
        ),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|FIGURE",
            help="Springs to draw beside those of --springs: a springs file, or a figure's own.",
        ),
    ] = None,
    figure: Annotated[
        str | None,
        typer.Option(metavar="FIGURE", help="Figure of the motions, if not the one named in them."),
    ] = None,
    medium: Annotated[
        MediumName, typer.Option("--for", help="Medium of the pictures.")
    ] = MediumName.REPORT,
    width: Annotated[
        Width | None, typer.Option(help="Width for a paper [mm]. [default: 174]")
    ] = None,
    listed: Annotated[
        bool, typer.Option("--list", help="List the names of the plates and draw none.")
    ] = False,
    *,
    as_json: bool = False,
    show_progress: bool = False,
) -> CommandResult:
    """Draw curves and motions, and check the claims about them.

    Each plate becomes a picture (.svg and .png) and its numbers (.csv); report.html shows them all.
    With --for paper each is written as .pdf and .svg, with its caption in .txt and its references
    in .bib; there is no report.
    """
    if width is not None and medium is not MediumName.PAPER:
        raise UsageError("--width is for --for paper")
    chosen = REPORT
    if medium is MediumName.PAPER:
        chosen = Medium.paper(int((width or Width.PAGE).value))
    if listed:
        return PlateList(list(PLATES))
    words, paths = names or [], [Path(name) for name in names or []]
    progress = item_progress_bar if show_progress and not as_json else no_monitor
    own = OwnFiles(
        motions=[path for path in paths if path.suffix.lower() in READABLE_SUFFIXES],
        studies=[Path(name) for name in words if _is_study_folder(name)],
        springs=springs,
        against=against,
        figure=figure,
        shares=[path for path in paths if path.suffix.lower() == SHARE_SUFFIX],
    )
    _check_options(words, own, gallery, chosen)
    targets = _select_targets(() if own else words, output, gallery)
    drawn, warnings = _draw_own(own, chosen) if own else ((), [])
    if output is not None:
        _create_folder(output)
        check_writable([output / REPORT_NAME], ())
    if gallery is not None:
        check_writable([gallery], ())
        _create_folder(gallery.with_suffix(""))
    if own:
        results = _PlateResults(drawn, (), False, ())
    else:
        results = _run_plates(targets, jobs or cores(), output, progress, chosen)
    with hold_interrupts():
        pages: dict[Path, str | bytes] = {}
        if own and output is not None:
            for one in results.plates:
                pages |= {output / name: text for name, text in one.files.items()}
        plate_names = own.words or (list(targets) if words else [])
        pages |= _format_pages(results, plate_names, None if chosen.is_paper else output, gallery)
        write_files(pages)
    return PlotsResult(
        claims=len(results.claims),
        hold=sum(claim.holds for claim in results.claims),
        plates=[PlateData(one.name, one.title, one.claims) for one in results.plates],
        failed=results.failed,
        interrupted=results.interrupted,
        files=[*results.files, *pages],
        report=None if output is None else output / REPORT_NAME,
        diagnostics=tuple(warnings),
        failure=_failure_message(results, strict),
    )


SHARE_SUFFIX = ".csv"
"""Suffix of tables of net and passive moments."""


def _format_pages(
    results: "_PlateResults", words: Sequence[str], output: Path | None, gallery: Path | None
) -> dict[Path, str | bytes]:
    """Return report and gallery, with the pictures of the gallery, by path."""
    pages: dict[Path, str | bytes] = {}
    if output is not None:
        provenance = report_provenance(words)
        pages[output / REPORT_NAME] = report(results.plates, results.failed, provenance)
    if gallery is not None and not results.failed:
        folder = gallery.with_suffix("")
        for plate in results.plates:
            picture = f"{plate.name}.{PICTURE_FORMAT}"
            pages[folder / picture] = plate.files[picture]
        pages[gallery] = gallery_page(results.plates, folder.name)
    return pages


def _check_options(
    names: Sequence[str], own: OwnFiles, gallery: Path | None, medium: Medium
) -> None:
    """Raise UsageError for options that exclude each other."""
    if own.figure is not None and not own.motions:
        raise UsageError("--figure is for motions")
    for files, others in (
        (own.shares, "tables of mover inverse and other things"),
        (own.motions, "motions and named plates"),
        (own.studies, "folders of studies and other things"),
    ):
        if files and len(files) < len(names):
            raise UsageError(f"draw {others} in separate commands")
    if own.against is not None and own.springs is None:
        raise UsageError("--against compares with the curves of --springs, which is missing")
    if own.springs is not None and names and not own.motions:
        raise UsageError("--springs draws the curves of a file: leave out the names")
    if own.against is not None and names:
        raise UsageError("--against compares curves: leave out the motions")
    if gallery is not None and (own.springs is not None or medium.is_paper):
        raise UsageError("--gallery shows all plates of the report: leave out the other options")


def _draw_own(own: OwnFiles, medium: Medium) -> tuple[tuple[DrawnPlate, ...], list[Diagnostic]]:
    """Draw a user's own files, with warnings; raises as `OwnFiles.plates`."""
    from plots.canvas import draw_plate  # matplotlib is slow to import

    with drawing_for(medium):
        made, warnings = own.plates()
        return tuple(map(draw_plate, made)), warnings


def _select_targets(
    names: Sequence[str], output: Path | None, gallery: Path | None
) -> Mapping[str, str]:
    """Select the plates to draw, in the order of the gallery. Raises UsageError."""
    if output is None and gallery is None:
        raise UsageError("no output folder: add -o DIR, or --gallery FILE.md")
    if gallery is not None:
        if gallery.suffix != ".md":
            raise UsageError(f"--gallery {gallery}: the name of the page must end in .md")
        if names:
            raise UsageError("--gallery shows all plates: leave out the names")
    for name in names:
        if not _named_plates(name):
            hint = spelling_hint(name, PLATES)
            raise UsageError(f"there is no plate `{name}`{f'; {hint}' if hint else ''}")
    chosen = {plate for name in names for plate in _named_plates(name)} or PLATES
    return {name: target for name, target in PLATES.items() if name in chosen}


def _is_study_folder(name: str) -> bool:
    """Return whether a name is that of a folder; one without a table of runs may be a plate's."""
    from generator.study.sweep import TABLE_NAME

    folder = Path(name)
    return is_file(folder / TABLE_NAME) or (not _named_plates(name) and is_folder(folder))


def _named_plates(name: str) -> Sequence[str]:
    """The plate of a name, or those whose names begin with it as a word: `person`."""
    if name in PLATES:
        return (name,)
    return [plate for plate in PLATES if plate.startswith(f"{name}_")]


def _create_folder(folder: Path) -> None:
    """Create a folder unless it exists. Raises InputError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        reason = os_error_reason(failure)
        if isinstance(failure, FileExistsError):
            reason = "it exists and is not a directory"
        raise InputError((unwritable_file_error(folder, reason),)) from None


@dataclass(frozen=True)
class _PlateResults:
    """Plates in the order of the gallery, and the files of those that are finished."""

    plates: tuple[DrawnPlate, ...]
    failed: tuple[FailedPlate, ...]
    interrupted: bool
    files: tuple[Path, ...]

    @property
    def claims(self) -> list[Claim]:
        """The claims of all finished plates."""
        return [claim for plate in self.plates for claim in plate.claims]


def _run_plates(
    targets: Mapping[str, str],
    jobs: int,
    output: Path | None,
    progress: ItemMonitor,
    medium: Medium,
) -> _PlateResults:
    """Draw the plates, and write the files of each, all or none, when it is finished."""
    results: dict[str, DrawnPlate | FailedPlate] = {}
    files: list[Path] = []
    interrupted = False
    try:
        with (
            defer_interrupt() as check,
            progress(len(targets), "plates") as done,
            closing(make_plates(targets, jobs, check, medium)) as arriving,
        ):
            for result in arriving:
                if isinstance(result, DrawnPlate) and output is not None:
                    contents = {output / name: each for name, each in result.files.items()}
                    write_files(contents)
                    files += contents
                results[result.name] = result
                done(result.name)
    except KeyboardInterrupt:
        interrupted = True
        if not any(isinstance(result, DrawnPlate) for result in results.values()):
            raise
    ordered = [
        results.get(name, FailedPlate(name, "the command was interrupted")) for name in targets
    ]
    return _PlateResults(
        plates=tuple(result for result in ordered if isinstance(result, DrawnPlate)),
        failed=tuple(result for result in ordered if isinstance(result, FailedPlate)),
        interrupted=interrupted,
        files=tuple(files),
    )


_CHECK_INTERVAL = 0.1
"""Time between calls of the caller's check [s]."""


def make_plates(
    targets: Mapping[str, str],
    jobs: int,
    check: Callable[[], None] = lambda: None,
    medium: Medium = REPORT,
) -> Generator[DrawnPlate | FailedPlate]:
    """Draw plates in several processes, and yield each when it is finished.

    Each process is a pool of its own, so that one that dies fails its own plate only and is
    replaced. Closing the generator ends the processes.

    Args:
        targets: maker of each plate, `module:function`, by plate name.
        jobs: largest number of processes, at least 1.
        check: called several times a second; an exception that it raises ends all processes.
        medium: medium of the pictures.
    """
    queue = list(targets.items())[::-1]
    workers: list[_Worker] = []
    idle: list[_Worker] = []
    running: dict[Future[DrawnPlate | FailedPlate], tuple[str, _Worker]] = {}
    with tempfile.TemporaryDirectory() as folder:
        try:
            while queue or running:
                check()
                while queue and len(running) < jobs:
                    name, target = queue.pop()
                    if not idle:
                        workers.append(_Worker(Path(folder, f"{len(workers)}.txt")))
                        idle.append(workers[-1])
                    worker = idle.pop()
                    running[worker.submit(name, target, medium)] = name, worker
                done, _ = wait(running, timeout=_CHECK_INTERVAL, return_when=FIRST_COMPLETED)
                for future in done:
                    name, worker = running.pop(future)
                    try:
                        result = future.result()
                        idle.append(worker)
                    except BrokenProcessPool:
                        result = FailedPlate(name, f"its process ended with {worker.ending()}")
                    yield result
        finally:
            for worker in workers:
                worker.kill()


class _Worker:
    """A process that draws one plate at a time; its standard streams go to a file."""

    def __init__(self, printed: Path) -> None:
        """Start the process."""
        self._printed = printed
        self._pool = ProcessPoolExecutor(
            max_workers=1,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_initialize_worker,
            initargs=(str(printed),),
        )
        others = set(multiprocessing.active_children())
        with single_threaded_libraries(), blocked_interrupt():
            self._pool.submit(os.getpid)
        (self._process,) = set[BaseProcess](multiprocessing.active_children()) - others

    def submit(self, name: str, target: str, medium: Medium) -> Future[DrawnPlate | FailedPlate]:
        """Start drawing a plate."""
        return self._pool.submit(make_plate, name, target, medium)

    def ending(self) -> str:
        """Exit code or signal of the dead process, and the last line that it printed."""
        self._pool.shutdown()
        ending = format_exit(self._process.exitcode)
        lines = self._printed.read_text(errors="replace").split("\n")
        last = next((line.strip() for line in reversed(lines) if line.strip()), "")
        return f"{ending}: {last}" if last else ending

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()
        self._pool.shutdown(cancel_futures=True)


def _initialize_worker(printed: str) -> None:
    """Redirect output of libraries, also that of compiled code, away from the command's streams."""
    serve_parent_only()
    redirect_output(printed)


def make_plate(name: str, target: str, medium: Medium = REPORT) -> DrawnPlate | FailedPlate:
    """Draw the plate of a name, made by `module:function`."""
    module = None
    try:
        # Matplotlib may refuse the user's settings when it is imported.
        from plots.canvas import draw_plate

        path, _, function = target.partition(":")
        module = import_module(path)
        with drawing_for(medium):
            plate = getattr(module, function)()
            if plate.name != name:
                return FailedPlate(name, f"its maker names it `{plate.name}`")
            return draw_plate(plate)
    except (Exception, SystemExit) as failure:
        return FailedPlate(name, _failure_reason(failure, module))


def _failure_reason(failure: BaseException, module: ModuleType | None) -> str:
    """The exception on one line, with the innermost line of the plate's module in its traceback."""
    reason, message = type(failure).__name__, _single_line(str(failure))
    if isinstance(failure, MoverError):
        return message
    if message:
        reason += f": {message}"
    for frame in reversed(traceback.extract_tb(failure.__traceback__)):
        if module is not None and frame.filename == module.__file__:
            return f"{reason} ({os.path.basename(frame.filename)}, line {frame.lineno})"
    return reason


_DISTRIBUTIONS = ("exudyn-mover", "exudyn", "numpy", "scipy", "matplotlib")


def report_provenance(names: Sequence[str]) -> dict[str, str]:
    """The command that draws these plates (all if empty), the versions and the machine.

    The report leaves out its folder and the time, so that equal runs give equal reports.
    """
    return {
        "command": shlex.join(["mover", "plots", "-o", "DIR", *names]),
        **{name: version(name) for name in _DISTRIBUTIONS},
        "Python": platform.python_version(),
        "machine": platform.platform(),
    }


def _failure_message(results: _PlateResults, strict: bool) -> str | None:
    """The reason why the command failed, as a sentence, or None."""
    if results.interrupted:
        count = len(results.plates) + len(results.failed)
        return f"interrupted after {len(results.plates)} of {count} plates"
    if results.failed:
        return "; ".join(map(str, results.failed))
    if strict and any(claim.outcome is Outcome.FAILS for claim in results.claims):
        return f"--strict requires all claims to hold: {tally(results.claims)}"
    return None


def _single_line(text: str) -> str:
    return " ".join(text.split())
