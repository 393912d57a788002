"""The article: what a run decided stands in its text, and nothing that it asks for may be missing."""

import re

import numpy as np
import pandas as pd
import pytest
from pypdf import PdfReader

from replication.report.article import COLUMNS, EXTREMES, article_values, write_article
from tests.conftest import ROOT
from trackdyn.inputs.errors import TrackdynError

MEASURED = ROOT / "docs" / "measured"
TEMPLATE = ROOT / "workflow" / "article" / "article.typ"
OF_TRACKS = [f"plausible_{name}" for name in ("sentences", "map", "draws", "mobilised", "tooth", "near")]
BLANK = '<svg xmlns="http://www.w3.org/2000/svg" width="90" height="60"><rect width="90" height="60"/></svg>'


@pytest.fixture(scope="module")
def values():
    read = {name: pd.read_csv(MEASURED / f"{name}.csv") for name in ("claims", "sentences", "parameters", "planner")}
    read |= {name: pd.read_csv(MEASURED / f"{name}.csv") for name in OF_TRACKS}
    read["numbers"] = pd.read_csv(MEASURED / "printed_numbers.csv")
    for name in ("table1", "table2", "table3", "table4"):
        read[name] = pd.DataFrame([dict.fromkeys(COLUMNS[name], 0.25)])
    read["table2"] = read["table2"].assign(code=["trackdyn"], chosen=["yes"])
    read["outcomes"] = pd.DataFrame([dict.fromkeys(EXTREMES, 7)])
    read["extremes"] = pd.DataFrame(
        [("step and speed", "100", step, value, 1e-4, 2.0) for step, value in ((1e-4, 1.0), (3e-4, np.inf))],
        columns=["family", "group", "at", "value", "expected", "bound"],
    )
    return article_values(read, "", 0.01)


@pytest.fixture
def article(tmp_path):
    """Text of the article that is made of values."""
    (tmp_path / "figures").mkdir()
    figures = ("fig01", "fig17_a", "fig18_a", "fig19", "fig21", "fig23_a", "fig24", "trade", "extremes_stability")
    for name in figures:
        (tmp_path / "figures" / f"{name}.svg").write_text(BLANK, encoding="utf-8")

    def made(values):
        pdf = tmp_path / "article.pdf"
        write_article(values, tmp_path / "article.json", TEMPLATE, tmp_path, pdf)
        pages = PdfReader(pdf).pages
        assert len(pages) <= 8
        text = " ".join(page.extract_text() for page in pages)
        return pdf.read_bytes(), " ".join(text.split())

    return made


def test_a_value_stands_in_the_text_and_makes_the_bytes(values, article):
    first, text = article(values)
    assert first == article(values)[0]
    assert (
        values["verdict"] in text
        and f"No step below {values['unstable_from']} times" in text
        and float(values["unstable_from"]) == 3.0
    )
    for name, cells, word in (
        ("radius", "a sentence of a test", "a sentence of a test"),
        ("table3", [["98765", *values["table3"][0][1:]]], "98765"),
        ("sentences", [["1", "the 24680th sentence", "met", "12", "–"]], "24680th"),
    ):
        assert word not in text and not re.search(r"\bC\d\d", text)
        assert word in article(values | {name: cells})[1]


@pytest.mark.parametrize("name", ["trade", "share", "sentences", "unstable_from"])
def test_a_missing_value_stops_the_build(values, article, name):
    with pytest.raises(TrackdynError, match="article"):
        article({key: value for key, value in values.items() if key != name})


def test_a_missing_figure_stops_the_build(values, article, tmp_path):
    (tmp_path / "figures" / "fig24.svg").unlink()
    with pytest.raises(TrackdynError, match="fig24"):
        article(values)


def test_a_missing_column_is_no_blank(values):
    assert set(values) >= set(COLUMNS)
    with pytest.raises(KeyError):
        article_values({"claims": pd.read_csv(MEASURED / "claims.csv").drop(columns="verdict")}, "", 0.01)
