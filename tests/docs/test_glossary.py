"""Labels, headings, messages, help and pages use the words of docs/glossary.md, and its columns exist."""

import ast
import re
from pathlib import Path

import pytest
import yaml

from replication.report.filled import BEGIN, END
from trackdyn.measure.columns import COLUMNS, HEADINGS, MEASURES, OF_A_SIDE, PLACES, TABLES

ROOT = Path(__file__).parents[2]
GLOSSARY = ROOT / "docs" / "glossary.md"
TEXT = GLOSSARY.read_text(encoding="utf-8")
TERMS, _, RULES = TEXT.partition("## Words not to use")
AVOID = dict(re.findall(r"^\| ([^|]+?) \| ([^|]+?) \|$", RULES, re.MULTILINE)[1:])
SHOWN = re.compile("|".join(rf"\b{re.escape(word)}" for word in AVOID), re.IGNORECASE)
PAGES = [*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
SOURCES = sorted((ROOT / "trackdyn").rglob("*.py"))
TEMPLATES = [
    *sorted((ROOT / "workflow/replication/report/page").glob("*.j2")),
    *sorted((ROOT / "workflow/replication/report/page").glob("*.js")),
]


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def found(text):
    return [match[0] for match in SHOWN.finditer(" ".join(text.split()))]


def strings(path):
    """Strings of a module that may be shown: all but docstrings, and docstrings of commands, which are their help."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docs = set()
    for node in ast.walk(tree):
        documented = isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node)
        if documented and "commands" not in path.parts:
            docs.add(id(node.body[0].value))
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) for part in node.values if isinstance(part, ast.Constant))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            yield node.value


def test_the_list_of_words_is_read():
    assert AVOID["would do"] == "must be, expected, use" and len(AVOID) >= 15
    assert found("two would do, so an Account of\nwork has a loop gap") == ["would do", "Account of work", "loop gap"]


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_what_a_module_shows_has_the_words_of_the_glossary(path):
    assert [(text, bad) for text in strings(path) if (bad := found(text))] == []


@pytest.mark.parametrize("path", TEMPLATES, ids=name_of)
def test_what_a_template_shows_has_the_words_of_the_glossary(path):
    assert found(re.sub(r"//.*", "", path.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_pages_have_the_words_of_the_glossary(path):
    """Measured parts are written from recorded tables, whose text is that of their run."""
    text = path.read_text(encoding="utf-8").replace(RULES, "") if path == GLOSSARY else path.read_text(encoding="utf-8")
    text = re.sub(f"{BEGIN}.*?{END}", "", text, flags=re.DOTALL)
    assert found(text.replace("(picket-fence effect)", "")) == []


def test_captions_have_the_words_of_the_glossary():
    contents = yaml.safe_load((ROOT / "workflow/replication/paper/contents.yaml").read_text(encoding="utf-8"))
    for part in contents.values():
        for name, entry in part.items():
            for field in ("title", "text", "if_synthetic"):
                assert found(entry.get(field) or "") == [], (name, field)


def test_columns_of_the_glossary_exist():
    known = {*COLUMNS, *MEASURES, *HEADINGS, *(f"{side}_{rest}" for side in PLACES for rest in OF_A_SIDE)}
    known |= {f"{side}_areas" for side in ("left", "right")}
    known |= {column for _, columns in TABLES.values() for column in columns}
    elsewhere = {"pitch", "error", "covered_90", "departure", "kind"}
    for line in TERMS.splitlines():
        cells = line.split(" | ")
        if line.startswith("| ") and len(cells) == 4:
            for column in re.findall(r"`(\w+)`", cells[2].partition(" is ")[0]):
                assert column in known | elsewhere, column
