"""`mover plots`: the plates made and written, with a report of all claims.

The plates that this package makes, in the order of the thesis.

Each is named by where it is made, `module:function`, and imported by the process that makes it.

Files that a command writes, or a sentence that says why it cannot.

What a report was made with: the versions, the machine and the command.
"""

import platform
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

from generator.cli.answer import (
    CommandResult,
    ExitCode,
    UsageError,
    finite_or_none,
    format_count,
    format_table,
)
from generator.cli.progress import ItemMonitor, defer_interrupt, no_item_monitor
from generator.diagnostics import InputError, error, spelling_hint
from generator.text_io import os_error_reason, unwritable_reason, write_atomic
from plots.plate import Claim, DrawnPlate, FailedPlate
from plots.report import PICTURE_FORMAT, gallery_page, report, tally
from plots.workers import cores, make_plates

PLATES: Mapping[str, str] = {
    name: f"plots.plates.{module}:{name}"
    for module, names in (
        ("elbow_knee", ("elbow", "knee")),
        ("shoulder", ("shoulder_abduction", "shoulder_flexion", "shoulder_rotation")),
        ("hip_directional", ("hip_directional",)),
        ("hip", ("hip_flexion", "hip_abduction", "hip_rotation")),
        ("waist", ("waist_bend", "waist_flexion", "waist_twist")),
        ("clavicle", ("clavicle",)),
        ("two_joint_hip", ("two_joint_hip",)),
        ("off_axis", ("off_axis",)),
        ("fall_energy", ("fall_energy",)),
        ("verification", ("verification",)),
        ("work_precision", ("work_precision",)),
    )
    for name in names
}
"""Where each plate is made, by its name."""


def write_file(path: Path, content: str | bytes) -> None:
    """Write a file, whole or not at all. Raises InputError."""
    try:
        write_atomic(path, content)
    except OSError as failure:
        raise _write_error(path, os_error_reason(failure)) from None


def check_file_writable(path: Path) -> None:
    """See that a file can be written. Raises InputError."""
    if (reason := unwritable_reason(path)) is not None:
        raise _write_error(path, reason)


def create_folder(folder: Path) -> None:
    """See that a folder is there, and make it where it is not. Raises InputError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise _write_error(folder, "it is there already, and no directory") from None
    except OSError as failure:
        raise _write_error(folder, os_error_reason(failure)) from None


def _write_error(path: Path, reason: str) -> InputError:
    return InputError((error(f"`{path}` cannot be written: {reason}"),))


_DISTRIBUTIONS = ("exudyn-mover", "exudyn", "numpy", "scipy", "matplotlib")


def report_provenance(names: Sequence[str]) -> dict[str, str]:
    """What makes the plates of these names, or all of them when there are no names.

    The folder of the report is not told: where it lies does not change it. Nor is the time.
    """
    return {
        "command": shlex.join(["mover", "plots", "-o", "DIR", *names]),
        **{name: version(name) for name in _DISTRIBUTIONS},
        "Python": platform.python_version(),
        "machine": platform.platform(),
    }


REPORT_NAME = "report.html"


@dataclass(frozen=True)
class Request:
    """The command line of `mover plots`; None or empty where an option is not given."""

    names: Sequence[str] = ()
    output: Path | None = None
    gallery: Path | None = None
    strict: bool = False
    jobs: int | None = None
    listed: bool = False


@dataclass(frozen=True)
class _PlateResults:
    """What came of a request, in the order of the gallery.

    Attributes:
        plates: that were made.
        failed: that were not, and why.
        interrupted: whether that is why.
        files: that were written.
    """

    plates: tuple[DrawnPlate, ...]
    failed: tuple[FailedPlate, ...]
    interrupted: bool
    files: tuple[Path, ...] = ()

    @property
    def claims(self) -> list[Claim]:
        """Of all plates that were made."""
        return [claim for plate in self.plates for claim in plate.claims]


def plots(request: Request, progress: ItemMonitor = no_item_monitor) -> CommandResult:
    """Make the plates that are asked for and write their files.

    Args:
        request: the command line.
        progress: told of each plate that is done.

    Raises:
        UsageError: options that do not go together, or an unknown plate.
        InputError: a file cannot be written.
        KeyboardInterrupt: an interrupt came before a plate was done.
    """
    if request.listed:
        return CommandResult(text="\n".join(PLATES), data=list(PLATES))
    targets = _select_targets(request)
    _prepare_output(request)
    made = _run_plates(request, targets, progress)
    made = replace(made, files=(*made.files, *_write_pages(request, made)))
    failure = _failure_message(request, made)
    return CommandResult(
        text="\n\n".join(_format_paragraphs(request, made)),
        data=_json_data(made),
        code=ExitCode.RUN_FAILED if failure else ExitCode.SUCCESS,
        failure=failure,
    )


def _select_targets(request: Request) -> Mapping[str, str]:
    """The plates asked for, in the order of the gallery. Raises UsageError."""
    if request.output is None and request.gallery is None:
        raise UsageError("say where the plates go: -o DIR")
    if request.gallery is not None:
        if request.gallery.suffix != ".md":
            raise UsageError(f"--gallery {request.gallery}: the page ends in .md")
        if request.names:
            raise UsageError("--gallery shows all plates: give no names with it")
    for name in request.names:
        if name not in PLATES:
            hint = spelling_hint(name, PLATES)
            raise UsageError(f"there is no plate `{name}`{f'; {hint}' if hint else ''}")
    wanted = set(request.names or PLATES)
    return {name: target for name, target in PLATES.items() if name in wanted}


def _prepare_output(request: Request) -> None:
    """See that all can be written, and make the folders. Raises InputError."""
    if request.output is not None:
        create_folder(request.output)
        check_file_writable(request.output / REPORT_NAME)
    if request.gallery is not None:
        check_file_writable(request.gallery)
        create_folder(request.gallery.with_suffix(""))


def _run_plates(
    request: Request, targets: Mapping[str, str], progress: ItemMonitor
) -> _PlateResults:
    """Make the plates, and write the files of each when it is done."""
    results: dict[str, DrawnPlate | FailedPlate] = {}
    files: list[Path] = []
    interrupted = False
    jobs = min(request.jobs or cores(), len(targets))
    with defer_interrupt() as check, progress(len(targets), "plates") as done:
        try:
            with closing(make_plates(targets, jobs, check)) as arriving:
                for result in arriving:
                    if isinstance(result, DrawnPlate) and request.output is not None:
                        files += _write(request.output, result.files)
                    results[result.name] = result
                    done(result.name)
        except KeyboardInterrupt:
            interrupted = True
            if not any(isinstance(result, DrawnPlate) for result in results.values()):
                raise
    every = [
        results.get(name, FailedPlate(name, "the command was interrupted")) for name in targets
    ]
    return _PlateResults(
        plates=tuple(result for result in every if isinstance(result, DrawnPlate)),
        failed=tuple(result for result in every if isinstance(result, FailedPlate)),
        interrupted=interrupted,
        files=tuple(files),
    )


def _write_pages(request: Request, results: _PlateResults) -> Iterator[Path]:
    """Write the report, and the gallery if no plate is missing."""
    if request.output is not None:
        names = [name for name in PLATES if name in request.names]
        text = report(results.plates, results.failed, report_provenance(names))
        yield from _write(request.output, {REPORT_NAME: text})
    if request.gallery is not None and not results.failed:
        folder = request.gallery.with_suffix("")
        pictures = {f"{plate.name}.{PICTURE_FORMAT}": plate.files for plate in results.plates}
        yield from _write(folder, {name: files[name] for name, files in pictures.items()})
        text = gallery_page(results.plates, folder.name)
        yield from _write(request.gallery.parent, {request.gallery.name: text})


def _write(folder: Path, files: Mapping[str, str | bytes]) -> Iterator[Path]:
    for name, content in files.items():
        write_file(folder / name, content)
        yield folder / name


def _failure_message(request: Request, results: _PlateResults) -> str | None:
    """Why the command failed, as a sentence; None when it did not."""
    if results.interrupted:
        count = len(results.plates) + len(results.failed)
        return f"interrupted after {len(results.plates)} of {count} plates"
    if results.failed:
        return "; ".join(map(str, results.failed))
    if request.strict and not all(claim.holds for claim in results.claims):
        return f"--strict asks for all claims to hold: {tally(results.claims)}"
    return None


def _format_paragraphs(request: Request, results: _PlateResults) -> Iterator[str]:
    rows = [
        [claim.verdict, claim.measured_text, f"({claim.bound_text})", _single_line(claim.sentence)]
        for claim in results.claims
    ]
    lines = iter(format_table(rows, left_columns=len(rows[0])).splitlines() if rows else [])
    for plate in results.plates:
        said = [f"{plate.name}: {_single_line(plate.title)}"]
        for claim in plate.claims:
            said.append(f"  {next(lines)}")
            if claim.remark and not claim.holds:
                said.append(f"    {_single_line(claim.remark)}")
        yield "\n".join(said)
    yield tally(results.claims)
    folders = dict.fromkeys(path.parent for path in results.files)
    written = [
        f"wrote {format_count(sum(path.parent == folder for path in results.files), 'file')} in {folder}"
        for folder in folders
    ]
    if request.output is not None:
        written.append(f"the report is {request.output / REPORT_NAME}")
    if written:
        yield "\n".join(written)


def _single_line(text: str) -> str:
    return " ".join(text.split())


def _json_data(results: _PlateResults) -> dict[str, object]:
    return {
        "claims": len(results.claims),
        "hold": sum(claim.holds for claim in results.claims),
        "plates": [
            {
                "name": plate.name,
                "title": plate.title,
                "claims": [_claim_json(claim) for claim in plate.claims],
            }
            for plate in results.plates
        ],
        "failed": [{"name": failed.name, "reason": failed.reason} for failed in results.failed],
        "interrupted": results.interrupted,
        "files": [str(path) for path in results.files],
    }


def _claim_json(claim: Claim) -> dict[str, object]:
    """A claim for JSON, which has no nan and no infinity: those are null."""
    return {
        "sentence": claim.sentence,
        "measured": finite_or_none(claim.measured),
        "unit": claim.unit,
        "at_least": finite_or_none(claim.at_least),
        "at_most": finite_or_none(claim.at_most),
        "holds": claim.holds,
        "remark": claim.remark,
    }
