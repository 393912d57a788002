"""The pages of docs/ and the README hold: blocks run, links, paths and names exist.

The ``python`` blocks of a page are run in one namespace, in a folder with a copy of config/. Of ``console`` blocks the
lines that begin with ``$ trackdyn`` are run there in the order of the page; lines below them must be printed. A block
with more than its language behind the fence, such as ``python not run``, is shown only.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig

import pytest
import typer.main

from tests.conftest import ROOT, run_command, run_python
from trackdyn.commands.cli import app

PAGES = sorted((ROOT / "docs").glob("*.md"))
DOCUMENTS = [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
BLOCK = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMANDS = typer.main.get_command(app).commands


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def text_of(path):
    return path.read_text(encoding="utf-8")


def blocks(path, *languages):
    """Language, first line and text of the fenced blocks in some languages."""
    text = text_of(path)
    every = ((match[1], text.count("\n", 0, match.start()) + 1, match[2]) for match in BLOCK.finditer(text))
    return [block for block in every if block[0] in languages]


def inline_code(path):
    """Everything between single backquotes outside of fenced blocks."""
    return re.findall(r"`([^`\n]+)`", BLOCK.sub("", text_of(path)))


def shell_lines(path):
    """Words of the commands in shell blocks, without comments and settings of the environment."""
    for _, _, text in blocks(path, "sh", "bash", "shell", ""):
        for line in text.splitlines():
            words = shlex.split(line, comments=True)
            while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
                words.pop(0)
            if words:
                yield words


def trackdyn_lines(path):
    """Words of the commands of ours in shell blocks, console blocks and inline code."""
    yield from (words for words in shell_lines(path) if words[0] == "trackdyn")
    console = (line[2:] for *_, text in blocks(path, "console") for line in text.splitlines() if line[:2] == "$ ")
    inline = (code for code in inline_code(path) if re.match(r"trackdyn [a-z]+ \S", code))
    yield from (words for line in (*console, *inline) if (words := shlex.split(line))[0] == "trackdyn")


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_commands_have_the_options_and_arguments_that_they_name(path):
    for _, name, *words in trackdyn_lines(path):
        if "--help" in words:
            continue
        try:
            COMMANDS[name].make_context(name, words)  # reads the words, and runs nothing
        except Exception as error:
            # a text may leave out the arguments
            assert type(error).__name__ == "MissingParameter", f"trackdyn {name} {words}: {error}"


@pytest.mark.slow  # test_logger_page runs the lines of the other page, which read files of loggers
@pytest.mark.parametrize("path", [path for path in PAGES if path.name != "your-loggers-file.md"], ids=name_of)
def test_blocks_of_a_page_run(path, tmp_path, monkeypatch, pyplot):
    shutil.copytree(ROOT / "config", tmp_path / "config")
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "page"}
    for language, line, text in blocks(path, "python", "console"):
        where = f"{name_of(path)}:{line}"
        if language == "python":
            # blank lines in front: a traceback then shows the line of the page
            exec(compile("\n" * line + text, where, "exec"), namespace)
            continue
        for command, expected in re.findall(r"^\$ trackdyn (.*)\n((?:(?!\$ ).*\n)*)", text, re.MULTILINE):
            code, out, err = run_command(*shlex.split(command))
            same = (out + err).strip() == expected.strip() if expected.strip() else code == 0
            assert same, f"{where}: {command}: {out + err}"


def readme_script():
    """The README's commands in their order: shell blocks, Python blocks, commands of ours in its text and tables."""
    pattern = re.compile(rf"{BLOCK.pattern}|`((?:trackdyn|snakemake|make) [^`\n]+)`", re.MULTILINE | re.DOTALL)
    return "\n".join(
        f"python - <<'END'\n{block}END" if language == "python" else command or block
        for language, block, command in pattern.findall(text_of(ROOT / "README.md"))
        if language in ("python", "", "sh", "bash", "shell")
    )


# The address of the clone is the reader's. Commands that take minutes are only planned, but for a study of one radius.
# Nothing is loaded from an index: packages are those of this environment.
AROUND = """
set -e
git() {{ cp -r '{tree}' "${{@: -1}}"; }}
python3.11() {{ '{python}' "$@"; }}
pip() {{
  rm -rf .venv/lib/python3*/site-packages/setuptools*  # too old for the clone, in a new environment
  echo '{packages}' > "$(echo .venv/lib/python3*/site-packages)/ours.pth"
  command pip "$@" --quiet --no-deps --no-build-isolation --disable-pip-version-check
}}
trackdyn() {{
  case "$*" in "ring my_rig"*) command trackdyn "$@" --rpm 210 --radii 0.307;; *) command trackdyn "$@";; esac
}}
make() {{ command make --dry-run "$@"; }}
snakemake() {{ python -m snakemake --dry-run --quiet all "$@"; }}
"""


@pytest.mark.slow
def test_the_readme_is_a_script_that_runs_in_a_fresh_folder(tmp_path):
    script, tree = readme_script(), tmp_path / "tree"
    assert all(words in script for words in ("git clone", "activate", "trackdyn simulate", "trackdyn compare"))
    listed = ["git", "ls-files", "-co", "--exclude-standard", "-z"]
    for name in filter(None, subprocess.run(listed, cwd=ROOT, capture_output=True, check=True).stdout.split(b"\0")):
        if (source := ROOT / name.decode()).is_file():
            (tree / name.decode()).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, tree / name.decode())
    python = getattr(sys, "_base_executable", sys.executable)
    outside = [folder for folder in os.environ["PATH"].split(os.pathsep) if not folder.startswith(sys.prefix)]
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    environment["PATH"] = os.pathsep.join(outside)
    command = ["bash", "-c", AROUND.format(tree=tree, packages=sysconfig.get_path("purelib"), python=python) + script]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    output = " ".join(done.stdout.split())
    printed = re.findall(r"^#> (.+)$", script, re.MULTILINE)
    assert len(printed) == 3 and [line for line in printed if " ".join(line.split()) not in output] == []


def test_pages_are_short_enough_to_be_read():
    words = sum(len(text_of(path).split()) for path in PAGES)
    assert words <= 11_300, f"{words} words; state a fact once and link to it"


def test_the_readme_is_short_and_has_its_first_command_and_the_finding_early():
    lines = text_of(ROOT / "README.md").splitlines()
    assert len(lines) <= 80
    before = " ".join(lines[: next(k for k, line in enumerate(lines) if line.startswith("```sh"))])
    assert len(before.split()) <= 220
    assert any("decides conclusion 3" in line for line in lines[:40])


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_relative_links_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)\s]+)\)", BLOCK.sub("", text_of(path))):
        if not re.match(r"[a-z]+:", target) and not target.startswith("#"):
            assert (path.parent / target.partition("#")[0]).exists(), target


def named_paths(path):
    """Paths in the inline code of a page: something with a slash or a known ending, and no placeholder."""
    for code in inline_code(path):
        for word in code.split():
            word = word.partition("::")[0].rstrip(",;:")
            path_like = re.fullmatch(r"[\w.-]+(/[\w.-]+)+/?|[\w-]+/|[\w-]+\.(md|lock|toml|yaml|cff)", word)
            if path_like and not re.fullmatch(r"[\d./]+", word):
                yield word


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_named_paths_exist(path):
    for word in named_paths(path):
        if word in ("logger.yaml", "my_rig.yaml") or word.startswith("results/"):
            continue  # files of the user; results are looked for in the plan of the pipeline
        # the page may leave out the name of the package, or that of its own folder
        folders = (ROOT, ROOT / "trackdyn", ROOT / "workflow", ROOT / "laboratory", path.parent)
        assert any((folder / word).exists() for folder in folders), word


def test_targets_of_the_pipeline_that_are_named_can_be_made(tmp_path):
    """Files in results/ and targets of snakemake commands, in one plan of the full configuration."""
    targets = set()
    for path in DOCUMENTS:
        targets |= {word for word in named_paths(path) if word.startswith("results/") and re.search(r"\.\w+$", word)}
        for words in shell_lines(path):
            if words[0] == "snakemake" and "--configfile" not in words:
                targets |= {word for word in words[1:] if not word.startswith("-") and word != "laboratory/Snakefile"}
    # made outside of the pipeline: the benchmark's own file
    targets.discard("results/benchmarks/cost.json")
    targets = {target for target in targets if not target.startswith("results/quick/")}  # of another configuration
    assert "results/figures/fig24.png" in targets
    words = "-m", "snakemake", "-s", "laboratory/Snakefile", "-n", "--quiet", "all", "--nolock", "--nocolor"
    done = run_python(*words, *sorted(targets), XDG_CACHE_HOME=tmp_path / "cache")
    assert done.code == 0, done
