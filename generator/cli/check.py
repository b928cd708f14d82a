"""`mover check`: errors and doubts about a figure, its springs and other files; a verdict.

Doubts about the curves of the springs do not change the exit code: the figure can be simulated.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import degrees, inf
from pathlib import Path
from typing import Annotated, Any

import typer

from generator.cli import answer
from generator.cli.contact import laws_table, stages_text
from generator.cli.inputs import parse_springs_option
from generator.cli.options import SpringsChoice, complete_figure_name
from generator.cli.progress import load_exudyn
from generator.contact.scene import Prop, Scene
from generator.contact.spheres import fit_contact_spheres
from generator.contact_file.file import CONTACT_FILE
from generator.diagnostics import (
    Diagnostic,
    InputError,
    ModelError,
    Severity,
    UsageError,
    error,
    select_errors,
)
from generator.figure import Figure
from generator.figure_file import FIGURE_FILE
from generator.file_kind import FileKind
from generator.input_files.scene import SCENE_FILE
from generator.input_files.tone import TONE_FILE
from generator.kinematics.links import mirror_rotations
from generator.model import Model, contact_of_figure
from generator.person.identity import identity_of, range_publications
from generator.simulation.preconditions import chain_obstacles, simulation_obstacles
from generator.springs_file.axes import axis_name, coupled_axis_names, parallel_sign
from generator.springs_file.read import load_springs_file
from generator.study.study_tables import STUDY_SUFFIX
from generator.text_io import is_file, path_exists
from springs import SpringSet
from springs.axis import UNKNOWN_AXIS
from springs.layer import Layer
from springs.lint.finding import Finding
from springs.lint.report import (
    CoupledReport,
    CurveReport,
    report_coupled,
    report_curves,
)

_TAKEN = (
    "it takes figures (.fig), springs (.toml), scenes, tones, contact files and studies "
    "(.scene.toml ...), motions (.mot .sto .action .npz), markers (.trc .c3d) and models "
    "(.osim .xml .mjcf .urdf)"
)


@dataclass(frozen=True)
class CheckResult(answer.CommandResult):
    """Verdict on a file, with its faults and findings about its curves."""

    error: str | None = field(init=False, metadata=answer.OMITTED_IF_NONE)
    verdict: str
    faults: tuple[Diagnostic, ...]
    findings: Sequence[Mapping[str, object]] = ()
    sections: Sequence[str | answer.Table] = field(default=(), metadata=answer.HIDDEN)

    def __post_init__(self) -> None:
        """Set the error."""
        wrong = "the input is wrong" if select_errors(self.faults) else None
        object.__setattr__(self, "error", wrong)

    @property
    def code(self) -> answer.ExitCode:
        """Exit code: doubts and warnings do not change it."""
        return answer.ExitCode.WRONG_INPUT if self.error else answer.ExitCode.SUCCESS

    def paragraphs(self) -> answer.Paragraphs:
        """Return faults, findings and the verdict."""
        return (*map(str, self.faults), *self.sections, self.verdict)


def _curve_paragraphs(reports: Sequence[CurveReport], *, include_notes: bool) -> Iterator[str]:
    """Yield a paragraph for each curve: its joints, then its findings in a table.

    Without notes, curves without doubts are left out.
    """
    shown = [report for report in reports if include_notes or report.doubts]
    for report in shown:
        low, high = (degrees(angle) for angle in report.lint_range)
        motion = f", {report.spring.motion}" if report.spring.motion else ""
        title = f"{', '.join(report.joints)} about {axis_name(report.spring.direction)}{motion}"
        yield (
            f"{title}, from {low:.1f} to {high:.1f} deg\n"
            f"{_findings_table(report, include_notes=include_notes)}"
        )
    ends = [end for report in shown for end in (report.low, report.high) if end is not None]
    sources = dict.fromkeys(f"  {end.source}: {end.reference}" for end in ends)
    if sources:
        yield "\n".join(["normal ranges of motion:", *sources])


def _coupled_paragraphs(reports: Sequence[CoupledReport], *, include_notes: bool) -> Iterator[str]:
    """Yield a paragraph for each law over several joints with findings."""
    for report in reports:
        if report.findings if include_notes else report.doubts:
            sides = "; ".join(", ".join(coupled_axis_names(spring)) for spring in report.springs)
            names = ", ".join(report.springs[0].law.coordinates)
            yield f"{sides}: {names}\n{_findings_table(report, include_notes=include_notes)}"


def _findings_table(report: CurveReport | CoupledReport, *, include_notes: bool) -> answer.Table:
    findings = report.findings if include_notes else report.doubts
    return answer.Table([(f"  {_severity(f)}", f.kind.value, f.sentence) for f in findings], 3)


def _report_counts(reports: Sequence[CurveReport], coupled: Sequence[CoupledReport]) -> str:
    """Count curves, laws and doubts: `8 curves, 1 law over several joints, 3 doubts (slope 3)`."""
    doubts = [finding.kind.value for report in (*reports, *coupled) for finding in report.doubts]
    laws = [f"{answer.format_count(len(coupled), 'law')} over several joints"] if coupled else []
    kinds = ", ".join(f"{kind} {count}" for kind, count in Counter(doubts).most_common())
    total = answer.format_count(len(doubts), "doubt") + (f" ({kinds})" if kinds else "")
    return ", ".join([answer.format_count(len(reports), "curve"), *laws, total])


def _findings_data(reports: Sequence[CurveReport | CoupledReport]) -> Iterator[dict[str, object]]:
    """Yield the findings, in the order of the text; angles in deg, values in SI."""
    for report in reports:
        if isinstance(report, CurveReport):
            direction = report.spring.direction
            about: dict[str, object] = {
                "joints": report.joints,
                "axis": "joint" if direction == UNKNOWN_AXIS else axis_name(direction),
                "motion": report.spring.motion,
            }
        else:
            joints = [[axis.joint for axis in spring.axes] for spring in report.springs]
            about = {"coordinates": report.springs[0].law.coordinates, "joints": joints}
        for finding in report.findings:
            yield {
                "severity": _severity(finding),
                "message": finding.sentence,
                "kind": finding.kind,
                **about,
                "angles_deg": [degrees(angle) for angle in finding.angles],
                "values": finding.values,
            }


def _severity(finding: Finding) -> str:
    return "doubt" if finding.is_doubt else "note"


def check(
    name: Annotated[
        str,
        typer.Argument(
            metavar="FIGURE|SPRINGS.toml|SCENE|STUDY|MOTION|MODEL",
            autocompletion=complete_figure_name,
            help="A figure file, a springs file, a .scene.toml or .study.toml file, or the name of "
            "a shipped figure, scene or study; a motion, markers or a model.",
        ),
    ],
    springs: SpringsChoice = None,
    doubts: Annotated[
        bool, typer.Option("--doubts", help="Print each doubt about the curves of a figure.")
    ] = False,
) -> answer.CommandResult:
    """Check a figure, a scene, a study, a motion or a model."""
    for noun, is_of_kind, check_file in _OTHER_KINDS:
        if is_of_kind(name):
            for flag, is_given in (("--springs", springs is not None), ("--doubts", doubts)):
                if is_given:
                    raise UsageError(f"{flag} applies to a figure, not to {noun}")
            return check_file(name)
    reading = FIGURE_FILE.parse_file(name)
    diagnostics, obstacles = reading.diagnostics, ()
    spring_set, mirrors = SpringSet(), None
    if reading.value is not None:
        known = {str(one) for one in diagnostics}
        faults = _contact_faults(reading.value)
        diagnostics += tuple(one for one in faults if str(one) not in known)
        found = parse_springs_option(reading.value, springs)
        diagnostics += found.diagnostics
        spring_set = found.value or spring_set
        obstacles = simulation_obstacles(Model(reading.value, spring_set))
        if not tuple(chain_obstacles(reading.value)):
            mirrors = mirror_rotations(reading.value)
        messages = {one.message for one in diagnostics}
        diagnostics += tuple(one for one in obstacles if one.message not in messages)
    use = "the figure can be simulated"
    if select_errors(diagnostics):
        use = "the figure cannot be used"
    elif obstacles:
        use = "the figure can be read, but not simulated"
    verdict = f"{name}: {_severity_counts(diagnostics)}; {use}"
    reports = report_curves(spring_set, mirrors, _range_publications(reading.value))
    result = _check_result(diagnostics, reports, spring_set, verdict)
    if doubts:
        return result
    *hidden, counts = result.sections or ("",)
    shown = f"{counts}; --doubts prints them" if hidden else counts
    return replace(result, sections=[shown])


def _contact_faults(figure: Figure) -> tuple[Diagnostic, ...]:
    """Return what is wrong with the parts beside a figure: with their file, or for the figure."""
    try:
        body = contact_of_figure(figure)
        if body is not None:
            body.assign({name: fit.spheres for name, fit in fit_contact_spheres(figure).items()})
    except InputError as failure:
        return tuple(failure.diagnostics)
    except ModelError as failure:
        return (error(str(failure)),)
    return ()


def _range_publications(figure: Figure | None) -> tuple[str, ...]:
    """Return the publications with normal ranges for a figure: of women for a woman."""
    identity = None if figure is None else identity_of(figure)
    return range_publications(identity and identity.sex)


def _is_unknown(name: str) -> bool:
    """Return whether a file has the suffix of no kind that is checked."""
    known = ("", ".toml", FIGURE_FILE.suffix)
    return Path(name).suffix.lower() not in known and is_file(Path(name))


def _refuse_unknown(name: str) -> answer.CommandResult:
    fault = error(f"`{name}` is not a file that `mover check` takes", hint=_TAKEN)
    verdict = f"{name}: {_severity_counts((fault,))}; the file cannot be used"
    return CheckResult(verdict, (fault,))


def _is_file_of(kind: FileKind[Any, ...], name: str) -> bool:
    """Return whether a name is that of a file of a kind, with its suffix or without."""
    return name.endswith(kind.suffix) or (
        kind.find(name) != Path(name) and not is_file(FIGURE_FILE.find(name))
    )


def _check_scene(name: str) -> answer.CommandResult:
    reading = SCENE_FILE.parse_file(name)
    use = "the scene cannot be used" if reading.value is None else "the scene can be used"
    verdict = f"{name}: {_severity_counts(reading.diagnostics)}; {use}"
    scene = reading.value or Scene()
    rows = [_prop_row(prop) for prop in scene.props]
    rows += [(f"cover of {cover.part}", _layer_text(cover.layer), "") for cover in scene.covers]
    return CheckResult(verdict, reading.diagnostics, sections=[answer.Table(rows, 3)])


def _check_tone(name: str) -> answer.CommandResult:
    reading = TONE_FILE.parse_file(name)
    use = "the tone cannot be used" if reading.value is None else "the tone can be used"
    verdict = f"{name}: {_severity_counts(reading.diagnostics)}; {use}"
    return CheckResult(verdict, reading.diagnostics, sections=[str(reading.value or "")])


def _check_contact(name: str) -> answer.CommandResult:
    reading = CONTACT_FILE.parse_file(name)
    use = "the parts cannot be used" if reading.value is None else "the parts can be used"
    verdict = f"{name}: {_severity_counts(reading.diagnostics)}; {use}"
    parts = () if reading.value is None else reading.value.parts
    sections = [laws_table(parts)] if parts else []
    return CheckResult(verdict, reading.diagnostics, sections=sections)


def _is_measured(name: str) -> bool:
    """Return whether a name is that of a motion, of markers, or of another program's model."""
    if Path(name).suffix.lower() in ("", ".toml", FIGURE_FILE.suffix):
        return False
    from generator.cli.check_motion import has_measured_suffix  # imports all formats

    return has_measured_suffix(name)


def _check_measured(name: str) -> answer.CommandResult:
    from generator.cli.check_motion import check_measured

    diagnostics, sections, use = check_measured(name)
    verdict = f"{name}: {_severity_counts(diagnostics)}; {use or 'the file cannot be used'}"
    return CheckResult(verdict, diagnostics, sections=sections)


def _layer_text(layer: Layer) -> str:
    """Return stiffness and thickness of a layer."""
    end = "" if layer.thickness == inf else f", pressed through at {1e3 * layer.thickness:g} mm"
    return f"{stages_text(layer.stages)} kN/m{end}"


def _is_study(name: str) -> bool:
    """Return whether a name is that of a study's file, or of a shipped study."""
    if name.endswith(STUDY_SUFFIX) or path_exists(FIGURE_FILE.find(name)) or Path(name).suffix:
        return name.endswith(STUDY_SUFFIX)
    from generator.study.study_file import STUDY_FILE  # imports what its runs need

    return STUDY_FILE.find(name) != Path(name)


def _check_study(name: str) -> answer.CommandResult:
    from generator.study.designs import run_count
    from generator.study.study_file import STUDY_FILE

    load_exudyn()
    reading = STUDY_FILE.parse_file(name)
    study, use = reading.value, "the study cannot be run"
    if study is not None:
        runs = answer.format_count(run_count(study), "run")
        use = f"the study can be run, with {runs} of {study.name}"
    verdict = f"{name}: {_severity_counts(reading.diagnostics)}; {use}"
    return CheckResult(verdict, reading.diagnostics)


def _prop_row(prop: Prop) -> tuple[str, str, str]:
    """Return name, shape and surface of a prop."""
    surface = prop.surface
    numbers = f"{surface.stiffness:g} N/m, {surface.damping:g} s/m, friction {surface.friction:g}"
    if surface.layer is not None:
        numbers += f"; below, with parts of the body: {_layer_text(surface.layer)}"
    return prop.name, prop.shape.describe(), numbers


def _check_springs_file(name: str) -> answer.CommandResult:
    reading = load_springs_file(Path(name))
    springs, complete, owner = reading.value or (SpringSet(), SpringSet(), None)
    use = "the springs cannot be used" if reading.value is None else "the springs can be used"
    figure = "" if owner is None or owner.path is None else f" for `{owner.path.stem}`"
    verdict = f"{name}: {_severity_counts(reading.diagnostics)}; {use}{figure}"
    everything = report_curves(complete, publications=_range_publications(owner))
    reports = [report for report in everything if _is_stated(report, springs)]
    return _check_result(reading.diagnostics, reports, springs, verdict, include_notes=True)


_OTHER_KINDS: Sequence[tuple[str, Callable[[str], bool], Callable[[str], answer.CommandResult]]] = (
    ("a scene", partial(_is_file_of, SCENE_FILE), _check_scene),
    ("a tone", partial(_is_file_of, TONE_FILE), _check_tone),
    ("a contact file", partial(_is_file_of, CONTACT_FILE), _check_contact),
    ("a study", _is_study, _check_study),
    ("a motion, markers or a model", _is_measured, _check_measured),
    ("another file", _is_unknown, _refuse_unknown),
    ("a springs file", lambda name: Path(name).suffix == ".toml", _check_springs_file),
)
"""Kinds of files other than figures: with the article, which names are theirs, and their check."""


def _is_stated(report: CurveReport, springs: SpringSet) -> bool:
    """Return whether a curve is about an axis with a law in `springs`."""
    return any(
        axis.elastic and parallel_sign(axis.direction, report.spring.direction) != 0
        for name in report.joints
        if name in springs.joints
        for axis in springs.joints[name].axes
    )


def _check_result(
    diagnostics: tuple[Diagnostic, ...],
    reports: Sequence[CurveReport],
    springs: SpringSet,
    verdict: str,
    *,
    include_notes: bool = False,
) -> CheckResult:
    coupled = report_coupled(springs)
    sections: list[str | answer.Table] = [
        *_curve_paragraphs(reports, include_notes=include_notes),
        *_coupled_paragraphs(coupled, include_notes=include_notes),
    ]
    if reports or coupled:
        sections.append(_report_counts(reports, coupled))
    return CheckResult(verdict, diagnostics, list(_findings_data([*reports, *coupled])), sections)


def _severity_counts(diagnostics: tuple[Diagnostic, ...]) -> str:
    errors = len(select_errors(diagnostics))
    warnings = sum(one.severity is Severity.WARNING for one in diagnostics)
    return f"{answer.format_count(errors, 'error')}, {answer.format_count(warnings, 'warning')}"
