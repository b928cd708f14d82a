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

from generator.cli.answer import Answer, ExitCode, UsageError, aligned, counted, finite
from generator.cli.progress import Progress, interrupted_at_a_frame, unshown
from generator.diagnostics import InputError, error, nearest
from generator.text_io import reason_of, why_not_writable, write_whole
from plots.plate import Claim, DrawnPlate, Failed
from plots.report import PICTURE, gallery_page, report, tally
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


def write(path: Path, content: str | bytes) -> None:
    """Write a file, whole or not at all. Raises InputError."""
    try:
        write_whole(path, content)
    except OSError as failure:
        raise _refused(path, reason_of(failure)) from None


def insist_on_file(path: Path) -> None:
    """See that a file can be written. Raises InputError."""
    if (reason := why_not_writable(path)) is not None:
        raise _refused(path, reason)


def insist_on_folder(folder: Path) -> None:
    """See that a folder is there, and make it where it is not. Raises InputError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise _refused(folder, "it is there already, and no directory") from None
    except OSError as failure:
        raise _refused(folder, reason_of(failure)) from None


def _refused(path: Path, reason: str) -> InputError:
    return InputError((error(f"`{path}` cannot be written: {reason}"),))


_DISTRIBUTIONS = ("exudyn-mover", "exudyn", "numpy", "scipy", "matplotlib")


def made_with(names: Sequence[str]) -> dict[str, str]:
    """What makes the plates of these names, or all of them when there are no names.

    The folder of the report is not told: where it lies does not change it. Nor is the time.
    """
    return {
        "command": shlex.join(["mover", "plots", "-o", "DIR", *names]),
        **{name: version(name) for name in _DISTRIBUTIONS},
        "Python": platform.python_version(),
        "machine": platform.platform(),
    }


REPORT = "report.html"


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
class _Made:
    """What came of a request, in the order of the gallery.

    Attributes:
        plates: that were made.
        failed: that were not, and why.
        interrupted: whether that is why.
        files: that were written.
    """

    plates: tuple[DrawnPlate, ...]
    failed: tuple[Failed, ...]
    interrupted: bool
    files: tuple[Path, ...] = ()

    @property
    def claims(self) -> list[Claim]:
        """Of all plates that were made."""
        return [claim for plate in self.plates for claim in plate.claims]


def plots(request: Request, progress: Progress = unshown) -> Answer:
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
        return Answer(text="\n".join(PLATES), data=list(PLATES))
    targets = _targets(request)
    _insist_on_places(request)
    made = _make(request, targets, progress)
    made = replace(made, files=(*made.files, *_write_pages(request, made)))
    failure = _failure(request, made)
    return Answer(
        text="\n\n".join(_paragraphs(request, made)),
        data=_data(made),
        code=ExitCode.RUN_FAILED if failure else ExitCode.GOOD,
        failure=failure,
    )


def _targets(request: Request) -> Mapping[str, str]:
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
            hint = nearest(name, PLATES)
            raise UsageError(f"there is no plate `{name}`{f'; {hint}' if hint else ''}")
    wanted = set(request.names or PLATES)
    return {name: target for name, target in PLATES.items() if name in wanted}


def _insist_on_places(request: Request) -> None:
    """See that all can be written, and make the folders. Raises InputError."""
    if request.output is not None:
        insist_on_folder(request.output)
        insist_on_file(request.output / REPORT)
    if request.gallery is not None:
        insist_on_file(request.gallery)
        insist_on_folder(request.gallery.with_suffix(""))


def _make(request: Request, targets: Mapping[str, str], progress: Progress) -> _Made:
    """Make the plates, and write the files of each when it is done."""
    results: dict[str, DrawnPlate | Failed] = {}
    files: list[Path] = []
    interrupted = False
    jobs = min(request.jobs or cores(), len(targets))
    with interrupted_at_a_frame() as check, progress(len(targets), "plates") as done:
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
    every = [results.get(name, Failed(name, "the command was interrupted")) for name in targets]
    return _Made(
        plates=tuple(result for result in every if isinstance(result, DrawnPlate)),
        failed=tuple(result for result in every if isinstance(result, Failed)),
        interrupted=interrupted,
        files=tuple(files),
    )


def _write_pages(request: Request, made: _Made) -> Iterator[Path]:
    """Write the report, and the gallery if no plate is missing."""
    if request.output is not None:
        names = [name for name in PLATES if name in request.names]
        text = report(made.plates, made.failed, made_with(names))
        yield from _write(request.output, {REPORT: text})
    if request.gallery is not None and not made.failed:
        folder = request.gallery.with_suffix("")
        pictures = {f"{plate.name}.{PICTURE}": plate.files for plate in made.plates}
        yield from _write(folder, {name: files[name] for name, files in pictures.items()})
        text = gallery_page(made.plates, folder.name)
        yield from _write(request.gallery.parent, {request.gallery.name: text})


def _write(folder: Path, files: Mapping[str, str | bytes]) -> Iterator[Path]:
    for name, content in files.items():
        write(folder / name, content)
        yield folder / name


def _failure(request: Request, made: _Made) -> str | None:
    """Why the command failed, as a sentence; None when it did not."""
    if made.interrupted:
        count = len(made.plates) + len(made.failed)
        return f"interrupted after {len(made.plates)} of {count} plates"
    if made.failed:
        return "; ".join(map(str, made.failed))
    if request.strict and not all(claim.holds for claim in made.claims):
        return f"--strict asks for all claims to hold: {tally(made.claims)}"
    return None


def _paragraphs(request: Request, made: _Made) -> Iterator[str]:
    rows = [
        [claim.verdict, claim.measured_words, f"({claim.bound_words})", _line(claim.sentence)]
        for claim in made.claims
    ]
    lines = iter(aligned(rows, left=len(rows[0])).splitlines() if rows else [])
    for plate in made.plates:
        said = [f"{plate.name}: {_line(plate.title)}"]
        for claim in plate.claims:
            said.append(f"  {next(lines)}")
            if claim.remark and not claim.holds:
                said.append(f"    {_line(claim.remark)}")
        yield "\n".join(said)
    yield tally(made.claims)
    folders = dict.fromkeys(path.parent for path in made.files)
    written = [
        f"wrote {counted(sum(path.parent == folder for path in made.files), 'file')} in {folder}"
        for folder in folders
    ]
    if request.output is not None:
        written.append(f"the report is {request.output / REPORT}")
    if written:
        yield "\n".join(written)


def _line(text: str) -> str:
    return " ".join(text.split())


def _data(made: _Made) -> dict[str, object]:
    return {
        "claims": len(made.claims),
        "hold": sum(claim.holds for claim in made.claims),
        "plates": [
            {
                "name": plate.name,
                "title": plate.title,
                "claims": [_claim_data(claim) for claim in plate.claims],
            }
            for plate in made.plates
        ],
        "failed": [{"name": failed.name, "reason": failed.reason} for failed in made.failed],
        "interrupted": made.interrupted,
        "files": [str(path) for path in made.files],
    }


def _claim_data(claim: Claim) -> dict[str, object]:
    """A claim for JSON, which has no nan and no infinity: those are null."""
    return {
        "sentence": claim.sentence,
        "measured": finite(claim.measured),
        "unit": claim.unit,
        "at_least": finite(claim.at_least),
        "at_most": finite(claim.at_most),
        "holds": claim.holds,
        "remark": claim.remark,
    }
