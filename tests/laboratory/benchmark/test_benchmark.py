"""The benchmark for every code: what is committed, how an answer is scored, and the example of the page."""

from pathlib import Path

import numpy as np
import pytest

from laboratory.benchmark import score
from laboratory.benchmark.problems import NAMES, read_problem, read_reference, read_start
from trackdyn.errors import InputError

ROOT = Path(__file__).parents[3]
FIELD = ROOT / "benchmarks" / "field"


@pytest.fixture
def models(monkeypatch):
    monkeypatch.syspath_prepend(str(FIELD))
    import models

    return models


def columns(name):
    table = read_reference(name)[1]
    return {key: table[key].copy() for key in table.dtype.names}


def write(path, found):
    path.write_text(
        "\n".join(
            [
                ",".join(found),
                *(",".join(map(repr, row)) for row in zip(*(v.tolist() for v in found.values()), strict=True)),
            ]
        )
    )
    return path


# --- what is committed ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_initial_states_close_and_start_as_stated(models, name):
    start, chain = read_start(name), models.chain_of(read_problem(name))
    along = np.column_stack([np.cos(start[:, 3]), np.sin(start[:, 3])]) * chain.length[:, None] / 2
    turned = np.column_stack([-along[:, 1], along[:, 0]]) * start[:, 6:]
    for values, arm in ((start[:, 1:3], along), (start[:, 4:6], turned)):
        np.testing.assert_allclose(values + arm, np.roll(values - arm, -1, axis=0), atol=1e-12)
    assert start[0, 3] - start[-1, 3] == pytest.approx(2 * np.pi, abs=0.5)  # clockwise, one turn
    assert (start[:, 4:] != 0).any() == (name == "free_chain")


# --- scoring --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_the_reference_itself_has_no_error(name):
    rows = {row.quantity: row for row in score.score(columns(name), None, name)}
    assert rows["place"].error == rows["acceleration"].error == rows["force"].error == 0.0
    for row in rows.values():  # statistics are those of all digits, the table has 13 places
        assert row.error <= 1e-7
    assert "rms_acceleration_m_s2" in rows


def test_an_error_is_relative_to_the_scatter_of_the_reference():
    found, report = columns("ring"), read_problem("ring")["report"]
    place = score.series_of(found, report)["place"]
    scatter = np.sqrt(place.var(axis=0).sum())
    found["x_m"] += 0.03 * scatter
    found["y_m"] -= 0.04 * scatter
    rows = {row.quantity: row.error for row in score.score(found, None, "ring")}
    assert rows["place"] == pytest.approx(0.05, rel=1e-9)
    assert rows["acceleration"] < 1e-6  # a shift is no acceleration
    found["force_x_n"] *= 1.01
    found["force_y_n"] *= 1.01
    assert {r.quantity: r.error for r in score.score(found, None, "ring")}["mean_force_n"] == pytest.approx(
        0.01, rel=1e-4
    )


def test_foreign_answers_end_in_a_sentence(tmp_path):
    good = columns("ring")

    def refused(change, match, problem="ring"):
        path = tmp_path / "answers.csv"
        change(path)
        with pytest.raises(InputError, match=match) as caught:
            score.read_answer(path, problem)
        assert str(caught.value).startswith(str(path))

    def without(name):
        return {key: value for key, value in good.items() if key != name}

    def with_value(name, line, value):
        changed = {key: value.copy() for key, value in good.items()}
        changed[name][line] = value
        return changed

    refused(
        lambda p: write(p, without("x_m")),
        "column x_m occurs 0 times; expected a header with time_s, x_m, y_m and any of",
    )
    refused(lambda p: write(p, good | {"speed": good["x_m"]}), "column 'speed' is unknown")
    refused(lambda p: write(p, without("force_y_n")), "force_x_n is given without force_y_n")
    refused(lambda p: write(p, good), "2001 rows; teeth needs 3001, every 0.001 s from 0 to 3 s", "teeth")
    refused(lambda p: write(p, with_value("time_s", 7, 0.0071)), "time_s in line 9 is 0.0071; 0.007 is accepted")
    refused(lambda p: write(p, with_value("y_m", 3, np.nan)), "y_m in line 5 is 'nan'; a finite number")
    refused(lambda p: p.write_text("time_s,x_m,y_m\n0,1\n"), "line 2 has 2 values; 3 are accepted")
    refused(lambda p: p.write_text("time_s;x_m;y_m\n0;1;2\n"), "column time_s occurs 0 times")
    refused(lambda p: p.write_bytes(b"\x89PNG\x0d\x0a\xff"), "cannot be read as UTF-8")
    refused(lambda p: p.write_text(""), "column time_s occurs 0 times")
    refused(lambda p: p.write_text('"' + write(p, good).read_text()), "is no CSV file .*quote may not be closed")
    for value in (1e154, -1e308):
        refused(lambda p, v=value: write(p, with_value("x_m", 3, v)), r"x_m in line 5 is '-?1e.*at most 1e\+12")
    for text in ("1_0", "\uff11", "0x1"):
        rows = write(tmp_path / "good.csv", good).read_text().splitlines()
        rows[5] = ",".join([rows[5].split(",")[0], text, *rows[5].split(",")[2:]])
        refused(lambda p, rows=rows: p.write_text("\n".join(rows), encoding="utf-8"), f"x_m in line 6 is '{text}'")
    path = tmp_path / "contacts.csv"
    path.write_text("arc,begin_s,end_s,peak_n\n1,0.1,0.2,5\n71,0.1,0.2,5\n")
    with pytest.raises(InputError, match="line 3 is invalid; expected arcs 1 to 70"):
        score.read_contacts(path, "teeth")
    path.write_text("arc,begin_s,end_s,peak_n\n3,1.0,1.2,5\n1,0.3,0.4,5\n3,0.9,1.1,5\n1,0.4,0.5,5\n")
    with pytest.raises(InputError, match="lines 4 and 2 are contacts of arc 3 that overlap"):
        score.read_contacts(path, "teeth")
    with pytest.raises(InputError, match="ring has no teeth"):
        score.read_contacts(path, "ring")
    with pytest.raises(InputError, match="problem 'tooth' does not exist; free_chain, ring, teeth"):
        read_problem("tooth")


# --- taking part ----------------------------------------------------------------------------------------


def test_the_runner_solves_a_problem_by_its_files_alone(models, tmp_path):
    """Coarse, standard step; the error is that of the method's first order, far above the bar and below 1 %."""
    import run_trackdyn

    series, _ = run_trackdyn.answer("ring", "semi_implicit", 1e-4)
    found = score.read_answer(write(tmp_path / "a.csv", {k: np.asarray(v) for k, v in series.items()}), "ring")
    rows = {row.quantity: row for row in score.score(found, None, "ring")}
    assert rows["acceleration"].bar < rows["acceleration"].error < 1e-2
    assert rows["mean_idler_rad_s"].error < 1e-4
    assert rows["gap_m"].error < 1e-11
