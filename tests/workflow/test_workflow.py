"""The workflow parses, plans every rule, refuses a bad configuration in one sentence, and leaves traces."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest
import yaml

from replication.pipeline.config import StudyName
from replication.report import tables

ROOT = Path(__file__).parents[2]
RULE_FILES = sorted((ROOT / "workflow" / "rules").glob("*.smk"))
# a body ends where the next line begins that is indented no further than the rule
RULE = re.compile(r"^( *)(?:rule|checkpoint)\s+(\w+)\s*:(.*?)(?=^\1?\S|\Z)", re.MULTILINE | re.DOTALL)
RULES = {
    name: (path, body)
    for path in [ROOT / "Snakefile", *RULE_FILES]
    for _, name, body in RULE.findall(path.read_text(encoding="utf-8"))
}
SCRIPTS = {
    name: found[1]
    for name, (_, body) in RULES.items()
    if (found := re.search(r'^ +script:\s*"../scripts/(\w+\.py)"$', body, re.MULTILINE))
}
for path in RULE_FILES:  # the same rule with other outputs
    for rule, twin in re.findall(r"^use rule (\w+) as (\w+) with:", path.read_text(encoding="utf-8"), re.MULTILINE):
        SCRIPTS[twin] = SCRIPTS[rule]
SWEEP = (ROOT / "workflow" / "sweep.smk").read_text(encoding="utf-8")
OF_A_SWEEP = {  # the kernels are the pipeline's
    name: found[1]
    for _, name, body in RULE.findall(SWEEP)
    if (found := re.search(r'^ +script: "scripts/(\w+\.py)"$', body, re.MULTILINE)) and name != "warm_up"
}
BY_NAME, ONE_BATCH = {"ensemble"}, {"ensemble_short"}  # the full form, and the short one, which is not cut into batches
for path in RULE_FILES:
    for module in re.findall(
        r"^use rule \* from \w+ exclude all as (\w+)_\*$", path.read_text(encoding="utf-8"), re.MULTILINE
    ):
        used = [] if module in BY_NAME else ["gather"] if module in ONE_BATCH else OF_A_SWEEP
        SCRIPTS |= {f"{module}_{rule}": OF_A_SWEEP[rule] for rule in used}
SCRIPTED = sorted(SCRIPTS)
ON_DEMAND = {"deviations", "crate", "calibration", "identify_synthetic"}
OF_THESE = {"fit_form"}  # done for one of the full forms
FULL_FORMS = {
    "trade",
    "extremes",
    "traction",
    "whole_loop",
    "layouts",
    "wear",
    "fit",
    "assumptions",
}  # their rules make the short ones, too
BY_DEMAND = ON_DEMAND | FULL_FORMS
PAGES = {"page", "identify_synthetic"}  # of HTML
IN_A_FOLDER_OF_ITS_OWN = {"benchmark_form"}  # its problems are in `benchmarks`, which copies of the repository lack
WITH_A_TOLERANCE = {"plan"}  # exists only where the configuration asks for it


def snakemake(tmp_path, *arguments, run="-n", root=ROOT):
    """Plan the workflow as it stands; nothing is run or locked."""
    return subprocess.run(
        [sys.executable, "-m", "snakemake", run, "--nolock", "--nocolor", *arguments],
        cwd=root,
        env=os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        timeout=300,
    )


def quick_config(tmp_path, change=lambda data: None):
    """A copy of the quick configuration, its results elsewhere."""
    data = yaml.safe_load((ROOT / "config" / "quick.yaml").read_text(encoding="utf-8"))
    data["results"] = str(tmp_path / "results")
    change(data)
    path = tmp_path / "copy.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return path


def test_the_rules_are_found():
    assert {"all", "warm_up", "simulate", "metrics"} <= RULES.keys()
    assert {"warm_up", "simulate", "metrics"} <= set(SCRIPTED)


def test_dry_run_of_the_quick_configuration_plans_every_rule(tmp_path):
    """Planned from nothing: the results folder of the copy is empty."""
    result = snakemake(tmp_path, "studies", "--configfile", str(quick_config(tmp_path)))
    output = result.stdout + result.stderr
    assert result.returncode == 0, output
    planned = dict(re.findall(r"^(\w+) +(\d+)$", output, re.MULTILINE))
    assert set(SCRIPTED) - ON_DEMAND - OF_THESE - WITH_A_TOLERANCE <= planned.keys(), output
    # 4 records and again with the coarse tooth, 2 of meshing; 4 rings of one rig and 3 of the other, three of them a
    # job
    assert int(planned["simulate"]) == 2 * 4 + 2
    assert int(planned["ring_batch"]) == 3
    assert int(planned["warm_up"]) == 1
    assert not (tmp_path / "results").exists()


def test_nothing_in_the_results_changes_the_plan_or_is_taken_for_a_study_of_the_run(tmp_path):
    config = str(quick_config(tmp_path))
    before = snakemake(tmp_path, "--configfile", config).stdout
    figures = tmp_path / "results" / "short" / "figures"
    figures.mkdir(parents=True)
    for path in (figures.parent / "traction.csv", figures / "traction.png", figures / "traction.svg"):
        path.touch()
    after = snakemake(tmp_path, "--configfile", config).stdout
    planned = [re.findall(r"^(\w+) +(\d+)$", text, re.MULTILINE) for text in (before, after)]
    assert planned[0] == planned[1] and len(planned[0]) > 10


def test_what_a_run_does_not_make_is_booked_by_name(tmp_path):
    """The costs of a default run are those of its rules alone; short forms have a folder of their own."""
    planned = re.findall(r"^(\w+) +\d+$", snakemake(tmp_path, "--configfile", str(quick_config(tmp_path))).stdout, re.M)
    families = {
        name: found[1]
        for name, (_, body) in RULES.items()
        if (found := re.search(r'log: f"{R}/logs/(?:{{short}})?(\w+)', body)) and name not in WITH_A_TOLERANCE
    }
    assert {"simulate", "page", "assumptions_form", "calibration"} <= families.keys()
    for name, family in families.items():
        assert (family in tables.BY_NAME) == (name not in planned), name


def test_a_broken_configuration_ends_in_one_sentence(tmp_path):
    def repeat_a_radius(data):
        data["ring_study"]["radii_m"] = [0.303, 0.308, 0.308]

    result = snakemake(tmp_path, "--configfile", str(quick_config(tmp_path, repeat_a_radius)))
    output = result.stdout + result.stderr
    assert result.returncode != 0
    sentence = "copy.yaml: ring_study.radii_m = [0.303, 0.308, 0.308]: 0.308 occurs twice; give rising values"
    assert output.count(sentence) == 1, output
    assert "Traceback (most recent call last)" not in output


def test_a_wrong_number_on_the_command_line_is_refused_too(tmp_path):
    result = snakemake(tmp_path, "--configfile", str(quick_config(tmp_path)), "--config", 'records={"duration_s": -1}')
    output = result.stdout + result.stderr
    assert result.returncode != 0
    assert re.search(r"copy.yaml: records.duration_s = '?-1'?:", output), output
    assert "Traceback (most recent call last)" not in output


def test_every_rule_that_makes_something_leaves_traces():
    for name, (path, body) in RULES.items():
        if re.search(r"^ +(output|script|shell|run):", body, re.MULTILINE):
            for directive in ("log", "message"):
                assert re.search(rf"^ +{directive}:", body, re.MULTILINE), f"{path.name}: {name} has no {directive}"


def test_every_script_exists_and_is_what_its_rule_needs():
    """And no script stands there unused."""
    folder = ROOT / "workflow" / "scripts"
    of_the_module = re.findall(r'^ +script: "scripts/(\w+\.py)"$', SWEEP, re.MULTILINE)
    assert {path.name for path in folder.glob("[!_]*.py")} == {*SCRIPTS.values(), *of_the_module}
    for name, (_, body) in RULES.items():
        assert re.findall(r'needs\("(.*?)"\)', body) == ([SCRIPTS[name]] if name in SCRIPTS else []), name


def test_every_rule_file_is_included():
    text = (ROOT / "Snakefile").read_text(encoding="utf-8")
    included = set(re.findall(r'^include: "workflow/rules/([^"]+)"', text, re.MULTILINE))
    assert included == {path.name for path in RULE_FILES}


def test_a_tolerance_puts_the_planner_before_the_records(tmp_path):
    def ask(data):
        data["records"]["plan"] = {"tolerance": "2%", "measure": "rms", "data": str(tmp_path / "results" / "trade.csv")}

    runs = [str(tmp_path / "results" / "runs" / f"{run}.npz") for run in ("coarse/115rpm", "meshing/ring")]
    planned = planned_jobs(tmp_path, quick_config(tmp_path, ask), *runs)
    # the data are the study's: seven scenes for statistics, five for the state
    assert planned == {
        "article": 1, "warm_up": 1, "warm_up_method": 2, "trade_scene": 12, "trade_data": 1, "plan": 1, "simulate": 2,
        "total": 20,
    }  # fmt: skip


# --- what an edit makes due -----------------------------------------------------------------------------


def planned_jobs(tmp_path, config, *targets, root=ROOT):
    """Jobs by rule that a dry run plans."""
    result = snakemake(tmp_path, "--configfile", str(config), "--", *targets, root=root)
    assert result.returncode == 0, result.stdout + result.stderr
    return {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", result.stdout + result.stderr, re.M)}


class Pretended:
    """A copy of the repository with an empty file in place of every result, and Snakemake's records of them."""

    def __init__(self, folder):
        self.folder, self.root = folder, folder / "copy"
        skipped = shutil.ignore_patterns("__pycache__")
        for name in ("config", "data", "trackdyn", "workflow"):
            shutil.copytree(ROOT / name, self.root / name, ignore=skipped)
        shutil.copy(ROOT / "Snakefile", self.root)
        self.config = quick_config(folder, lambda data: data.update(short_studies=list(get_args(StudyName))))
        self.made = {}
        for row in self.summary("--summary"):
            self.made.setdefault(row["rule"], set()).add(row["output_file"])
            file = Path(row["output_file"])
            file.parent.mkdir(parents=True, exist_ok=True)
            file.touch()
        arguments = ("--configfile", str(self.config), "-j1", "--forceall", "--", "all", *BY_DEMAND)
        result = snakemake(folder, *arguments, run="--touch", root=self.root)
        assert result.returncode == 0, result.stdout + result.stderr

    def summary(self, kind):
        """Snakemake's table of every file that the workflow can make."""
        arguments = ("--configfile", str(self.config), "--", "all", *BY_DEMAND)
        result = snakemake(self.folder, *arguments, run=kind, root=self.root)
        assert result.returncode == 0, result.stdout + result.stderr
        head, *rows = (line.split("\t") for line in result.stdout.splitlines() if "\t" in line)
        assert len(rows) > 50
        return [dict(zip(head, row, strict=True)) for row in rows]

    def planned(self, config=None):
        return planned_jobs(self.folder, config or self.config, root=self.root)

    def due(self, file):
        """Rules that Snakemake would run again after an edit in this file."""
        text, before = file.read_bytes(), file.stat()
        try:
            file.write_bytes(text + b"\n")
            return {row["rule"] for row in self.summary("--summary") if row["plan"] == "update pending"}
        finally:
            file.write_bytes(text)
            os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))


@pytest.fixture(scope="module")
def pretended(tmp_path_factory):
    return Pretended(tmp_path_factory.mktemp("pretended"))


def test_only_what_depends_on_a_change_is_planned_again(pretended, tmp_path):
    """One more radius costs the job of its own runs and what is made of them, and nothing else."""
    assert pretended.planned() == {}
    data = yaml.safe_load(pretended.config.read_text(encoding="utf-8"))
    data["ring_study"]["radii_m"].append(0.3135)
    more = tmp_path / "more.yaml"
    more.write_text(yaml.safe_dump(data), encoding="utf-8")
    planned = pretended.planned(more)
    assert planned["ring_design"] == planned["ring_gather"] == 1
    assert {"metrics", "ring_figures", "claims"} <= planned.keys()
    assert not {"simulate", "meshing_figures", "closure", "sensor_figures", "sensitivity", "warm_up"} & planned.keys()


@pytest.mark.parametrize(
    "cell, rerun",
    [("chain.link_mass: {value: null", True), ("115: {rms_simulation: null", False)],
    ids=["of the rig", "of Table 3"],
)
def test_a_cell_of_the_article_makes_due_what_it_concerns(pretended, cell, rerun):
    """The invented cell of a rig reruns what reads a rig; one of Table 3 the scorecard and the page."""
    file = pretended.root / "config" / "paper" / "tables.yaml"
    text, before = file.read_bytes(), file.stat()
    try:
        file.write_text(text.decode("utf-8").replace(cell, cell.replace("null", "11.0")), encoding="utf-8")
        planned = pretended.planned()
    finally:
        file.write_bytes(text)
        os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert {"claims", "page", "manifest"} <= planned.keys()
    reading = {"article", "warm_up", "simulate", "parameters", "schematics", "ring_batch", "peer"}
    assert reading <= planned.keys() if rerun else not reading & planned.keys(), planned


# Run once, forked for every script: what is loaded when it is run up to the name `snakemake`, which it lacks, and
# when what its modules import within functions is imported, too. A package hands out what is asked for; it does not
# import at once all that it offers.
LOADER = r"""
import importlib, json, os, re, runpy, sys, types
from pathlib import Path
from typing import get_args

import jinja2, matplotlib.figure, numba, numpy, pandas, PIL, plotly, pydantic, scipy.optimize

root = Path(sys.argv[1])
sys.path[:0] = [str(root / "workflow" / "scripts"), str(root)]
ours = (str(root / "trackdyn"), str(root / "workflow"))  # and not what a virtual environment in the clone holds
OFFERS = root / "trackdyn" / "__init__.py"
asked, run = set(), set()


class Package(types.ModuleType):
    def __init__(self, file):
        super().__init__(".".join(file.parent.relative_to(root).parts))
        self.__file__, self.__path__, self.text = str(file), [str(file.parent)], file.read_text("utf-8")

    def __getattr__(self, name):
        if (inner := sys.modules.get(f"{self.__name__}.{name}")) is not None:
            return inner
        asked.add(self.__file__)
        offered = re.findall(r"^ *from (\S+) import (?:\(([^)]*)\)|(.*))$", self.text, re.M)
        for module, block, line in offered:
            if name in re.findall(r"\w+", block + line):
                return getattr(importlib.import_module(module), name)
        if not re.search(rf"^(?:def |class )?{name}\b", self.text, re.M):
            raise AttributeError(name)
        run.add(Path(self.__file__))
        names = {"__name__": self.__name__, "__path__": self.__path__}
        exec(self.text, names)
        return names[name]


def loaded(script):
    for file in sorted(root.glob("trackdyn/**/__init__.py")):
        package = Package(file)
        sys.modules[package.__name__] = package
    try:
        runpy.run_path(str(script), run_name="__main__")
    except NameError as error:
        assert "snakemake" in str(error), error
    seen = set()
    while True:
        modules = [m for m in list(sys.modules.values()) if str(getattr(m, "__file__", None)).startswith(ours)]
        files = {Path(m.__file__) for m in modules if not isinstance(m, Package) or m.__file__ in asked}
        if files == seen:
            break
        for file in files - seen - ({OFFERS} - run):  # which imports in a function what it offers
            for line in re.findall(r"^ +((?:from trackdyn|import trackdyn).*)$", file.read_text("utf-8"), re.M):
                exec(line, {})
        seen = files
    packages = {p / "__init__.py" for f in files for p in f.parents if (p / "__init__.py").is_file()}
    return sorted(str(file.relative_to(root)) for file in (files | packages) - {script})


found = {}
for script in sorted((root / "workflow" / "scripts").glob("[!_]*.py")):
    read, write = os.pipe()
    if os.fork() == 0:
        os.write(write, json.dumps(loaded(script)).encode())
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as answer:
        found[script.name] = json.loads(answer.read())
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def loaded():
    """Files that each script loads when it is run, by the name of the script."""
    command = [sys.executable, "-c", LOADER, str(ROOT)]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    return {script: set(files) for script, files in json.loads(result.stdout).items()}


@pytest.fixture(scope="module")
def inputs(pretended):
    """Input files of each rule, as Snakemake has recorded them."""
    files = {}
    for row in pretended.summary("--detailed-summary"):
        files.setdefault(row["rule"], set()).update(row["input-file(s)"].split(","))
    return files


def test_every_rule_has_exactly_the_sources_that_its_script_loads(inputs, loaded):
    """So an edit in any module makes exactly those rules due whose scripts import it, by whatever way."""
    assert inputs.keys() == set(SCRIPTED) - WITH_A_TOLERANCE - IN_A_FOLDER_OF_ITS_OWN
    for rule, files in inputs.items():
        sources = {file for file in files if file.endswith(".py")}
        assert sources == loaded[SCRIPTS[rule]], rule
    # what stands beside the modules of pages belongs to them alone
    beside = {rule for rule, files in inputs.items() if any(file.endswith((".js", ".css", ".j2")) for file in files)}
    assert beside == PAGES
    assert all("config/rig.yaml" in inputs[rule] for rule in ("simulate", "parameters", "schematics", "page"))
    assert "config/rigs/possible.yaml" in inputs["fit_form"]
    # a picture's style is no matter of the runs, nor are the kernels of the list of parameters
    assert not any("report" in file for file in inputs["simulate"])
    assert not any("chain" in file or "integrate" in file for file in inputs["parameters"])


@pytest.mark.parametrize("name", ["printed.py", "meshing.py", "page.js"])
def test_an_edit_makes_the_rules_due_that_import_it(pretended, inputs, loaded, name):
    """And those that take from them; nothing else."""
    (file,) = [path for path in (pretended.root / "trackdyn").rglob(name) if path.parent.name != "figures"]
    importing = {rule for rule in inputs if str(file.relative_to(pretended.root)) in loaded[SCRIPTS[rule]]}
    expected = importing or set(PAGES)
    while later := {r for r in inputs.keys() - expected if any(inputs[r] & pretended.made[due] for due in expected)}:
        expected |= later
    assert pretended.due(file) == expected
    assert len(expected) < len(inputs)
