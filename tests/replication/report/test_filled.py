"""Measured parts of the README and the docs: what their tables say, and that they are of the present rig and claims."""

import re
import shutil

import pandas as pd
import pytest

from laboratory.report.filled import PAGES as OF_THE_LABORATORY
from tests.conftest import ROOT, refused, written
from trackdyn.rig.rig import parameter_table
from trackdyn_replication.paper.claims import load_claims, printed_text
from trackdyn_replication.paper.tracks import FOLDER
from trackdyn_replication.report.filled import BEGIN, END, PAGES, fill, stored, write_pages


@pytest.mark.parametrize(("page", "sources", "write"), (*PAGES, *OF_THE_LABORATORY))
def test_pages_say_what_was_measured(page, sources, write, tmp_path):
    """Nobody has typed into a measured block, and none is older than its data."""
    copy = shutil.copy(ROOT / page, tmp_path / "page.md")
    fill(copy, [ROOT / stored(source) for source in sources], write)
    assert copy.read_text(encoding="utf-8") == (ROOT / page).read_text(encoding="utf-8")


def test_what_was_measured_is_of_this_rig():
    stored = pd.read_csv(ROOT / "docs" / "measured" / "parameters.csv").set_index("name")["value"]
    now = parameter_table("paper").set_index("name")["value"]
    assert list(stored.index) == list(now.index)
    for name in now.index:
        assert stored[name] == str(now[name]) or float(stored[name]) == pytest.approx(float(now[name]), rel=1e-5), name


def test_what_was_measured_is_of_these_claims():
    claims = load_claims(ROOT / "config" / "claims.yaml")
    card = pd.read_csv(ROOT / "docs" / "measured" / "claims.csv", keep_default_na=False)
    for rig, rows in card.groupby("rig", sort=False):
        assert rows[["id", "part", "claim"]].values.tolist() == [[c.id, c.part or "", c.claim] for c in claims], rig
        for printed, claim in zip(rows["printed"], claims, strict=True):
            assert isinstance(claim.printed, dict) or printed == printed_text(claim)
    groups = (claim.number_names or [claim.claim] for claim in claims if claim.numbers)
    names = [name for group in groups for name in (group.values() if isinstance(group, dict) else group)]
    for table in ("printed_numbers.csv", "data/plausible/grips_numbers.csv"):
        assert pd.read_csv(ROOT / stored(table))["claim"].tolist() == names, table


def test_columns_of_sampled_tracks_are_described():
    """Those of values, sentences, claims and radii are described by their kind, those of `grips_` elsewhere."""
    text = (ROOT / FOLDER / "README.md").read_text(encoding="utf-8")
    for file in (ROOT / FOLDER).glob("*.csv"):
        assert f"`{file.name}`" in text
        if file.name not in ("grips_numbers.csv", "grips_sentences.csv", "grips_ring.csv"):
            columns = pd.read_csv(file, nrows=0).columns
            named = [name for name in columns if not re.fullmatch(r"\d+|C\d\d\w?|\w+\.\w+|\w+_share_pct .*", name)]
            assert [name for name in named if f"`{name}`" not in text] == [], file.name


def test_a_page_without_marks_is_named(tmp_path):
    page, source = written(tmp_path / "page.md", f"{BEGIN} once {END} {END}"), written(tmp_path / "rows.csv", "a\n1\n")
    refused(fill, page, [source], lambda rows: "", words=["must occur once each"], error=Exception)


def test_files_are_kept_and_pages_are_written_from_them(tmp_path, monkeypatch):
    """What the commands of the rules `pictures` and `laboratory_pages` do."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs" / "measured").mkdir(parents=True)
    page = written(tmp_path / "docs" / "page.md", f"{BEGIN}{END}")
    written(tmp_path / "rows.csv", "a\n1\n")
    write_pages(["rows.csv"], [("docs/page.md", ("rows.csv",), lambda rows: f"sum {rows['a'].sum()}")])
    assert "sum 1" in page.read_text(encoding="utf-8")
