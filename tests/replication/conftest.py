"""A small results folder for the page, and the files of sampled tracks that it reads."""

import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from tests.conftest import ROOT, made_recording
from trackdyn.jit import source_hash
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn_replication.paper.claims import VERDICTS

RIG = load_rig("paper")
STORED = ROOT / "data" / "plausible"
NAMES = ("sentences", "claims", "map", "draws", "mobilised", "near")
TRACKS = {name: STORED / f"plausible_{name}.csv" for name in NAMES} | {
    "rings": STORED / "rings.csv",
    "grips": STORED / "grips_sentences.csv",
    "study": STORED / "grip.csv",
    "picture": ROOT / "docs" / "pictures" / "rig_bench.png",
}


def made(sources=None):
    """A made-up recording of a tenth of a second."""
    time = np.arange(1, 101) / RIG.rate
    run = made_recording(Scene(RIG, 210.0, duration=0.1), time, np.zeros((100, 1, 3)), wheel_rate=np.zeros((100, 3)))
    return replace(run, meta=run.meta | {"sources": sources or source_hash(), "versions": {"numpy": np.__version__}})


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A small results folder with something for most sections of the page."""
    results = tmp_path_factory.mktemp("results")
    made().save(results / "runs" / "210rpm.npz")
    places = ("Fig. 24", "Fig. 15", "Fig. 15", "Table 1")
    pd.DataFrame([
        {"rig": "paper", "id": f"C{i:02d}", "part": "", "place": figure, "sentence": i if i < 3 else None,
         "claim": f"Statement {i} </script> (of a kind)", "printed": "ours: at most 1.5", "unit": "m", "tolerance": 0.2,
         "measured": "1.4, 1.61234, 1.5", "verdict": verdict, "speeds": "115, 150", "fails_if": "something else came",
         "reason": "Because of a test."}
        for i, (verdict, figure) in enumerate(zip(VERDICTS, places, strict=True), 1)
    ]).to_csv(results / "claims.csv", index=False)  # fmt: skip
    (results / "tables").mkdir()
    for name, text in {
        "sentences.csv": "rig,number,sentence,verdict\npaper,1,Sentence 1,met\npaper,2,Sentence 2,not met\n",
        "metrics.csv": "run,rpm\n210rpm,210\n", "trade.csv": "scene,error\nring,0.01\n",
        "tables/table1.csv": "area,r_mm\n1,30.0\n2,40.0\n",
        "tables/extremes.csv": "family,rows,completed,refused,defects\nspeed,23,14,9,0\n",
    }.items():  # fmt: skip
        (results / name).write_text(text, encoding="utf-8")
    shutil.copy("docs/measured/printed_numbers.csv", results)
    shutil.copy("docs/measured/parameters.csv", results / "tables")
    promise = {"scene": "no ring 210 rpm", "measure": "left_share", "tolerance": 0.005, "cpu_s": 0.004}
    promise |= {"trial_cpu_s": 0.41, "setting": "semi_implicit, 0.0001 s"}
    errors = ((0.0093, False), (0.001, True), (np.nan, None))
    promises = (promise | {"achieved_error": error, "met": met} for error, met in errors)
    pd.DataFrame(promises).to_csv(results / "planner.csv", index=False)
    pd.DataFrame([
        {"scene": scene, "setting": setting, "rms": -0.0004, "left_share": -29.196, "loop_gap_m": 3.1e-14}
        for scene in ("no ring", "ring") for setting in ("preset=paper", "tooth_contact=three_surfaces")
    ]).to_csv(results / "tables" / "fidelity.csv", index=False)  # fmt: skip
    (results / "figures").mkdir()
    figure = Figure(figsize=(7, 3))
    figure.subplots().plot([0, 1])
    for name in ("fig05", "fig15", "fig18_a", "fig24", "trade", "extremes_solvers"):
        figure.savefig(results / "figures" / f"{name}.png", dpi=150)
    return results
