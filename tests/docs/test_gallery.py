"""The notebooks run, all in one process; the outputs kept in those of the gallery are those of their code."""

import math
import re
import shutil

import nbformat
import pytest

from tests.conftest import ROOT

NUMBER = re.compile(r"(?<![\w.])-?(?:\d+\.?\d*(?:e[+-]?\d+)?|NaN)(?![\w.])")
# scatter of short records between processors; a changed model or a changed cell moves more
SCATTER, ROUNDING = 0.1, 0.05


def run_cells(path):
    """Cells of code of a notebook, each after it has run."""
    namespace = {"__name__": "notebook"}
    code = [cell for cell in nbformat.read(path, as_version=4).cells if cell.cell_type == "code"]
    for number, cell in enumerate(code):
        exec(compile(cell.source, f"{path.name}[{number}]", "exec"), namespace)
        yield cell, namespace


def same(output, stored):
    """Whether two texts have the same words, and numbers as near as different processors give them."""
    if NUMBER.sub("#", output).split() != NUMBER.sub("#", stored).split():
        return False
    pairs = zip(*(map(float, NUMBER.findall(text)) for text in (output, stored)), strict=True)
    return all(math.isclose(*pair, rel_tol=SCATTER, abs_tol=ROUNDING) or all(map(math.isnan, pair)) for pair in pairs)


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((ROOT / "docs" / "gallery").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_gives_the_outputs_that_it_keeps(path, tmp_path, monkeypatch, pyplot, capsys):
    monkeypatch.chdir(tmp_path)
    for cell, _ in run_cells(path):
        output = capsys.readouterr().out
        kept = "".join(output.text for output in cell.outputs if output.output_type == "stream")
        assert same(output, kept), f"{output}\nkept:\n{kept}"
        assert len(pyplot.get_fignums()) == sum("image/png" in output.get("data", {}) for output in cell.outputs)
        pyplot.close("all")


def test_the_notebook_of_a_run_shows_it_and_keeps_no_outputs(tmp_path, monkeypatch, capsys):
    shutil.copytree(ROOT / "config", tmp_path / "config")
    monkeypatch.chdir(tmp_path)
    run = list(run_cells(ROOT / "docs" / "look_at_a_run.ipynb"))
    assert not [cell for cell, _ in run if cell.outputs or cell.execution_count]
    assert run[-1][1]["shown"]._repr_html_().startswith("<iframe srcdoc=")
    assert {file.name for file in tmp_path.iterdir()} == {"config", "run.html"}
    printed = capsys.readouterr().out
    assert "sprocket: pitches  0.0 to" in printed and "% of a turn" in printed
