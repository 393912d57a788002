"""The search for a rig: its residuals, its starts and ends, and the file that it writes."""

from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from laboratory.plausible.distances import MAXIMA, SHARES, TIMES, at_most, bounded, residuals
from laboratory.plausible.draws import EQUAL_PITCH, drawn_rigs
from laboratory.plausible.rows import scene_name
from laboratory.plausible.search import MARGIN, SEARCHED, Outcome, Searching, cost, linear_step, searched_unknowns
from laboratory.plausible.searched_rigs import default_rig, searched_rig
from laboratory.plausible.settings import load_plausible
from trackdyn.rig.rig import load_rig, outside_ranges, parameter_table
from trackdyn_replication.paper.claims import load_claims

CONFIG = load_plausible("config/plausible.yaml")
CLAIMS = {claim.name: claim for claim in load_claims("config/claims.yaml")}


def printed_values() -> dict[str, dict]:
    """Scenes of a search as the paper prints them."""
    values = {}
    for rpm, radii in CONFIG.search.radii_m.items():
        for ring in radii:
            growth = 1 + 0.22 * (rpm - 115) / 95
            left = 45.1 if ring is None else 30.0 if ring < 0.307 else 8.9 if ring == 0.308 else 10.0
            values[scene_name(rpm, ring)] = {
                "left_share_pct": left, "right_share_pct": 44.4 if ring is None else 5.0 if ring < 0.305 else 0.0,
                "ring_share_pct": 0.0 if ring is None else 49.2, "left_rms_n": 200 * growth, "left_sd_n": 150 * growth,
                "left_rms_contact_n": 900.0 if ring is None else 500.0,
                "ring_rms_n": 0.0 if ring is None else 3e5 * (ring - 0.3) * growth**0.85,
                "ring_sd_n": 0.0 if ring is None else 2e5 * (ring - 0.3) * growth**0.85,
                "rms_g": 0.3 + rpm / 1e3, "high_frequency_g": 0.1 + rpm / 1e3, "left_outside_pct": 0.0,
                "right_outside_pct": 0.0, "left_early_pct": 0.0, "event first left": 0.0, "event first right": 0.0,
                "event right gone": 1.29, "event out": 1.51 if ring else 1.31, "event left touches": 1.25,
                "event ring left": 1.43, "event left maximum, mean over 0.01 s": 1.42 if ring else 0.17,
                "event right maximum, mean over 0.01 s": 1.07, "event right maximum, peak 1 of like height": 0.5,
                "event ring maximum, mean over 0.01 s": 0.22,
            }  # fmt: skip
    values[scene_name(115, None)]["left_sd_n"] = 400.0
    return values


def test_printed_values_cost_nothing_and_each_number_pulls_at_any_distance():
    printed = residuals(CONFIG, printed_values())
    assert cost(printed) == 0
    for scene, column, name in (
        ("115 none", "left_share_pct", "no ring: left share"), ("115 0.308", "ring_share_pct", "ring: ring share"),
        ("115 none", "event out", "no ring: out"), ("210 0.305", "right_share_pct", "right: 210 0.305"),
    ):  # fmt: skip
        sizes, values = [], printed_values()
        for off in (1.95, 5.0, 50.0):  # the first within the tolerance of a share, beyond the margin
            values[scene] = printed_values()[scene] | {column: printed_values()[scene][column] + off}
            sizes.append(residuals(CONFIG, values)[name])
            assert cost(residuals(CONFIG, values)) > 0
        assert sizes == sorted(sizes) and sizes[0] > 0
    missing = printed_values()
    missing["115 none"]["event out"] = None
    assert residuals(CONFIG, missing)["no ring: out"] == 10.0


def test_a_residual_of_one_is_at_the_bound():
    assert bounded(0.065, 0.065) == pytest.approx(1) and bounded(-2.0, 2.0) == pytest.approx(-1)
    assert bounded(20.0, 2.0) == pytest.approx(np.arcsinh(10) / np.arcsinh(1))
    assert at_most(0.5, 0.5, 0.5) == pytest.approx(1) and at_most(0.0, 0.5, 0.5) == 0 and at_most(1.0, 0.5, 0.5) > 1


def test_a_step_gives_up_a_number_that_excludes_two_others():
    """Three numbers that one coordinate decides, of which two ask for more and one for less."""
    residual = {"a": 3.0, "b": 3.0, "c": 0.0}
    jacobian = np.array([[-30.0, 0.0], [-30.0, 0.0], [30.0, 0.0]])
    step = linear_step(np.array([0.5, 0.5]), residual, jacobian, 0.2)
    assert step == pytest.approx([0.5 + (3 - MARGIN) / 30, 0.5])
    assert linear_step(np.array([0.5, 0.5]), residual, jacobian, 0.01) == pytest.approx([0.51, 0.5])


def test_targets_are_those_of_the_claims():
    for names, targets in (
        ("C16d", TIMES[False]), ("C17a C17d", TIMES[True]), ("C27a C27b", SHARES[False]), ("C28a C28b", SHARES[True]),
        ("C16b C16c", MAXIMA[False]), ("C17b C17c", MAXIMA[True]),
    ):  # fmt: skip
        assert np.hstack([CLAIMS[name].printed for name in names.split()]).tolist() == list(targets.values())


@pytest.mark.parametrize("name", CONFIG.search.searches)
def test_a_search_goes_down_and_repeats_itself(name, monkeypatch):
    """On a bowl in place of runs, of which one point does not run."""

    def outcome(x):
        return None if x[3] > 0.95 else Outcome({str(i): size for i, size in enumerate(8 * (x - 0.6))}, 3, 2)

    monkeypatch.setattr(Searching, "outcomes", lambda self, unknowns, points: [outcome(x) for x in points])
    short = CONFIG.model_copy(update={"search": CONFIG.search.model_copy(update={"rows": 150})})
    searching = Searching(short, "config/claims.yaml", 1, "unused")
    rows = searching.search(name)
    assert rows["cost"].min() < 0.05 * rows["cost"].iloc[0] and rows["row"].tolist() == list(range(1, len(rows) + 1))
    pd.testing.assert_frame_equal(rows, searching.search(name))


@pytest.mark.parametrize("name", CONFIG.search.searches)
def test_a_rig_file_has_values_and_ranges_and_names_those_outside(name, tmp_path):
    unknowns = searched_unknowns(CONFIG, name)
    values = unknowns.values(np.full(len(unknowns.labels), 0.4))
    # most numbers, then most sentences, then the least cost
    ends = [("draw 155", 3.0, 20, 9, 0.42), ("draw 241", 9.0, 21, 9, 0.4), (SEARCHED, 8.0, 21, 8, 0.6),
            (SEARCHED, 10.0, 21, 9, 0.38)]  # fmt: skip
    rows = pd.DataFrame([
        {"search": name, "row": row, "begin": begin, "cost": cost, "numbers": numbers, "sentences": sentences}
        | unknowns.values(np.full(len(unknowns.labels), at))
        for row, (begin, cost, numbers, sentences, at) in enumerate(ends, 1)
    ])  # fmt: skip
    (path := tmp_path / "rig.yaml").write_text(searched_rig(CONFIG, rows, name), encoding="utf-8")
    rig, table = load_rig(path), parameter_table(path).set_index("name")
    for field, value in unknowns.changes(values).items():
        assert rig.value(field) == pytest.approx(value, rel=1e-5), field
    pitch = table.loc[EQUAL_PITCH]
    assert pitch["source"].startswith("draw 241 of the sample, fitted to nothing") and pitch["kind"] == "assumed"
    searched = searched_rig(CONFIG, rows.assign(numbers=[20, 21, 21, 22]), name)
    source = f'"{SEARCHED}, row 4 of the search {name}, which began at draw 241'
    assert source in searched and "kind: fitted" in searched
    r2 = table.loc["groove.r2", ["low", "high"]].astype(float) / rig.value("chain.connector_radius")
    assert r2.tolist() == pytest.approx([1.2, 3.0], rel=1e-4)
    loss = rig.value("bushing.damping") / rig.value("bushing.stiffness")
    assert loss == pytest.approx(values["bushing.loss_factor"] / (2 * np.pi * 4.47), rel=1e-5)
    stated = next(line for line in Path(path).read_text(encoding="utf-8").splitlines() if line.startswith("# Outside"))
    for sentence in outside_ranges(path):
        assert sentence.split(" = ")[0] in stated
    assert ("ring_contact.transition_velocity" in stated) == (name == "slips")
    assert rig.ring_contact.friction_law == ("dahl" if name == "shears" else "regularised")


def test_a_search_begins_at_draws_of_the_sample_and_scans_them():
    unknowns = searched_unknowns(CONFIG, "slips")
    starts = list(Searching(CONFIG, "config/claims.yaml", 1, "unused").starts("slips", unknowns))
    scanned = int(np.prod([len(values) for values in CONFIG.search.scan.values()]))
    assert len(starts) == len(CONFIG.search.draws) * (1 + scanned)
    assert [begin for begin, _ in starts[:3]] == [f"draw {draw}" for draw in CONFIG.search.draws]
    drawn, values = next(islice(drawn_rigs(CONFIG), 155, None)), unknowns.values(starts[0][1])
    fields = unknowns.changes(values)
    same = [name for name in drawn.values if name not in CONFIG.search.searches["slips"].fields]
    assert [fields[name] for name in same] == pytest.approx([drawn.values[name] for name in same], rel=0.02)
    tensions = {round(unknowns.values(x)["tension.pre_tension"], 6) for begin, x in starts if "scanned" in begin}
    assert tensions == set(CONFIG.search.scan["tension.pre_tension"])


def test_the_default_rig_is_a_draw_of_the_sample():
    assert default_rig(CONFIG) == Path("trackdyn/rigs/paper.yaml").read_text(encoding="utf-8")
    drawn = next(islice(drawn_rigs(CONFIG), CONFIG.default_draw, None))
    rig, ring = load_rig("paper"), "ring_contact.transition_velocity"
    fields = [name for name in drawn.values if name not in CONFIG.search.searches["slips"].fields]
    assert [rig.value(name) for name in fields] == pytest.approx([drawn.rig.value(name) for name in fields], rel=1e-5)
    assert rig.value(ring) == pytest.approx(drawn.values[ring], rel=1e-5)
