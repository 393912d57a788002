"""The list of figures and tables: complete, captioned, each with a rule that exists."""

import re

import pytest

from tests.conftest import ROOT
from trackdyn_replication.paper.contents import OF_STUDIES, OWN, PAGE, PAPER, missing_items

EVERY = (*PAPER, *OWN, *OF_STUDIES)


def test_the_list_is_that_of_the_paper():
    assert [item.key for item in PAPER] == [f"fig{i:02d}" for i in range(1, 25)] + [f"table{i}" for i in range(1, 5)]
    assert len({item.title for item in EVERY}) == len({item.key for item in EVERY}) == len(EVERY)
    assert all(item.table == item.key.startswith("table") for item in PAPER)


def test_the_page_places_items_that_there_are_once_and_the_papers_in_its_order():
    placed = [key for part in (*PAGE["figures"].values(), *PAGE["sections"].values()) for key in part.get("items", ())]
    assert len({*placed}) == len(placed)
    assert {*placed, *PAGE["first"], *PAGE["below"].values()} <= {item.key for item in EVERY}
    figures = [key for key in placed if key.startswith("fig")]
    assert figures == sorted(figures) and {item.key for item in PAPER} <= {*placed}


def test_what_is_there_is_not_missing(tmp_path):
    assert missing_items(tmp_path) == list(PAPER)
    for name in ("figures/fig02.png", "figures/fig17_b.png", "figures/fig17_b.svg", "tables/table4.csv",
                 "figures/fig1.png"):  # fmt: skip
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert {item.key for item in {*PAPER} - {*missing_items(tmp_path)}} == {"fig02", "fig17", "table4"}


@pytest.mark.parametrize("item", EVERY, ids=lambda item: item.key)
def test_an_item_names_a_rule_and_has_a_caption(item):
    text = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "workflow" / "rules").glob("*.smk"))
    assert re.search(rf"^rule {item.rule}:", text, re.MULTILINE)
    assert item.caption(synthetic=True)
