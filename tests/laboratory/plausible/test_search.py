"""The search for a rig: what it makes small, where it begins and ends, and the file that it writes."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from laboratory.plausible.default_rig import rig_entries, rig_text, slip_entries
from laboratory.plausible.distances import FORMS, cost, statement_distances
from laboratory.plausible.draws import EQUAL_PITCH, drawn_rigs, scenes
from laboratory.plausible.rows import run_rig
from laboratory.plausible.search import Searching, free_unknowns
from laboratory.plausible.settings import load_plausible
from laboratory.plausible.study import judged_claims
from laboratory.plausible.verdicts import judge_rig
from replication.paper.claims import load_claims, load_sentences
from trackdyn.rig.rig import load_rig, outside_ranges, parameter_table
from trackdyn.sweeps.engine import DONE

CONFIG = load_plausible("config/plausible.yaml")
CLAIMS = "config/claims.yaml"
NAMED = {claim.name: claim for claim in load_claims(CLAIMS)}


def test_a_sentence_costs_nothing_when_shown_with_a_margin_and_one_far_away():
    both = [(NAMED["C17a"], 0.0), (NAMED["C17c"], 0.0)]  # two statements of one sentence
    assert cost(both) == 0
    assert cost([(claim, 1e6) for claim, _ in both]) == pytest.approx(1)
    lost = [cost([both[0], (NAMED["C17c"], size)]) for size in (0.0, 0.9, 1.1, 2.0, 5.0)]
    assert lost == sorted(lost) and lost[2] - lost[1] > 0.15


def test_distances_agree_with_the_verdicts_of_a_row_and_these_with_each_other():
    """A sentence is shown where all of its claims are."""
    small = CONFIG.model_copy(update={"radii_m": [0.303, 0.304, 0.305, 0.308, 0.313], "speeds_rpm": [115.0]})
    rig, claims = load_rig("parts"), judged_claims(CLAIMS)
    values = run_rig(rig.model_dump(), scenes(small), small.scene, small.row.model_dump())
    verdicts = judge_rig(small, {"state": DONE, "values": values}, rig, claims, load_sentences(CLAIMS))
    distances = {claim.name: size for claim, size in statement_distances(small, scenes(small), values, rig, claims)}
    exact = [name for name in distances if name in verdicts and name not in FORMS]
    assert len(exact) > 10 and any(distances[name] > 1 for name in exact)
    for name in exact:
        assert (distances[name] <= 1) == bool(verdicts[name]), name
    for name in FORMS:
        assert distances[name] >= 1 or verdicts[name], name
    for number in (7, 9, 10, 14):
        parts = [verdicts[claim.name] for claim in claims if claim.sentence == number]
        assert verdicts[str(number)] == min(parts)


def test_the_stored_search_began_where_the_configuration_says():
    rows = pd.read_csv("docs/measured/search_rows.csv")
    firsts = rows[rows["row"] == 1].set_index("start")
    assert set(firsts.index) == set(CONFIG.search.starts)
    for name, values in CONFIG.search.starts.items():
        assert firsts.loc[name, list(values)].tolist() == list(values.values())
        x = free_unknowns(CONFIG, CONFIG.search.scenario).position(values)
        assert np.all((np.array(x) >= 0) & (np.array(x) <= 1))
    (track,) = (track for track in drawn_rigs(CONFIG) if track[:2] == (32, CONFIG.search.scenario))
    ratios = {unknown.label: unknown.of for unknown in CONFIG.drawn_unknowns().unknowns}
    for label, value in CONFIG.search.starts["draw 32"].items():
        divisor = track.values[ratios[label]] if ratios.get(label) else 1.0
        assert value == pytest.approx(track.values[label] / divisor, rel=1e-6), label


def test_a_search_goes_down_ends_and_repeats_itself(monkeypatch):
    """On a bowl in place of runs."""
    monkeypatch.setattr(
        Searching, "costs", lambda self, unknowns, points: [(1 + float(np.sum((x - 0.6) ** 2)), 3) for x in points]
    )
    unknowns = free_unknowns(CONFIG, CONFIG.search.scenario)
    search = CONFIG.search.model_copy(update={"starts": {"here": unknowns.values(np.full(len(unknowns), 0.5))}})
    searching = Searching(CONFIG.model_copy(update={"search": search}), judged_claims(CLAIMS), 1, "unused")
    rows = searching.search("here")
    assert rows["cost"].min() < 1 + 0.2 * (rows["cost"].iloc[0] - 1)
    assert rows["ended"].iloc[-1] == "gains too little" and set(rows["ended"].iloc[:-1]) == {""}
    pd.testing.assert_frame_equal(rows, searching.search("here"))
    few = CONFIG.model_copy(update={"search": search.model_copy(update={"rows": 40})})
    short = Searching(few, judged_claims(CLAIMS), 1, "unused").search("here")
    assert len(short) <= 40 and short["ended"].iloc[-1] == "rows are spent"
    pd.testing.assert_frame_equal(short.drop(columns="ended"), rows.drop(columns="ended")[: len(short)])


def test_a_rig_file_has_the_values_their_ranges_and_names_what_is_outside(tmp_path):
    unknowns = free_unknowns(CONFIG, CONFIG.search.scenario)
    values = unknowns.values(np.full(len(unknowns), 0.4))
    entries = rig_entries(CONFIG, unknowns, values, "made here") | slip_entries(CONFIG)
    text = rig_text(Path(CONFIG.rig).read_text(encoding="utf-8"), entries, "a rig")
    (path := tmp_path / "rig.yaml").write_text(text, encoding="utf-8")
    rig, table = load_rig(path), parameter_table(path).set_index("name")
    for name, value in unknowns.changes(values).items():
        assert rig.value(name) == pytest.approx(value, rel=1e-5), name
    assert table.loc[EQUAL_PITCH, "source"].startswith("made here; range: ")
    r2, radius = table.loc["groove.r2"], rig.value("chain.connector_radius")
    assert [float(r2["low"]) / radius, float(r2["high"]) / radius] == pytest.approx([1.2, 3.0], rel=1e-4)
    assert rig.value("bushing.damping") / rig.value("bushing.stiffness") == pytest.approx(
        values["bushing.loss_factor"] / (2 * np.pi * 4.47), rel=1e-5
    )
    assert [sentence.split(" = ")[0] for sentence in outside_ranges(path)] == ["ring_contact.transition_velocity"]
    stated = next(line for line in text.splitlines() if line.startswith("# Outside"))
    assert "transition_velocity (1.25 for 0.01 to 0.15)" in stated
