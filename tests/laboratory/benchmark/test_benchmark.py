"""The benchmark for every code: what is committed, how an answer is scored, and the example of the page."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from laboratory.benchmark import score
from laboratory.benchmark.problems import FOLDER, NAMES, read_problem, read_reference, read_start
from trackdyn.errors import InputError

ROOT = Path(__file__).parents[3]
FIELD = ROOT / "benchmarks" / "field"
MAIN = "from trackdyn.commands.cli import main; main()"


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
def test_statements_are_those_of_the_rig_beside_them(models, name):
    """All but what settling finds: where the tensioning wheel is locked and how far the sprocket is turned."""
    said = read_problem(name)
    made = models.problem_of(name, models.scene_of(name).model, said.get("drive", {}).get("start_angle_rad"))
    if name != "free_chain":
        at = {"x_m": said["wheels"][-1]["x_m"], "y_m": said["wheels"][-1]["y_m"]}
        assert np.hypot(*(made["wheels"][-1][k] - at[k] for k in at)) <= models.load_rig(models.RIG).tension.travel
        made["wheels"][-1] |= at
    assert_alike(made, said)


def assert_alike(made, said):
    if isinstance(said, dict):
        assert made.keys() == said.keys()
        for key in said:
            assert_alike(made[key], said[key])
    elif isinstance(said, list):
        assert len(made) == len(said)
        for one, other in zip(made, said, strict=True):
            assert_alike(one, other)
    elif isinstance(said, float):
        assert made == pytest.approx(said, rel=1e-9, abs=1e-12)  # processors may differ in the last digits
    else:
        assert made == said


@pytest.mark.parametrize("name", NAMES)
def test_a_statement_holds_all_that_the_model_needs(models, name):
    """The model of the JSON alone is that of the scene, array by array, but for the tensioning wheel."""
    scene = models.scene_of(name)
    wanted, found = scene.model, models.model_of(read_problem(name), "semi_implicit", scene.step)
    parts = ["chain", "shoes", "closure"] + ["drive"] * (name != "free_chain") + ["tooth"] * (name == "teeth")
    for part in parts:
        for field, value in getattr(wanted, part)._asdict().items():
            if value is None or (part == "closure" and field != "compliant"):
                continue  # of a cut that is compliant, which none is
            np.testing.assert_allclose(
                getattr(getattr(found, part), field), value, rtol=1e-9, atol=1e-12, err_msg=field
            )
    if name == "free_chain":
        return
    for field in ("present", "inertia", "drag", "wheel_law", *(["radius", "ring_law"] if name == "ring" else [])):
        one, other = (np.asarray(getattr(model.wheels, field), float) for model in (found, wanted))
        first = 1 if field in ("inertia", "drag") else 0  # the sprocket's motion is prescribed
        np.testing.assert_allclose(one[first:], other[first:], rtol=1e-9, err_msg=field)


@pytest.mark.parametrize("name", NAMES)
def test_initial_states_close_and_start_as_stated(models, name):
    start, chain = read_start(name), models.chain_of(read_problem(name))
    along = np.column_stack([np.cos(start[:, 3]), np.sin(start[:, 3])]) * chain.length[:, None] / 2
    turned = np.column_stack([-along[:, 1], along[:, 0]]) * start[:, 6:]
    for values, arm in ((start[:, 1:3], along), (start[:, 4:6], turned)):
        np.testing.assert_allclose(values + arm, np.roll(values - arm, -1, axis=0), atol=1e-12)
    assert start[0, 3] - start[-1, 3] == pytest.approx(2 * np.pi, abs=0.5)  # clockwise, one turn
    assert (start[:, 4:] != 0).any() == (name == "free_chain")


def test_references_are_small_and_their_bars_short():
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 2e6
    for name in NAMES:
        reference = read_reference(name)[0]
        for key, row in reference["statistics"].items():
            assert 0 < row["bar"] <= (1e-2 if "peak" in key else 1e-3), f"{name}: {key}"
        distances = reference["distances"]
        assert set(distances) == {"rk4", "semi_implicit", "exudyn"}
        for key, bar in reference["series"].items():
            assert bar == pytest.approx(max(way["series"][key] for way in distances.values()), rel=0.06)


# --- scoring --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_the_reference_itself_has_no_error(name):
    rows = {row.quantity: row for row in score.score(columns(name), None, name)}
    assert rows["place"].error == rows["acceleration"].error == rows["force"].error == 0.0
    for row in rows.values():  # statistics are those of all digits, the table has 13 places
        assert row.error <= 1e-7
    assert "rms_acceleration_m_s2" in rows


def test_an_error_is_relative_to_the_scatter_of_the_reference():
    found, asked = columns("ring"), read_problem("ring")["report"]
    place = score.series_of(found, asked)["place"]
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


def test_engagements_join_what_is_close_and_leave_out_what_is_cut():
    contacts = np.array(
        [
            [1, 1.0, 1.2, 10],
            [1, 1.25, 1.3, 30],
            [1, 1.5, 1.6, 20],
            [2, 0.5, 1.1, 99],
            [2, 1.7, 1.9, 5],
            [4, 1.8, 2.0, 7],
        ]
    )
    found = score.engagements(contacts, 0.8, 2.0)
    assert found == pytest.approx(
        {"left_contact_s": (0.25 + 0.1) / 2, "left_peak_n": 25.0, "right_contact_s": 0.2, "right_peak_n": 5.0}
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


def test_the_example_takes_part_from_an_empty_folder(tmp_path):
    """As the page says: two files of the problem, NumPy, a script; the package scores what it wrote."""

    def run(*arguments):
        done = subprocess.run(
            [sys.executable, *arguments], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    path = f"import sys; sys.path.insert(0, {str(ROOT)!r}); {MAIN}"
    run("-c", path, "benchmark", "problem", "free_chain")
    text = (FIELD / "naive.py").read_text(encoding="utf-8")
    (tmp_path / "naive.py").write_text(text, encoding="utf-8")
    imported = {line.split()[1] for line in text.splitlines() if line.startswith(("import", "from"))}
    assert imported - sys.stdlib_module_names == {"numpy"} and text.count("\n") < 120
    run("-I", "naive.py", "free_chain.json", "free_chain_start.csv", "answers.csv")
    said = run("-c", path, "benchmark", "score", "answers.csv", "--problem", "free_chain")
    errors = {
        words[0]: float(words[-1]) for line in said.splitlines() if (words := line.split()) and "invariant" in words
    }
    assert errors["gap_m"] < 1e-9 and errors["angular_momentum_n_m_s"] < 1e-9
    rows = {
        r.quantity: r.error
        for r in score.score(score.read_answer(tmp_path / "answers.csv", "free_chain"), None, "free_chain")
    }
    # order 4 at 1 ms: some 1e-8 of a turn; a term that is missing or a wrong sign makes 1e-3 and more
    assert max(rows["place"], rows["acceleration"], rows["force"]) < 1e-5
    assert "free_chain: error" in said and "in place" in said


def test_the_runner_solves_a_problem_by_its_files_alone(models, tmp_path):
    """Coarse, standard step; the error is that of the method's first order, far above the bar and below 1 %."""
    import run_trackdyn

    series, _ = run_trackdyn.answer("ring", "semi_implicit", 1e-4)
    found = score.read_answer(write(tmp_path / "a.csv", {k: np.asarray(v) for k, v in series.items()}), "ring")
    rows = {row.quantity: row for row in score.score(found, None, "ring")}
    assert rows["acceleration"].bar < rows["acceleration"].error < 1e-2
    assert rows["mean_idler_rad_s"].error < 1e-4
    assert rows["gap_m"].error < 1e-11


def test_no_way_through_impacts_halves_the_time():
    """What the page answers is what was measured: nothing has both mean peaks within 0.5 % at half the time."""
    import pandas as pd

    rows = pd.read_csv(ROOT / "docs/measured/benchmark_impacts.csv")
    enough = rows[rows[["left_error_pct", "right_error_pct"]].abs().max(axis=1) <= 0.5]
    plain = enough[enough["way"].isin(["semi_implicit", "rk4", "linearly_implicit", "adaptive"])]
    cheapest = plain.loc[plain["cpu_s"].idxmin()]
    assert (cheapest["way"], cheapest["step_s"]) == ("semi_implicit", 5e-5)  # as the page says
    assert enough["cpu_s"].min() > 0.5 * cheapest["cpu_s"]


def test_runners_load_and_a_code_that_is_missing_fails_by_name(models, monkeypatch):
    """No code runs here: one that is not installed has a row that says so."""
    import measure

    def missing(*_):
        raise InputError("exudyn is not installed")

    monkeypatch.setitem(measure.CODES, "exudyn", missing)
    (row,) = measure.measure("ring", {("exudyn", "generalized_alpha"): (1e-3,)})
    assert row["failure"] == "exudyn is not installed" and "error" not in row
