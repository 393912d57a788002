"""From files to an answer, on a track in closed form; what cannot work is refused in one sentence."""

import numpy as np
import pandas as pd
import pytest

from laboratory.inference.identification import experiment
from laboratory.inference.identification.experiment import MeasuredSpeed
from laboratory.report import identification
from tests.conftest import run_command
from trackdyn import load_rig
from trackdyn.sensor.sensor_csv import write_sensor_csv

pytestmark = pytest.mark.slow

TRUTH = {"bushing__stiffness": 700.0, "tension__pre_tension": 4000.0, "bushing__loss_factor": 0.125}


@pytest.fixture
def folder(tmp_path, monkeypatch, rig_path, closed_form):
    """A working directory with a rig and records of the closed form at 150 and 210 rev/min."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config" / "rigs").mkdir(parents=True)
    (tmp_path / "config" / "rigs" / "paper.yaml").write_bytes(rig_path.read_bytes())
    rng = np.random.default_rng(5)
    for rpm in (150, 210):
        ay = closed_form(load_rig(rig_path).changed(**TRUTH), MeasuredSpeed(rpm, 0.308, 1000), 7)
        write_sensor_csv(f"{rpm}.csv", np.arange(ay.size) / 1000, None, ay + 0.005 * rng.standard_normal(ay.size), None)
    return tmp_path


@pytest.fixture
def unpainted(monkeypatch):
    """No page is written."""
    monkeypatch.setattr(identification, "write_identification_page", lambda answer, rig, out, *_: out / "index.html")


SHORT = ("--rig", "config/rigs/paper.yaml", "--simulations", "16", "--steps", "300", "--jobs", "1", "--quiet")
UNKNOWN = ("--unknown", "bushing.stiffness", "--unknown", "tension.pre_tension=2000:10000")


def test_an_answer_holds_the_truth_and_every_file(folder):
    said = run_command("identify", "150.csv", "210.csv", *UNKNOWN, "--synthetic", "constructed", *SHORT)
    assert said.code == 0, said
    out = folder / "identified"
    table = pd.read_csv(out / "unknowns.csv").set_index("unknown")
    assert (table["verdict"] == "identified").all()
    assert table.loc["bushing.stiffness", "q05"] < 700 < table.loc["bushing.stiffness", "q95"]
    assert table.loc["tension.pre_tension", "q05"] < 4000 < table.loc["tension.pre_tension", "q95"]
    best = load_rig(out / "rig.yaml")
    assert best.bushing.stiffness == pytest.approx(table.loc["bushing.stiffness", "best"], rel=1e-5)
    assert best.changed(bushing__stiffness=1.0, tension__pre_tension=1.0) == load_rig("config/rigs/paper.yaml").changed(
        bushing__stiffness=1.0, tension__pre_tension=1.0
    )
    draws = pd.read_csv(out / "draws.csv")
    assert draws["tension.pre_tension"].between(2000, 10000).all() and len(draws) > 200
    features = pd.read_csv(out / "features.csv")
    assert set(features["record"].astype(str)) == {"150", "210"} and features["inside"].mean() > 0.8
    left_out = pd.read_csv(out / "held_out.csv")
    assert len(left_out) == len(features) and left_out["inside"].mean() > 0.7
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "The records are constructed, not measured" in page and "bushing.stiffness is " in page
    assert {path.name for path in out.glob("*.png")} == {"posterior.png", "features.png", "spectra.png", "held_out.png"}
    assert not list(out.rglob("*.part*"))


def test_resuming_simulates_nothing_twice_and_says_the_same(folder, unpainted, monkeypatch):
    words = ("210.csv", "--unknown", "bushing.stiffness", *SHORT, "--steps", "100")
    assert run_command("identify", *words).code == 0
    first = (folder / "identified" / "draws.csv").read_bytes()
    said = run_command("identify", *words)
    assert said.code == 1 and "--out identified already exists; use --resume to go on" in said.err
    counted = []
    compute = experiment.run_rig
    monkeypatch.setattr(experiment, "run_rig", lambda **task: counted.append(task) or compute(**task))
    assert run_command("identify", *words, "--resume").code == 0
    assert not counted
    assert (folder / "identified" / "draws.csv").read_bytes() == first


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("210.csv", "--unknown", "bushing.colour"), "'bushing.colour' is not a parameter of the rig"),
        (("210.csv", "--simulations", "100"), "--simulations = 100: must be a power of two of at least 16"),
        (("210.csv", "--rpm", "150", "--rpm", "210"), "--rpm is given 2 times for 1 records"),
        (("210.csv", "210.csv"), "210.csv: has the same name as 210.csv"),
        (("short.csv",), "short.csv: the record of 13 s is shorter than 4 turns of the loop; record at least 17."),
        (("copy.csv", "210.csv"), "210.csv: has the same speed as copy.csv, 210"),
        (("210.csv", "--preset", "quick"), "preset = 'quick':"),
        (("210.csv", "--ring-radius", "wide"), "--ring-radius = 'wide':"),
        (("missing.csv",), "missing.csv"),
    ],
)
def test_what_cannot_work_is_refused_in_one_sentence(folder, words, sentence):
    text = (folder / "210.csv").read_text(encoding="utf-8")
    (folder / "copy.csv").write_text(text, encoding="utf-8")
    (folder / "short.csv").write_text("\n".join(text.splitlines()[:13002]) + "\n", encoding="utf-8")
    said = run_command("identify", *words, *(() if "--simulations" in words else SHORT))
    assert said.code == 1
    assert sentence in said.err and said.err.count("\n") == 1 and "Traceback" not in said.err
    assert not (folder / "identified" / "index.html").exists()


def test_records_that_tell_nothing_are_refused(folder):
    said = run_command("identify", "210.csv", "--unknown", "idler.bearing_drag", *SHORT)
    assert said.code == 1 and "no feature of a record depends on the unknown" in said.err
    said = run_command("identify", "210.csv", "--unknown", "bushing.stiffness=699:701", "--resume", *SHORT)
    assert said.code == 1 and "the records are not informative about any unknown" in said.err
    assert not (folder / "identified" / "rig.yaml").exists()
