"""The workflow plans every rule, refuses a bad configuration in one sentence, and reruns rules after an edit."""

import json
import os
import re
import shutil
import tempfile
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml

from tests.conftest import ROOT, run_python, written
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.sources import imported_files
from trackdyn_replication.study.settings import STUDIES

QUICK = ROOT / "config" / "quick.yaml"
FOLDERS = [ROOT / name for name in ("trackdyn", "workflow", "laboratory")]
RULE_FILES = [*(ROOT / "workflow/rules").glob("*.smk"), *(ROOT / "laboratory/rules").glob("*.smk")]
SCRIPTS = sorted({
    (path.parent / script).resolve() for path in [*RULE_FILES, ROOT / "workflow/sweep.smk"]
    for script in re.findall(r'^ +script:\s*"(\S+\.py)"$', path.read_text("utf-8"), re.MULTILINE)
})  # fmt: skip
# rules that simulate: measures and words of their runs do not concern them
SIMULATING = {
    "simulate", "ring_runs", "peer_runs", "trade_scene", "trade_promises", "extremes_part", "animation_run", "warm_up",
    "warm_up_method", "fidelity_setting",
}  # fmt: skip


def snakemake(tmp_path, *arguments, run="-n", root=ROOT):
    """Exit code and text of Snakemake, which plans the workflow unchanged; nothing is run or locked."""
    words = ("-m", "snakemake", run, "--nolock", "--nocolor", *arguments)
    done = run_python(*words, cwd=root, XDG_CACHE_HOME=tmp_path / "cache")
    return done.code, done.out + done.err


def copy_project(folder):
    """A copy of the files of the project that the workflow reads."""
    for name in ("config", "data", "docs/measured", "docs/pictures", "profiles", "trackdyn", "workflow"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "Snakefile", folder)
    return folder


def planned_jobs(tmp_path, *arguments, root=ROOT):
    """Jobs by rule that a dry run plans."""
    code, output = snakemake(tmp_path, *arguments, root=root)
    assert code == 0, output
    return {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", output, re.M)}


def config_file(tmp_path, data=None):
    """A copy of a configuration, by default the quick one, its results elsewhere."""
    data = (data or read_yaml(QUICK)) | {"results": str(tmp_path / "results")}
    return written(tmp_path / "copy.yaml", yaml.safe_dump(data))


def test_a_quick_run_with_its_studies_is_planned_from_nothing(tmp_path):
    planned = planned_jobs(tmp_path, "studies", "--configfile", config_file(tmp_path))
    # 4 records, each with the coarse tooth, too, 1 at a rounded speed, and 2 of meshing; rings at 2 speeds
    assert (planned["simulate"], planned["warm_up"]) == (2 * 4 + 1 + 2, 1)
    assert (planned["ring_runs"], planned["metrics"], planned["measure"]) == (2, 1, 2)
    assert {*STUDIES, "metrics", "claims", "page", "manifest"} <= planned.keys()
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("setting", "others"), [("tension=sprung", 0), ("space=spatial", 1), ("integrator=rk4", 1), ("preset=fast", 1)]
)
def test_a_setting_waits_for_the_kernels_that_it_runs(tmp_path, setting, others):
    """Those of the paper's method, and of another one or of motion in space."""
    target = f"{tmp_path}/results/fidelity/{setting}.csv"
    planned = planned_jobs(tmp_path, target, "--configfile", config_file(tmp_path))
    assert (planned["warm_up"], planned.get("warm_up_method", 0)) == (1, others)


def test_a_rig_is_sufficient(tmp_path):
    planned = planned_jobs(tmp_path, "--configfile", config_file(tmp_path, {"rig": "bench"}))
    assert {"page", "manifest", "claims"} <= planned.keys() and "sensor_records" not in planned
    assert planned["ring_runs"] == 4  # one a speed


def test_a_broken_configuration_ends_in_one_sentence(tmp_path):
    (data := read_yaml(QUICK))["ring_study"]["radii_m"] = [0.303, 0.308, 0.308]
    code, output = snakemake(tmp_path, "--configfile", config_file(tmp_path, data))
    sentence = "copy.yaml: ring_study.radii_m = [0.303, 0.308, 0.308]: 0.308 occurs twice; give rising values"
    assert code and output.count(sentence) == 1 and "Traceback (most recent call last)" not in output, output


def test_every_task_has_a_rule():
    modules = [file for folder in FOLDERS for file in folder.rglob("*.py")]
    assert sorted(file for file in modules if "\n@run_job\ndef main(job" in file.read_text(encoding="utf-8")) == SCRIPTS


def test_every_value_in_a_shell_line_is_quoted():
    """A name in a configuration is no code, and may hold a blank."""
    files = [*ROOT.glob("Snakefile"), *(ROOT / "laboratory").glob("Snakefile"), *RULE_FILES, *ROOT.glob("*/*.smk")]
    text = "".join(path.read_text(encoding="utf-8") for path in files)
    bodies = re.findall(r"^( +)shell:(.*?)(?=^\1?\S|\Z)", text, re.M | re.S)
    lines = [line.strip() for _, body in bodies for line in body.splitlines()]
    assert len(lines) >= 4
    for line in lines:
        fields = re.findall(r"\{[^{}]*\}", line)
        assert all(field.endswith(":q}") for field in fields), line
        # the rule's own text and nothing that Python puts in
        assert re.fullmatch(r'("[^"]*")?', line) and line.count("{") == len(fields), line


LOADED = """
import json, os, runpy, sys
import matplotlib.figure, numba, pandas, pydantic, scipy.optimize

sys.path[:0] = sys.argv[1:3]
for script in sys.argv[3:]:
    if os.fork() == 0:
        try:
            runpy.run_path(script, run_name="__main__")
        except AttributeError as error:
            assert "snakemake" in str(error), error
        files = [str(m.__file__) for m in list(sys.modules.values()) if getattr(m, "__file__", None)]
        os.write(1, json.dumps([script, files]).encode() + b"\\n")
        os._exit(0)
    assert os.wait()[1] == 0
"""


def test_scripts_load_no_file_of_ours_that_their_rules_do_not_need():
    """Scripts end here where they ask for their job, which they lack."""
    scripts = list({script.parent: script for script in SCRIPTS}.values())  # one of each folder
    lines = run_python("-c", LOADED, ROOT, ROOT / "workflow", *scripts).out.splitlines()
    for script, files in map(json.loads, lines):
        ours = {Path(file) for file in files if any(Path(file).is_relative_to(folder) for folder in FOLDERS)}
        assert len(ours) > 1 and ours - {Path(script)} <= set(imported_files(Path(script), ROOT)), script
    assert len(lines) == len(scripts) > 5


class Pretended:
    """A copy of the project with empty files for all results of a quick run, and Snakemake's records of them."""

    configured = ("--configfile", "config/quick.yaml", "--")
    targets = (*configured, "all", "studies")

    def __init__(self, folder):
        self.folder, self.root = folder, copy_project(folder / "copy")
        code, output = snakemake(folder, *self.targets, run="--summary", root=self.root)
        files = [line.split("\t")[0] for line in output.splitlines() if line.count("\t") > 3][1:]
        made = {"trade.csv", "extremes.csv", "fidelity.csv", "claims.csv", "report.html", "manifest.json"}
        assert code == 0 and made <= {Path(file).name for file in files}, output
        for file in files:
            (self.root / file).parent.mkdir(parents=True, exist_ok=True)
            (self.root / file).touch()
        self.touch("--forceall")

    def touch(self, *options):
        """Take every result for one of the present files."""
        code, output = snakemake(self.folder, "-j1", *options, *self.targets, run="--touch", root=self.root)
        assert code == 0, output

    def due(self, *options):
        """Rules that would run again, with how many jobs; with ``options`` in place of the targets."""
        planned = planned_jobs(self.folder, *(options or self.targets), root=self.root)
        return {rule: count for rule, count in planned.items() if rule not in ("all", "studies", "total")}

    @contextmanager
    def without(self, *names, below="results/quick"):
        """The copy without these results; a folder goes with its content."""
        aside = Path(tempfile.mkdtemp(dir=self.folder))
        for name in names:
            (aside / name).parent.mkdir(parents=True, exist_ok=True)
            (self.root / below / name).rename(aside / name)
        try:
            yield aside
        finally:
            for name in names:
                (aside / name).replace(self.root / below / name)

    @contextmanager
    def edited(self, edits):
        """The copy with other files: ``{"config/claims.yaml": function of the text}``."""
        with self.without(*edits, below="") as before:
            for name, edit in edits.items():
                text = (before / name).read_text(encoding="utf-8")
                assert edit(text) != text
                written(self.root / name, edit(text))
            yield


@pytest.fixture(scope="module")
def pretended(tmp_path_factory):
    return Pretended(tmp_path_factory.mktemp("pretended"))


def in_place_of(old, new):
    return lambda text: text.replace(old, new, 1)


# edits, the rules that they make due, further ones that they must not, and all that simulate and are due
EDITS = {
    "a metric and a caption": (
        {"trackdyn/measure/metrics.py": in_place_of('"run": name,\n', '"run": name,\n        "swing_g": 0.0,\n'),
         "trackdyn/measure/columns.yaml": in_place_of("  rpm: [", '  swing_g: [number, g, "swing", exact]\n  rpm: ['),
         "workflow/trackdyn_replication/paper/contents.yaml": in_place_of("title: ", "title: Here, ")},
        {"measure", "metrics", "claims", "page"}, set(), set(),
    ),
    "a claim and a cell of the article": (
        {"config/claims.yaml": in_place_of("tolerance: ", "tolerance: 1"),
         "config/article.csv": in_place_of("115,,", "115,11.0,")},
        {"claims", "page", "manifest"}, {"measure", "parameters", "schematics", "peer_runs"}, set(),
    ),
    "the template of the page": (
        {"workflow/trackdyn_replication/report/page/page.html.j2": in_place_of("<", "{# another #}<")},
        {"page", "manifest"}, {"measure", "claims", "schematics"}, set(),
    ),
    "a measure": (
        {"trackdyn/measure/catalogue.py":
         in_place_of("OTHERS = (", 'OTHERS = (Measure(Column("sway_g", "a sum", "g", "sway")),')},
        {"measure", "metrics"}, set(), {"fidelity_setting", "trade_promises", "trade_scene"},
    ),
}  # fmt: skip


@pytest.mark.parametrize(("edits", "due", "spared", "runs"), EDITS.values(), ids=EDITS)
def test_measures_and_words_of_runs_rerun_only_studies_whose_rows_are_measures(pretended, edits, due, spared, runs):
    with pretended.edited(edits):
        reruns = pretended.due()
    assert due <= reruns.keys() and not spared & reruns.keys(), reruns
    assert SIMULATING & reruns.keys() == runs


# files that the default run reads, the rules that read them, and one that does not (all read the rig)
@pytest.mark.parametrize(("names", "readers", "other"), [
    (["data/synthetic/150rpm.csv", "config/claims.yaml", "config/quick.yaml"], {"sensor_records", "claims"},
     "simulate"),
    (["trackdyn/rigs/paper.yaml", "trackdyn/plots/style.py"], {"simulate", "ring_runs", "closure", "claims"}, ""),
])  # fmt: skip
def test_a_file_of_an_older_date_is_another_file(pretended, names, readers, other):
    endings = {name: "\nANOTHER = 1\n" if name.endswith(".py") else "\n# another\n" for name in names}
    with pretended.edited({name: f"{{}}{ending}".format for name, ending in endings.items()}):
        for name in names:
            os.utime(pretended.root / name, (1.5e9, 1.5e9))
        due = pretended.due()
    assert readers | {"manifest"} <= due.keys() and other not in due


def test_a_comment_makes_nothing_due(pretended):
    names = ("trackdyn/contact/laws.py", "trackdyn/measure/metrics.py", "workflow/trackdyn_replication/paper/claims.py")
    with pretended.edited(dict.fromkeys(names, in_place_of("\n\n\n", "\n\n\n# another\n"))):
        assert pretended.due() == {}


def test_one_more_radius_costs_only_runs_of_rings(pretended):
    with pretended.edited({"config/quick.yaml": in_place_of("0.308, 0.313]", "0.308, 0.313, 0.3135]")}):
        due = pretended.due()
    assert {"measure", "metrics", "ring_figures", "claims"} <= due.keys()
    assert not {"simulate", "meshing_figures", "closure", "sensor_figures", "warm_up"} & due.keys()
    assert (due["ring_runs"], due["measure"], due["metrics"]) == (2, 1, 1)


@pytest.mark.parametrize(("names", "target", "rules"), [
    (["figures/fig24.png"], "", {"ring_figures", "page", "manifest"}),
    (["figures/fig08.svg", "tables/table1.csv"], "", {"schematics", "parameters", "page", "manifest"}),
    (["runs/meshing/ring.npz"], "", {"simulate", "meshing_figures", "metrics", "claims", "page", "manifest"}),
    # a job of another target, whose recording was removed when it began and never written
    (["runs/meshing/ring.npz"], "results/quick/figures/fig19.png", {"simulate", "meshing_figures"}),
    (["trade"], "trade", {"trade_scene", "trade_promises", "trade"}),
    (["kernels"], "", set()),
    (["figures", "tables", "runs", "measured", "extremes", "report.html"], "",
     {"simulate", "ring_runs", "measure", "closure", "schematics", "extremes_part", "statistics"}),
])  # fmt: skip
def test_a_missing_result_is_made_again_with_its_results(pretended, names, target, rules):
    with pretended.without(*names):
        due = pretended.due(*((*pretended.configured, target) if target else ()))
    assert rules <= due.keys() and bool(rules) == bool(due), due
    assert not {"peer_runs", "ring_runs", "trade_scene", "warm_up"} - rules & due.keys()
    assert pretended.due() == {}


def test_the_remedy_of_a_recording_of_another_configuration_makes_it_again(pretended):
    """A configuration was changed and its results touched: none is due, and the manifest's sentence names a command."""
    with pretended.edited({"config/quick.yaml": in_place_of("step_s: 1.0e-4", "step_s: 1.25e-4")}):
        assert pretended.due()["simulate"] == 2
        pretended.touch()
        assert pretended.due() == {}
        named = [f"results/quick/runs/meshing/{name}.npz" for name in ("no_ring", "ring")]
        due = pretended.due("-R", *named, *pretended.targets)
    assert due["simulate"] == 2 and {"metrics", "meshing_figures", "manifest"} <= due.keys()
    pretended.touch()
    assert pretended.due() == {}
