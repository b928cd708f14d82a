"""The words of the project as docs/conventions.md lists them: names, texts, docstrings, help."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from typer.testing import CliRunner

from generator.cli.app import app
from tests.paths import DOCS, ROOT

PACKAGES = ("generator", "springs", "plots")
MODULES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
CONVENTIONS = DOCS / "conventions.md"
PAGES = [ROOT / "README.md", ROOT / "figures/README.md", ROOT / "CHANGELOG.md", *DOCS.rglob("*.md")]

ROW = re.compile(r"^\| `([^`]+)` \| (name|whole name|text) \|", re.MULTILINE)
NO_NOUN = r"(?<!there )(?<!here )\b(?:is|are)\s+no\s+(?!longer\b|more\b|less\b|worse\b|\w+er\b)"
OPENING = re.compile(r"(?:What|Whether|Where|How|Which)\b")
DEFAULT = re.compile(r"; -?\d[\d.,e-]*(?: [\w/^]+)?\.?$")
PART = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")

BANNED = {kind: {word for word, where in ROW.findall(CONVENTIONS.read_text(encoding="utf-8"))
                 if where == kind} for kind in ("name", "whole name", "text")}  # fmt: skip
SPACED = [r"\b" + word.replace(" ", r"\s+") + r"\b(?! apart)" for word in sorted(BANNED["text"])]
PHRASES = re.compile("|".join([NO_NOUN, *SPACED]), re.IGNORECASE)


def relative(path: Path) -> str:
    return str(path.relative_to(ROOT))


def defined_names(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Every identifier that a module defines, with its line."""
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                yield name, node.lineno
            case ast.Name(id=name, ctx=ast.Store()):
                yield name, node.lineno
            case ast.Attribute(attr=name, ctx=ast.Store()):
                yield name, node.lineno
            case _:
                pass


def bad_name(name: str) -> bool:
    """Tell whether a name has a banned word."""
    parts = {part.lower() for part in PART.findall(name)}
    return bool(parts & BANNED["name"]) or name.strip("_").lower() in BANNED["whole name"]


def texts(tree: ast.AST, source: str) -> Iterator[tuple[str, int]]:
    """Strings, with neighbours joined, and what follows a `#` in a module, with their lines."""
    for node in ast.walk(tree):
        match node:
            case ast.Constant(value=str(text)):
                yield text, node.lineno
            case ast.JoinedStr(values=values):
                parts = [v.value if isinstance(v, ast.Constant) else "{}" for v in values]
                yield "".join(map(str, parts)), node.lineno
            case _:
                pass
    for number, line in enumerate(source.splitlines(), 1):
        _, mark, comment = line.partition("#")
        if mark:
            yield comment, number


def docstrings(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Docstrings of modules, classes and functions, and those below attributes."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        for statement in body if isinstance(body, list) else ():
            if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                yield str(statement.value.value), statement.lineno


def help_entries(*command: str) -> list[str]:
    """Sentences and options of a help page, each as one line."""
    shown = CliRunner().invoke(app, [*command, "--help"], env={"COLUMNS": "100", "NO_COLOR": "1"})
    assert shown.exit_code == 0
    return [" ".join(entry.split()) for entry in re.split(r"\n(?= {0,2}\S)", shown.stdout)]


def test_the_table_is_read():
    assert all(BANNED.values())
    assert bad_name("insist_on_it")
    assert bad_name("TorqueMeter")
    assert bad_name("_given")
    assert not bad_name("given_angle")
    assert PHRASES.search("this is no link")
    assert PHRASES.search("1e-3 unless\ntold")
    assert not PHRASES.search("there is no link, which is no longer wanted: it is no slower")
    assert DEFAULT.search("Scale of the load; 1.")


def faults_of_module(path: Path) -> Iterator[str]:
    source = path.read_text(encoding="utf-8")
    tree = ast.parse(source)
    for name, line in defined_names(tree):
        if bad_name(name):
            yield f"{line}: name {name}"
    for text, line in texts(tree, source):
        if found := PHRASES.search(text):
            yield f"{line}: {found[0]!r} in {text.strip()[:60]!r}"
    for text, line in docstrings(tree):
        if OPENING.match(text):
            yield f"{line}: docstring {text[:50]!r}"


def test_modules_speak_plainly():
    faults = {f"{relative(path)}:{fault}" for path in MODULES for fault in faults_of_module(path)}
    assert sorted(faults) == []


def faults_of_page(path: Path) -> Iterator[str]:
    text = path.read_text(encoding="utf-8")
    if path == CONVENTIONS:
        text = text[: text.index("## Words that are not used")]
    for match in PHRASES.finditer(text):
        yield f"{text.count(chr(10), 0, match.start()) + 1}: {match[0]!r}"


def test_pages_speak_plainly():
    assert [f"{relative(path)}:{fault}" for path in PAGES for fault in faults_of_page(path)] == []


def test_help_speaks_plainly():
    entries = help_entries()
    names = [entry.split()[0] for entry in entries[entries.index("Commands:") + 1 :]]
    commands = [name for name in names if name.islower()]
    assert len(commands) > 10
    lines = [("mover", entry) for entry in entries]
    lines += [(name, entry) for name in commands for entry in help_entries(name)]
    faults = [line for line in lines if PHRASES.search(line[1]) or DEFAULT.search(line[1])]
    assert faults == []
