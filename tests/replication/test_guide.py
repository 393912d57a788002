"""Every task of CONTRIBUTING, done in a copy of the project as the guide says, has the effect that it promises."""

import json
import pickle
import shutil

import pytest

from tests.conftest import run_python
from tests.replication.conftest import TRACKS
from tests.workflow.test_workflow import copy_project, planned_jobs, snakemake

pytestmark = pytest.mark.slow

FOLDER = "workflow/trackdyn_replication"
SCRIPT = """from trackdyn.sweeps.snakemake_job import run_job

import pandas as pd

from trackdyn.inputs.files import write_csv
from trackdyn.plots.style import new_figure, save


@run_job
def main(job):
"""
DRAW = """    figure = new_figure(2.0)
    figure.subplots().plot([0, 1])
    save(figure, job.output[0])
"""
STUDY = """    for path in job.output:
        write_csv(path, pd.DataFrame({"answer": [100 + job.params.study["number"]]}))
"""
RULE = """

rule {0}:
    \"\"\"One of mine.\"\"\"
    input: "config/config.yaml"
    output: {1}
    params: study=CONFIG.studies.probe.model_dump()
    log: f"{{R}}/logs/{0}.log"
    script: "../trackdyn_replication/{2}"
"""
CAPTION = "  {0}:\n    {0}:\n      title: {1}\n      text: Its content.\n"
MEASURE = 'ACCELERATION += (_entry("tilt_g", "g", "tilt of mine", lambda s: s.of(s.mean), shown=True),)\n'
PROBED = RULE.format("probe", 'f"{R}/probe.csv", f"{R}/tables/probe.csv"', "study/probe.py")
# a file, a place in it (empty: its end), and the text that comes there
TASKS = [
    # a measure
    ("trackdyn/measure/catalogue.py", "OTHERS = (", MEASURE),
    # a metric
    ("trackdyn/measure/metrics.py", '        "rpm": scene.motor_rpm', '        "swing_g": 0.0,\n'),
    ("trackdyn/measure/columns.yaml", "  rpm: [", '  swing_g: [number, g, "swing", exact]\n'),
    # a recorded array
    ("trackdyn/model/arrays.py", "    wheel_rate: Anno", '    wheel_turn: Annotated[np.ndarray, Row(("wheels",))]\n'),
    ("trackdyn/integrate/run.py", "        rows.wheel_rate[", "        rows.wheel_turn[sample, wheel] = 1.0 + wheel\n"),
    # an option of a sensor's file
    ("trackdyn/fieldtest/sensor_mapping.py", "    resample:", '    mine: bool = Field(False, description="Mine.")\n'),
    # a figure
    (f"{FOLDER}/report/figures/mine.py", "", SCRIPT + DRAW),
    ("workflow/rules/records.smk", "", RULE.format("mine", 'figure("mine")', "report/figures/mine.py")),
    (f"{FOLDER}/paper/contents.yaml", "  grip_figure:", CAPTION.format("mine", "A figure of mine")),
    # a study
    (f"{FOLDER}/study/settings.py", "class Studies(", "class Probe(Section):\n    number: Count\n\n\n"),
    (f"{FOLDER}/study/settings.py", "    trade: TradeStudy", "    probe: Probe\n"),
    ("config/studies.yaml", "", "\nprobe:\n  number: 7\n"),
    ("config/quick_studies.yaml", "", "\nprobe:\n  number: 5\n"),
    ("workflow/rules/studies.smk", "", PROBED),
    (f"{FOLDER}/study/probe.py", "", SCRIPT + STUDY),
    (f"{FOLDER}/paper/contents.yaml", "", CAPTION.format("probe", "A study of mine\n      table: true")),
]
SHOWN = """
import json, pickle, sys
from pathlib import Path

from typer.testing import CliRunner

from trackdyn import compare, load_rig, measures, read_sensor, Scene
from trackdyn.commands import console
from trackdyn.commands.cli import app
from trackdyn.fieldtest.sensor_mapping import load_mapping
from trackdyn.inputs.errors import InputError
from trackdyn.measure.metrics import run_metrics, shown_measures
from trackdyn.simulation.belt import belt_recording
from trackdyn.simulation.recording import load_recording
from trackdyn_replication.report.page.builder import build_page

folder, results, tracks = Path(sys.argv[1]), Path(sys.argv[2]), json.loads(sys.argv[3])
belt = belt_recording(Scene(load_rig("paper"), 150.0, duration=30.0, chain="belt", ring_radius=None, contact_log=False))
console.measures(belt, shown_measures(belt))
try:
    load_recording(folder / "old.npz")
except InputError as error:
    refused = str(error)
loop = pickle.loads((folder / "loop").read_bytes())
loop.record(0.002).save(folder / "new.npz")
record = read_sensor("data/synthetic/150rpm.csv")
printed = {
    "measures": list(measures(belt).index), "compared": list(compare(belt, record)["measure"]),
    "metrics": list(run_metrics("", belt)), "refused": refused, "mapped": load_mapping(folder / "mine.yaml").mine,
    "help": CliRunner().invoke(app, ["compare", "--help"]).output,
    "array": load_recording(folder / "new.npz").wheel_turn.tolist(),
    "page": build_page(results, tracks=tracks, studies=["probe"]),
}
print("\\n" + json.dumps(printed))
"""


def test_every_task_of_the_guide_has_the_promised_effect(tmp_path, results, driven_loop):
    copy, loop = copy_project(tmp_path / "copy"), driven_loop()
    loop.record(0.002).save(tmp_path / "old.npz")
    (tmp_path / "mine.yaml").write_text("mine: true\n", encoding="utf-8")
    (tmp_path / "loop").write_bytes(pickle.dumps(loop))
    for name, anchor, added in TASKS:
        before = (copy / name).read_text(encoding="utf-8") if (copy / name).exists() else ""
        assert anchor in before, name
        text = before.replace(anchor, added + anchor, 1) if anchor else before + added
        (copy / name).write_text(text, encoding="utf-8")

    # a figure and a study: the run has them, and they are made
    quick = ("--configfile", "config/quick.yaml", "--")
    assert {"mine", "page"} <= planned_jobs(tmp_path, *quick, "all", root=copy).keys()
    assert {"mine", "probe", "page"} <= planned_jobs(tmp_path, *quick, "studies", root=copy).keys()
    code, output = snakemake(tmp_path, *quick, "mine", "probe", run="-j1", root=copy)
    assert code == 0, output
    made = tmp_path / "results"
    shutil.copytree(results, made, ignore=shutil.ignore_patterns("runs"))
    for name in ("figures/mine.png", "tables/probe.csv", "probe.csv"):
        shutil.copy(copy / "results" / "quick" / name, made / name)

    # all of them, interpreted: new kernels would be compiled only for this test
    words = "-c", SHOWN, tmp_path, made, json.dumps(TRACKS, default=str)
    done = run_python(*words, cwd=copy, PYTHONPATH=f"{copy}:{copy / 'workflow'}", NUMBA_DISABLE_JIT=1)
    assert done.code == 0, done.err
    screen, shown = done.out.rsplit("\n", 2)[0], json.loads(done.out.rsplit("\n", 2)[1])
    assert "tilt of mine" in screen and "no +-" in screen and "the error of the step is not known" in screen
    assert {"tilt_g"} <= {*shown["measures"]} & {*shown["compared"]} and {"tilt_g", "swing_g"} <= {*shown["metrics"]}
    assert "other arrays than this version records ('wheel_turn')" in shown["refused"] and "\n" not in shown["refused"]
    assert shown["mapped"] is True and "--mine" in shown["help"] and "Mine." in shown["help"]
    assert shown["array"] == [[1.0, 2.0, 3.0]] * 2
    for words in ("A figure of mine</h3>", "A study of mine</h3>", "105"):
        assert words in shown["page"]

    # a mistake in a claim is named before anything runs
    claims = copy / "config" / "claims.yaml"
    text = claims.read_text(encoding="utf-8")
    claims.write_text(text.replace("measure: rms_against_experiment", "measure: rms_against_experimemt", 1), "utf-8")
    code, output = snakemake(tmp_path, *quick, "all", root=copy)
    assert code and "config/claims.yaml: claim " in output and "Traceback (most recent call last)" not in output
    assert "'rms_against_experimemt' is not a measure; did you mean 'rms_against_experiment'?" in output
