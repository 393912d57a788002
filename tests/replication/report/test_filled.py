"""Measured parts of the README and the docs: what their tables say, and that they are of the present rig and claims."""

import pandas as pd
import pytest

from laboratory.report.filled import PAGES as OF_THE_LABORATORY
from tests.conftest import ROOT
from trackdyn.rig.rig import parameter_table
from trackdyn_replication.paper.claims import load_claims, printed_text
from trackdyn_replication.report.filled import BEGIN, END, PAGES, fill, stored, write_pages


@pytest.mark.parametrize(("page", "sources", "write"), (*PAGES, *OF_THE_LABORATORY))
def test_pages_say_what_was_measured(page, sources, write, tmp_path):
    """Nobody has typed into a measured block, and none is older than its data."""
    copy = tmp_path / "page.md"
    copy.write_text((ROOT / page).read_text(encoding="utf-8"), encoding="utf-8")
    fill(copy, [ROOT / stored(source) for source in sources], write)
    assert copy.read_text(encoding="utf-8") == (ROOT / page).read_text(encoding="utf-8")


def test_what_was_measured_is_of_this_rig():
    stored = pd.read_csv(ROOT / "docs" / "measured" / "parameters.csv").set_index("name")["value"]
    now = parameter_table("paper").set_index("name")["value"]
    assert list(stored.index) == list(now.index)
    for name in now.index:
        assert stored[name] == str(now[name]) or float(stored[name]) == pytest.approx(float(now[name]), rel=1e-5), name


def test_what_was_measured_is_of_these_claims():
    stored = pd.read_csv(ROOT / "docs" / "measured" / "claims.csv", keep_default_na=False)
    claims = load_claims(ROOT / "config" / "claims.yaml")
    for rig, card in stored.groupby("rig", sort=False):
        assert card[["id", "part", "claim"]].values.tolist() == [[c.id, c.part or "", c.claim] for c in claims], rig
        bounds = [printed_text(c) for c in claims if not isinstance(c.printed, dict)]
        assert [p for p, c in zip(card["printed"], claims, strict=True) if not isinstance(c.printed, dict)] == bounds


@pytest.mark.parametrize("rig", ["printed", "grips"])
def test_stored_numbers_have_the_names_of_these_claims(rig):
    stored = pd.read_csv(ROOT / "docs" / "measured" / f"{rig}_numbers.csv")["claim"].tolist()
    claims = [claim for claim in load_claims(ROOT / "config" / "claims.yaml") if claim.numbers]
    names = [claim.number_names or [claim.claim] for claim in claims]
    assert stored == [name for group in names for name in (group.values() if isinstance(group, dict) else group)]


def test_a_page_without_marks_is_named(tmp_path):
    page, source = tmp_path / "page.md", tmp_path / "rows.csv"
    page.write_text(f"{BEGIN} once {END} {END}", encoding="utf-8")
    source.write_text("a\n1\n", encoding="utf-8")
    with pytest.raises(Exception, match="must occur once each"):
        fill(page, [source], lambda rows: "")


def test_files_are_kept_and_pages_are_written_from_them(tmp_path, monkeypatch):
    """What the commands of the rules `pictures` and `laboratory_pages` do."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs" / "measured").mkdir(parents=True)
    page = tmp_path / "docs" / "page.md"
    page.write_text(f"{BEGIN}{END}", encoding="utf-8")
    (tmp_path / "rows.csv").write_text("a\n1\n", encoding="utf-8")
    write_pages(["rows.csv"], [("docs/page.md", ("rows.csv",), lambda rows: f"sum {rows['a'].sum()}")])
    assert "sum 1" in page.read_text(encoding="utf-8")
