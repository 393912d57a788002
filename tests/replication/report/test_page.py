"""The page: complete, self-contained, refusing mixed results, and working in a real browser."""

import base64
import gzip
import json
import re
import shutil
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from tests.conftest import ROOT, made_recording
from trackdyn.inputs.errors import InputError
from trackdyn.jit import source_hash
from trackdyn.rig.rig import load_rig
from trackdyn.scene.scene import Scene
from trackdyn_replication.paper.claims import VERDICTS
from trackdyn_replication.paper.contents import Item
from trackdyn_replication.report.page import builder
from trackdyn_replication.report.page.builder import build_page

RIG_FILE = ROOT / "trackdyn" / "rigs" / "paper.yaml"
RIG = load_rig(RIG_FILE)
RATE = RIG.rate
STORED = ROOT / "data" / "plausible"
NAMES = ("sentences", "claims", "map", "draws", "mobilised", "near")
TRACKS = {name: STORED / f"plausible_{name}.csv" for name in NAMES} | {
    "rings": STORED / "rings.csv",
    "grips": STORED / "grips_sentences.csv",
    "study": STORED / "grip.csv",
    "picture": ROOT / "docs" / "pictures" / "rig_bench.png",
}
of_paper = partial(build_page, tracks=TRACKS)


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


@pytest.fixture(scope="module")
def page_file(results):
    path = results / "report.html"
    path.write_text(of_paper(results), encoding="utf-8")
    return path


def test_recordings_of_another_version_are_refused(results, tmp_path):
    shutil.copytree(results, tmp_path / "mixed")
    made("0123456789abcdef").save(tmp_path / "mixed" / "runs" / "ring" / "old.npz")
    with pytest.raises(InputError, match=r"old\.npz: was made by another version"):
        build_page(tmp_path / "mixed")


def test_the_same_results_give_the_same_page(results, page_file):
    assert of_paper(results) == page_file.read_text(encoding="utf-8")


def test_every_figure_and_table_of_ours_is_shown_once(results, tmp_path, monkeypatch):
    """Also one that nobody has placed on the page: of the replication, and of a study."""
    added = {
        "OWN": Item("mine", "A title of mine", "closure", "A caption."),
        "OF_STUDIES": Item("b", "B of a study", "trade", "C."),
    }
    for group, item in added.items():
        monkeypatch.setattr(builder, group, (*getattr(builder, group), item))
    items = (*builder.OWN, *builder.OF_STUDIES)
    shutil.copytree(results, tmp_path / "all")
    for item in items:
        kind = "tables/table1.csv" if item.table else "figures/fig15.png"
        place = (tmp_path / "all" / kind).with_stem(item.key)
        if not place.exists():
            shutil.copy(results / kind, place)
    page = of_paper(tmp_path / "all", studies=builder.STUDIES)
    heads = [re.sub("<.*?>", "", head).strip() for head in re.findall("<h3>(.*?)</h3>", page)]
    assert [item.key for item in items if heads.count(item.title) != 1] == ["lines"]
    assert page.count("<caption>Dominant peaks of the spectra") == 1
    assert "of an earlier run" not in page and "of an earlier run" in of_paper(results)
    assert "Further figures and tables" in page and "Further figures" not in of_paper(results)


def first_screen(page):
    return page[: page.index('aria-label="Sections"')]


def test_the_first_screen_has_the_finding_the_conclusions_and_all_that_fails(results, page_file, tmp_path):
    """Synthetic records are compared with nothing of the paper's, and not there; those of a user are."""
    shutil.copytree(results, tmp_path / "all")
    for name in ("claims", "sentences"):
        shutil.copy(f"docs/measured/{name}.csv", tmp_path / "all")
    record = {"speed_rpm": 150.0, "sensor_record": "mine", "rms_simulation_g": 0.955, "rms_sensor_g": 0.957}
    record |= {"rms_difference_pct": -0.209, "rms_difference_printed_against_papers_own_data_pct": 4.96}
    pd.DataFrame([record]).to_csv(tmp_path / "all" / "tables" / "table3.csv", index=False)
    page = of_paper(tmp_path / "all")
    first, judged = first_screen(page), pd.read_csv("docs/measured/sentences.csv")
    assert "The tangential force of the ring decides conclusion 3" in first and "0.957" not in first
    assert re.findall(r"<sub>(\d+)</sub>", first) == [str(number) for number in judged["number"]]
    failed = judged.loc[judged["verdict"] == "not met", "sentence"]
    assert all(f"{sentence}</a>" in first for sentence in failed) and f"not met: {len(failed)}" in first
    assert "0.957" in page and "4.96" not in page
    real = of_paper(tmp_path / "all", synthetic=False)
    assert "0.957" in first_screen(real) and "4.96" in first_screen(real)


def test_a_short_run_and_a_rig_of_ones_own_are_said_to_be(results):
    """Nobody asks whether an own rig shows what the paper prints, and nothing of it was fitted to that."""
    page = of_paper(results, layers=["config/quick.yaml"], short="Records last 16 s.")
    assert "A short run." in page and "Records last 16 s. Its configuration: <code>config/quick.yaml</code>." in page
    record = {"speed_rpm": 150.0, "sensor_record": "mine", "rms_simulation_g": 0.955, "rms_sensor_g": 0.957}
    table = results / "tables" / "table3.csv"
    pd.DataFrame([record | {"rms_difference_pct": -0.209}]).to_csv(table, index=False)
    own = build_page(results, synthetic=False)
    table.unlink()  # other tests have none
    first = first_screen(own)
    assert re.findall(r'<td class="number">(.*?)</td>', first) == ["0.955", "0.957", "\N{MINUS SIGN}0.21"]
    assert own.count("The rig paper in the runs of the paper") == 2 and "A short run." not in own
    for words in ("caterpillar track</h1>", "sentences of the paper", "are not public", "Figure 15</span>"):
        assert words in page and words not in own


def carried(text, name):
    """Data that a page carries compressed."""
    packed = re.search(rf'<script type="application/gzip" id="{name}">(.*?)</script>', text).group(1)
    return gzip.decompress(base64.b64decode(packed)).decode("utf-8")


def test_the_page_carries_everything_and_is_small(page_file):
    text = page_file.read_text(encoding="utf-8")
    # a full run adds 2.8 MB of pictures and data; 5 MB is the limit
    assert page_file.stat().st_size < 0.6e6
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", text)
    assert json.loads(carried(text, "data"))["files"].keys() >= {"claims.csv", "metrics.csv"}
    assert text.count("data:image/webp") == 6  # every figure once
    assert text.index("<b>Fitted</b>") < text.index("<b>Printed</b>")


def test_the_page_goes_in_the_order_of_the_paper_with_its_statements_at_their_figures(results):
    """A sentence stands above the statements that decide it, with the share of plausible tracks."""
    tracks = TRACKS | {name: results / f"tracks_{name}.csv" for name in ("claims", "sentences")}
    for name, of in (("claims", "C02"), ("sentences", "2")):
        table = pd.read_csv(TRACKS[name], dtype={"name": str}).query("name != @of")
        two = table.iloc[:2].assign(name=of, tracks=["all", "engaged"], share=[0.125, 0.9])
        pd.concat([table, two]).to_csv(tracks[name], index=False)
    page = build_page(results, tracks=tracks)
    for path in results.glob("tracks_*.csv"):
        path.unlink()
    sections = re.findall(r'<figure id="(fig\d+|table\d)">', page)
    assert sections == ["fig05", "table1", "fig15", "fig18", "fig24"]
    of_15 = page[page.index('<figure id="fig15">') : page.index('<figure id="fig18">')]
    cells = [re.sub("<.*?>", "", cell) for cell in re.findall(r"<t[hd]\b.*?</t[hd]>", of_15)]
    assert cells[6:11] == ["2. Sentence 2", "○ not met", "", "90", "12"]
    assert cells[12] == "ours: at most 1.5" and cells[15:17] == ["90", "12"]
    assert "Statement 3" in of_15 and "Statement 1" not in of_15 and "<img" in of_15


@pytest.fixture
def open_page(open_file, page_file):
    """Function that opens the page from disk."""
    return partial(open_file, page_file)


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1400, "dark")])
def test_no_rule_of_accessibility_is_broken(open_page, broken_rules, width, scheme):
    assert broken_rules(open_page(width, 900, color_scheme=scheme)) == []


@pytest.mark.parametrize("width", [1000, 390])
def test_tables_fit_and_letters_in_pictures_can_be_read(open_page, width):
    page = open_page(width, 900)
    wide = "all => all.filter(e => e.scrollWidth > e.clientWidth).map(e => e.ariaLabel)"
    assert width < 1000 or page.eval_on_selector_all(".wide", wide) == []
    pixels = "all => all.map(e => 7 / 72 * e.clientWidth / e.style.getPropertyValue('--inches'))"
    assert min(page.eval_on_selector_all(".picture img", pixels)) >= 9
