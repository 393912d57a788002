"""The page: complete, self-contained, refusing mixed results, and working in a real browser."""

import base64
import gzip
import json
import re
import shutil
from functools import partial

import pandas as pd
import pytest

from tests.conftest import refused
from tests.replication.conftest import TRACKS, made
from trackdyn_replication.report.page import builder
from trackdyn_replication.report.page.builder import build_page

of_paper = partial(build_page, tracks=TRACKS)


@pytest.fixture(scope="module")
def page_file(results):
    path = results / "report.html"
    path.write_text(of_paper(results), encoding="utf-8")
    return path


@pytest.fixture
def copy(results, tmp_path):
    return shutil.copytree(results, tmp_path / "copy")


def test_recordings_of_another_version_are_refused(copy):
    made("0123456789abcdef").save(copy / "runs" / "ring" / "old.npz")
    refused(build_page, copy, words=["old.npz: was made by another version"])


def test_every_figure_and_table_of_ours_is_shown_once(results, copy):
    items = (*builder.OWN, *builder.OF_STUDIES)
    for item in items:
        kind = "tables/table1.csv" if item.table else "figures/fig15.png"
        copied = (copy / kind).with_stem(item.key)
        if not copied.exists():
            shutil.copy(results / kind, copied)
    page = of_paper(copy, studies=builder.STUDIES)
    heads = [re.sub("<.*?>", "", head).strip() for head in re.findall("<h3>(.*?)</h3>", page)]
    assert [item.key for item in items if heads.count(item.title) != 1] == ["lines"]
    assert page.count("<caption>Dominant peaks of the spectra") == 1
    assert "of an earlier run" not in page and "of an earlier run" in of_paper(results)


def first_screen(page):
    return page[: page.index('aria-label="Sections"')]


RECORD = {"speed_rpm": 150.0, "sensor_record": "mine", "rms_simulation_g": 0.955, "rms_sensor_g": 0.957,
          "rms_difference_pct": -0.209}  # fmt: skip


def test_the_first_screen_has_the_finding_the_conclusions_and_all_that_fails(copy):
    """Synthetic records are compared with nothing of the paper's, and not there; those of a user are."""
    for name in ("claims", "sentences"):
        shutil.copy(f"docs/measured/{name}.csv", copy)
    record = RECORD | {"rms_difference_printed_against_papers_own_data_pct": 4.96}
    pd.DataFrame([record]).to_csv(copy / "tables" / "table3.csv", index=False)
    page = of_paper(copy)
    first, judged = first_screen(page), pd.read_csv("docs/measured/sentences.csv")
    assert "The tangential force of the ring decides conclusion 3" in first and "0.957" not in first
    assert re.findall(r"<sub>(\d+)</sub>", first) == [str(number) for number in judged["number"]]
    failed = judged.loc[judged["verdict"] == "not met", "sentence"]
    assert all(f"{sentence}</a>" in first for sentence in failed) and f"not met: {len(failed)}" in first
    assert "0.957" in page and "4.96" not in page
    real = first_screen(of_paper(copy, synthetic=False))
    assert "0.957" in real and "4.96" in real


def test_a_short_run_and_a_rig_of_ones_own_are_said_to_be(copy):
    """Nobody asks whether an own rig shows what the paper prints, and nothing of it was fitted to that."""
    page = of_paper(copy, layers=["config/quick.yaml"], short="Records last 16 s.")
    assert "A short run." in page and "Records last 16 s. Its configuration: <code>config/quick.yaml</code>." in page
    pd.DataFrame([RECORD]).to_csv(copy / "tables" / "table3.csv", index=False)
    own = build_page(copy, synthetic=False)
    numbers = re.findall(r'<td class="number">(.*?)</td>', first_screen(own))
    assert numbers == ["0.955", "0.957", "\N{MINUS SIGN}0.21"]
    assert own.count("The rig paper in the runs of the paper") == 2 and "A short run." not in own
    for words in ("caterpillar track</h1>", "sentences of the paper", "are not public", "Figure 15</span>"):
        assert words in page and words not in own


def test_the_page_carries_everything_is_small_and_the_same_for_the_same_results(results, page_file):
    text = page_file.read_text(encoding="utf-8")
    assert text == of_paper(results)
    # a full run adds 2.8 MB of pictures and data; 5 MB is the limit
    assert page_file.stat().st_size < 0.6e6
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", text)
    packed = re.search('<script type="application/gzip" id="data">(.*?)</script>', text)[1]
    data = json.loads(gzip.decompress(base64.b64decode(packed)))
    assert data["files"].keys() >= {"claims.csv", "metrics.csv"}
    assert text.count("data:image/webp") == 6  # every figure once
    assert text.index("<b>Fitted</b>") < text.index("<b>Printed</b>")


def test_the_page_goes_in_the_order_of_the_paper_with_its_statements_at_their_figures(results, tmp_path):
    """A sentence stands above the statements that decide it, with the share of plausible tracks."""
    tracks = TRACKS | {name: tmp_path / f"tracks_{name}.csv" for name in ("claims", "sentences")}
    for name, of in (("claims", "C02"), ("sentences", "2")):
        table = pd.read_csv(TRACKS[name], dtype={"name": str}).query("name != @of")
        two = table.iloc[:2].assign(name=of, tracks=["all", "engaged"], share=[0.125, 0.9])
        pd.concat([table, two]).to_csv(tracks[name], index=False)
    page = build_page(results, tracks=tracks)
    assert re.findall(r'<figure id="(fig\d+|table\d)">', page) == ["fig05", "table1", "fig15", "fig18", "fig24"]
    of_15 = page[page.index('<figure id="fig15">') : page.index('<figure id="fig18">')]
    cells = [re.sub("<.*?>", "", cell) for cell in re.findall(r"<t[hd]\b.*?</t[hd]>", of_15)]
    assert cells[6:11] == ["2. Sentence 2", "○ not met", "", "90", "12"]
    assert cells[12] == "ours: at most 1.5" and cells[15:17] == ["90", "12"]
    assert "Statement 3" in of_15 and "Statement 1" not in of_15 and "<img" in of_15


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1000, "light"), (1400, "dark")])
def test_pages_fit_any_width_and_break_no_rule_of_accessibility(open_file, page_file, broken_rules, width, scheme):
    """Tables fit, and letters in pictures are large enough."""
    page = open_file(page_file, width, 900, color_scheme=scheme)
    wide = "all => all.filter(e => e.scrollWidth > e.clientWidth).map(e => e.ariaLabel)"
    assert width < 1000 or page.eval_on_selector_all(".wide", wide) == []
    pixels = "all => all.map(e => 7 / 72 * e.clientWidth / e.style.getPropertyValue('--inches'))"
    assert min(page.eval_on_selector_all(".picture img", pixels)) >= 9
    assert broken_rules(page) == []
