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

RIG = load_rig(ROOT / "trackdyn" / "rigs" / "paper.yaml")
RATE = RIG.rate
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
    time = np.arange(1, 101) / RATE
    run = made_recording(Scene(RIG, 210.0, duration=0.1), time, np.zeros((100, 1, 3)), wheel_rate=np.zeros((100, 3)))
    return replace(run, meta=run.meta | {"sources": sources or source_hash(), "versions": {"numpy": np.__version__}})


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A small results folder with something for most sections of the page."""
    results = tmp_path_factory.mktemp("results")
    made().save(results / "runs" / "210rpm.npz")
    places = ("Fig. 24", "Fig. 15", "Fig. 15", "Table 1")
    card = [
        {"rig": "paper", "id": f"C{i:02d}", "part": "", "place": figure, "sentence": i if i < 3 else None,
         "claim": f"Statement {i} </script> (of a kind)",
         "printed": "ours: at most 1.5", "measured": "1.4, 1.61234, 1.5", "unit": "m", "tolerance": 0.2,
         "verdict": verdict,
         "speeds": "115, 150", "fails_if": "something else came",
         "reason": "Because of a test."}
        for i, (verdict, figure) in enumerate(zip(VERDICTS, places, strict=True), 1)
    ]  # fmt: skip
    pd.DataFrame(card).to_csv(results / "claims.csv", index=False)
    sentences = [["paper", i, f"Sentence {i}", VERDICTS[i - 1]] for i in (1, 2)]
    columns = ["rig", "number", "sentence", "verdict"]
    pd.DataFrame(sentences, columns=columns).to_csv(results / "sentences.csv", index=False)
    numbers = pd.read_csv("docs/measured/printed_numbers.csv", dtype={"part": str})
    numbers.to_csv(results / "printed_numbers.csv", index=False)
    (results / "metrics.csv").write_text("run,rpm\n210rpm,210\n", encoding="utf-8")
    (results / "tables").mkdir()
    pd.DataFrame({"area": [1, 2], "r_mm": [30.0, 40.0]}).to_csv(results / "tables" / "table1.csv", index=False)
    shutil.copy("docs/measured/parameters.csv", results / "tables")
    (results / "trade.csv").write_text("scene,error\nring,0.01\n", encoding="utf-8")
    promise = {"scene": "no ring 210 rpm", "measure": "left_share", "tolerance": 0.005, "cpu_s": 0.004}
    promise |= {"trial_cpu_s": 0.41, "setting": "semi_implicit, 0.0001 s"}
    promises = [promise | {"achieved_error": error, "met": met} for error, met in ((0.0093, False), (0.001, True))]
    promises.append(promise | {"achieved_error": np.nan, "met": None})
    pd.DataFrame(promises).to_csv(results / "planner.csv", index=False)
    ladder = [
        {"scene": scene, "setting": setting, "rms": -0.0004, "left_share": -29.196, "loop_gap_m": 3.1e-14}
        for scene in ("no ring", "ring") for setting in ("preset=paper", "tooth_contact=three_surfaces")
    ]  # fmt: skip
    pd.DataFrame(ladder).to_csv(results / "tables" / "fidelity.csv", index=False)
    extremes = {"family": ["speed"], "rows": [23], "completed": [14], "refused": [9], "defects": [0]}
    pd.DataFrame(extremes).to_csv(results / "tables" / "extremes.csv", index=False)
    (results / "figures").mkdir()
    figure = Figure(figsize=(7, 3))
    figure.subplots().plot([0, 1])
    figure.savefig(results / "figures" / "fig15.png", dpi=150)
    for name in ("fig05", "fig18_a", "fig24", "trade", "extremes_solvers"):
        (results / "figures" / f"{name}.png").write_bytes((results / "figures" / "fig15.png").read_bytes())
    return results
