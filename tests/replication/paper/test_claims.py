"""The scorecard: rules, verdicts, counts, refusals; each claim fails on evidence that must fail it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import yaml

from tests import conftest
from trackdyn.rig.rig import load_rig
from trackdyn_replication.paper import claims, scorecard
from trackdyn_replication.paper.claims import MET, NOT_COMPARABLE, NOT_MET, judge, printed_numbers
from trackdyn_replication.paper.evidence import Evidence
from trackdyn_replication.paper.measures import MEASURES
from trackdyn_replication.paper.published import CELLS, DIFFERENCES, load_cells
from trackdyn_replication.paper.tracks import learned_sentences, neighbours_sentence, ring_sentences

CONFIG = conftest.ROOT / "config"
CLAIMS = {claim.name: claim for claim in claims.load_claims(CONFIG / "claims.yaml")}
SENTENCES = claims.load_sentences(CONFIG / "claims.yaml")
EVERY = list(CLAIMS.values())
TESTS = [name for name, claim in CLAIMS.items() if claim.rule not in ("no_test", "not_comparable")]
SPEEDS = [115.0, 150.0, 180.0, 210.0]
RADII = [0.303, 0.304, 0.305, 0.307, 0.308, 0.313]
RIG = load_rig(conftest.RIG)
MEAN, AFTER = ", mean over 0.01 s", ", after the touch"
RECORDS, RING, NO_RING = r"[\d.]+rpm", "meshing/ring", "meshing/no_ring"


def invented() -> pd.DataFrame:
    """The article's Table 3, invented: its simulation within 1 % of `good`, its experiment as far off as it prints."""
    cells = pd.DataFrame(index=SPEEDS, columns=CELLS, dtype=float)
    for name, base in (("rms", 0.9), ("sd", 0.8)):
        cells[f"{name}_simulation_g"] = 0.995 * (base + 0.1 * np.arange(len(SPEEDS)))
        cells[f"{name}_experiment_g"] = cells[f"{name}_simulation_g"] / (1 - pd.Series(DIFFERENCES[name]) / 100)
    return cells


def good() -> Evidence:
    """Evidence by which every claim comes out."""
    rows = []
    lines = dict(zip(SPEEDS, ([0.122, 0.793], [0.167, 1.174], [0.2, 1.167], [0.233, 1.162]), strict=True))
    for i, rpm in enumerate(SPEEDS):
        rows.append({"run": f"{rpm:g}rpm", "rpm": rpm, "rms_g": 0.9 + 0.1 * i, "sd_g": 0.8 + 0.1 * i,
                     "line_hz": lines[rpm][0], "line_g": lines[rpm][1], "line_hz_binfree": lines[rpm][0],
                     "high_frequency_g": 0.1 + 0.1 * i, "loop_gap_max_m": 1e-13, "gap_before_projection_m": 1e-11,
                     "velocity_gap_m_s": 1e-5})  # fmt: skip
        rows.append({"run": f"coarse/{rpm:g}rpm", "rpm": rpm, "rms_g": 0.99 * (0.9 + 0.1 * i)})
        for j, radius in enumerate(RADII):
            left, ring = (199 if radius == 0.308 else 200) * (1 + 0.08 * i), 500 * 1.25**j * (1 + 0.06 * i)
            rows.append({"run": f"ring/{rpm:g}rpm_{radius}", "rpm": rpm, "ring_radius_m": radius,
                         "left_share_pct": 30.0 if radius < 0.307 else 11.9 if radius < 0.308 else 9.0,
                         "right_share_pct": 20.0 if radius < 0.305 else 0.0, "left_rms_n": left, "left_sd_n": left,
                         "left_peak_n": 3900.0 if radius < 0.308 else 2000.0, "right_peak_n": 100.0,
                         "ring_rms_n": ring, "ring_sd_n": ring, "ring_share_pct": 45.0})  # fmt: skip
        rows.append({"run": f"ring/{rpm:g}rpm_none", "rpm": rpm, "left_share_pct": 45.0, "left_peak_n": 1000.0,
                     "right_peak_n": 7000.0})  # fmt: skip
    rows.append({"run": NO_RING, "rpm": 115.0, "left_areas": "2", "right_areas": "7", "left_share_pct": 45.0,
                 "right_share_pct": 44.0, "left_peak_n": 1500.0, "left_rms_n": 450.0, "left_rms_contact_n": 670.0,
                 "left_sd_n": 400.0, "right_sd_n": 300.0})  # fmt: skip
    rows.append({"run": RING, "rpm": 115.0, "left_areas": "2", "right_areas": "none", "left_share_pct": 8.9,
                 "left_rms_n": 170.0, "left_peak_n": 1000.0, "left_rms_contact_n": 560.0, "left_sd_n": 160.0,
                 "right_rms_n": 0.0, "right_sd_n": 0.0, "ring_rms_n": 1000.0, "ring_sd_n": 300.0,
                 "ring_share_pct": 49.2})  # fmt: skip
    times = {
        NO_RING: {"first left": 0.0, "first right": 0.0, "left maximum": 0.17, "right maximum": 1.07,
                  "right gone": 1.29, "out": 1.31},
        RING: {"ring maximum": 0.22, "left touches": 1.25, "left maximum": 1.42, "ring left": 1.43, "out": 1.51},
    }  # fmt: skip
    readings = [(run, event + how, at) for run, at_events in times.items() for event, at in at_events.items()
                for how in (("", MEAN, AFTER) if event.endswith("maximum") else ("",))]  # fmt: skip
    events = pd.DataFrame(readings, columns=["run", "event", "median_s"])
    areas = pd.cut(events["event"].str.contains("right"), [-1, 0, 1], labels=[2, 7]).astype(float)
    return Evidence(
        metrics=pd.DataFrame(rows),
        events=events.assign(sd_s=0.005, area=areas.where(events["event"].str.contains("maximum"))),
        rig=RIG,
        rpm=115.0,
        starts=pd.DataFrame([{"rpm": rpm, "line_hz": hz, "line_g": g} for rpm, (hz, g) in lines.items()] * 4),
        peer=pd.DataFrame({"speed_rpm": 180.0, "difference_pct": [0.01], "difference_belt_pct": [5.0]}),
        cells=invented(),
    )


def changed(e: Evidence, column: str, value, run: str = r".*", rpm=None, radius=None) -> Evidence:
    """Evidence with another value in some runs of the metrics."""
    metrics = e.metrics.copy()
    where = metrics["run"].str.fullmatch(run)
    where &= metrics["rpm"].isin(rpm) if rpm else True
    where &= metrics["ring_radius_m"].isin(radius) if radius else True
    assert where.any()
    metrics.loc[where, column] = value
    return replace(e, metrics=metrics)


def later(e: Evidence, event: str, value: float, run: str = NO_RING, column: str = "median_s") -> Evidence:
    """Evidence in which an event comes at another time, or has another value."""
    where = (e.events["run"] == run) & (e.events["event"] == event)
    assert where.any()
    return replace(e, events=e.events.assign(**{column: e.events[column].where(~where, value)}))


def experiment(e: Evidence, name: str, factor: float) -> Evidence:
    """Evidence beside an experiment of another size at 150 rpm."""
    factors = pd.Series({150.0: factor}).reindex(SPEEDS, fill_value=1.0)
    return replace(e, cells=e.cells.assign(**{f"{name}_g": factors * e.cells[f"{name}_g"]}))


# Evidence that must fail each claim: the least change that its `fails_if` names.
SPOILT = {
    "C02a": lambda e: replace(e, peer=e.peer.assign(difference_pct=6.1)),
    "C04a": lambda e: experiment(e, "rms_experiment", 1.02),
    "C04b": lambda e: experiment(e, "rms_experiment", 1.2),
    "C04c": lambda e: experiment(e, "rms_simulation", 0.98),
    "C05a": lambda e: experiment(e, "sd_experiment", 1.02),
    "C05b": lambda e: experiment(e, "sd_experiment", 1.2),
    "C05c": lambda e: experiment(e, "sd_simulation", 1.05),
    "C06a": lambda e: changed(e, "rms_g", 0.88, RECORDS, [150.0]),
    "C06b": lambda e: changed(e, "sd_g", 1.13, RECORDS, [180.0]),
    "C08": lambda e: replace(e, starts=e.starts.assign(line_g=e.starts["line_g"].replace(0.793, 0.76))),
    "C12a": lambda e: changed(e, "high_frequency_g", 0.31, RECORDS, [150.0]),
    "C12b": lambda e: changed(e, "high_frequency_g", 0.35, RECORDS, [115.0, 150.0, 180.0]),
    "C15": lambda e: changed(e, "right_areas", "7,9", NO_RING),
    "C16a": lambda e: later(e, "first left", 0.02),
    "C16b": lambda e: later(e, "left maximum" + MEAN, 0.33),
    "C16c": lambda e: later(e, "right maximum" + MEAN, 0.9),
    "C16d": lambda e: later(e, "out", 1.47),
    "C16e": lambda e: later(e, "right maximum" + MEAN, 8, column="area"),
    "C16f": lambda e: later(e, "right gone", 1.305),
    "C16g": lambda e: later(e, "first right", 0.07),
    "C17a": lambda e: later(e, "left touches", 1.41, RING),
    "C17b": lambda e: later(e, "ring maximum" + MEAN, 0.29, RING),
    "C17c": lambda e: later(e, "left maximum" + MEAN, 1.35, RING),
    "C17d": lambda e: later(e, "ring left", 1.5, RING),
    "C18": lambda e: changed(e, "right_areas", "7", RING),
    "C19a": lambda e: changed(e, "left_share_pct", 38.5, RING),
    "C19b": lambda e: changed(e, "left_rms_n", 390.0, RING),
    "C19c": lambda e: changed(e, "left_rms_contact_n", 580.0, RING),
    "C20a": lambda e: changed(e, "left_rms_n", 2000.0, RING),
    "C20b": lambda e: changed(changed(e, ["ring_sd_n", "left_rms_n"], 410.0, RING), "left_sd_n", 405.0, RING),
    "C21a": lambda e: changed(e, "left_rms_n", 236.0, "ring/.*", [150.0]),  # falls by 1.7 % from there to 180 rpm
    "C21b": lambda e: changed(e, "ring_rms_n", 900.0, "ring/.*", [210.0]),
    "C21c": lambda e: changed(e, "ring_sd_n", 4000.0, "ring/.*", [210.0]),
    "C21d": lambda e: changed(e, "left_rms_n", 265.0, "ring/.*", [210.0]),
    "C21e": lambda e: changed(e, "left_sd_n", 228.0, "ring/.*", [150.0, 180.0, 210.0]),  # rises, by 14 % in all
    "C21f": lambda e: changed(e, "ring_sd_n", 900.0, "ring/.*", [210.0]),
    "C22a": lambda e: changed(e, "ring_rms_n", 504.0, "ring/.*", [150.0], [0.304]),
    "C22b": lambda e: changed(e, "ring_sd_n", 710.0, "ring/.*", [150.0], [0.303]),
    "C22c": lambda e: changed(e, "ring_rms_n", 770.0, "ring/.*", [180.0], [0.313]),
    "C23a": lambda e: changed(e, "right_share_pct", 0.6, "ring/.*", [210.0], [0.313]),
    "C23b": lambda e: changed(e, "right_share_pct", 0.4, "ring/.*", [180.0], [0.304]),
    "C24a": lambda e: changed(e, "left_rms_n", 270.0, "ring/.*", [115.0], [0.303]),
    "C24b": lambda e: changed(e, "left_rms_n", 270.0, "ring/.*", [115.0], [0.305]),
    "C25": lambda e: changed(e, "left_share_pct", 4.9, "ring/.*", [180.0], [0.313]),
    "C26a": lambda e: changed(e, "right_peak_n", 3600.0, "ring/.*", [210.0], [0.308]),
    "C27a": lambda e: changed(e, "left_share_pct", 43.0, NO_RING),
    "C27b": lambda e: changed(e, "right_share_pct", 25.4, NO_RING),
    "C28a": lambda e: changed(e, "ring_share_pct", 44.1, RING),
    "C28b": lambda e: changed(e, "left_share_pct", 14.0, RING),
}  # fmt: skip


def test_all_28_claims_are_there_in_order_and_every_part_says_what_would_have_failed_it():
    assert set(SPOILT) == set(TESTS)
    assert list(dict.fromkeys(claim.id for claim in CLAIMS.values())) == [f"C{i:02d}" for i in range(1, 29)]
    for claim in CLAIMS.values():
        parts = [other.part for other in CLAIMS.values() if other.id == claim.id]
        assert parts == ([""] if len(parts) == 1 else list("abcdefgh"[: len(parts)]))
        assert (claim.rule == "not_comparable") or claim.fails_if
        assert claim.fails_if.startswith("nothing") == (claim.rule == "no_test")


def test_one_cell_that_lacks_is_named_and_statements_that_wait_for_cells_are_one_line():
    cells = invented()
    cells.loc[150.0, "rms_experiment_g"] = np.nan
    judgement = judge(CLAIMS["C04a"], replace(good(), cells=cells))[:2]
    assert judgement == ("Table 3 is not filled in: rms_experiment_g at 150 rpm", NOT_COMPARABLE)
    card = claims.judge_all(EVERY, replace(good(), cells=load_cells(CONFIG / "article.csv")), "mine")
    names = "C03, C04a, C04b, C04c, C05a, C05b, C05c, C13a, C13c"
    assert scorecard.waiting_sentence(card).startswith(f"9 statements ({names}) wait for cells of Tables 2 to 4")
    listed = scorecard.statements_by_label(card, scorecard.sentence_verdicts(card, SENTENCES), {})
    ids = {row["id"] for sentences in listed.values() for one in sentences for row in one["statements"]}
    assert ids == {*CLAIMS} - {*names.split(", ")}


def cells_file(tmp_path, **cells):
    """A file of the article's cells: `invented`, with others at 180 rpm."""
    path, text = tmp_path / "article.csv", invented().astype(object).rename_axis("rpm")
    text.loc[180.0, [*cells]] = [*cells.values()]
    text.set_axis([115, 150, 180, 210]).to_csv(path, index_label="rpm")
    return path


@pytest.mark.parametrize(("cells", "words"), [
    ({"mean_g": 1.0}, "its cells are not those of config/article.csv"),
    ({"rms_simulation_g": 0}, "180 rpm, rms_simulation_g = '0': must be a number above 0"),
    ({"rms_simulation_g": "nan"}, "must be a number above 0"),
    ({"rms_simulation_g": "1;1"}, "must be a number above 0"),
    ({"sd_simulation_g": 1.0, "sd_experiment_g": 1.2},
     "180 rpm, sd_simulation_g and sd_experiment_g differ by 16.7 %; printed is 12.09 %"),
])  # fmt: skip
def test_cells_are_read_as_they_are_filled_in_and_refused_where_they_cannot_be(tmp_path, cells, words):
    pd.testing.assert_frame_equal(load_cells(cells_file(tmp_path)), invented(), check_names=False)
    path = cells_file(tmp_path, **cells)
    conftest.refused(load_cells, path, words=[words], start=f"{path}: ")


@pytest.mark.parametrize("name", TESTS)
def test_every_claim_comes_out_by_good_evidence_and_fails_by_bad(name):
    assert judge(CLAIMS[name], good()).verdict == MET
    assert judge(CLAIMS[name], SPOILT[name](good())).verdict == NOT_MET


@pytest.mark.parametrize("name", TESTS)
def test_a_nan_is_never_a_success(name):
    """All values are lost, then those of two rings, which fails claims about all of them."""
    e = good()
    numbers = e.metrics.select_dtypes("number").columns.difference(["rpm", "ring_radius_m"])
    lost = replace(
        changed(e, [*numbers, "right_areas"], np.nan),
        events=e.events.assign(median_s=np.nan, area=np.nan),
        starts=e.starts.assign(line_hz=np.nan, line_g=np.nan),
        peer=e.peer.assign(difference_pct=np.nan),
    )
    assert judge(CLAIMS[name], lost).verdict in (NOT_MET, NOT_COMPARABLE)
    if name[:3] in ("C21", "C22", "C24", "C25") or name == "C23a":
        assert judge(CLAIMS[name], changed(e, numbers, np.nan, "ring/.*", None, [0.308, 0.313])).verdict == NOT_MET


def test_what_was_not_run_or_not_recorded_is_not_comparable():
    metrics = good().metrics.drop(columns=["gap_before_projection_m", "velocity_gap_m_s"])
    e = replace(good(), peer=pd.DataFrame(), metrics=metrics[~metrics["run"].str.startswith("coarse/")])
    assert judge(CLAIMS["C02a"], e)[:3] == ("not run", NOT_COMPARABLE, [])
    assert judge(CLAIMS["C01b"], e)[:2] == judge(CLAIMS["C01c"], e)[:2] == ("not recorded", NOT_COMPARABLE)
    assert judge(CLAIMS["C13b"], e)[:3] == ("not run", NOT_COMPARABLE, SPEEDS)


def test_a_study_that_lacks_speeds_or_radii_shows_nothing_rather_than_success():
    e = good()
    slowest = replace(e, metrics=e.metrics[e.metrics["rpm"] == 115.0], starts=e.starts.iloc[:0])
    single = replace(e, metrics=e.metrics[~(e.metrics["ring_radius_m"] > 0.303) | e.metrics["ring_radius_m"].isna()])
    for name in ("C06a", "C12a", "C08", "C21a", "C21b", "C21c", "C21d", "C21e", "C21f"):
        assert judge(CLAIMS[name], slowest).verdict == NOT_COMPARABLE
    assert judge(CLAIMS["C06a"], slowest).measured == judge(CLAIMS["C12a"], slowest).measured == "one speed alone"
    three = replace(e, metrics=e.metrics[~e.metrics["ring_radius_m"].isin([0.304, 0.305, 0.307])])
    for name in ("C21a", "C21d", "C22a", "C22b", "C22c", "C23a", "C23b", "C24a", "C25", "C26a", "C26b"):
        assert judge(CLAIMS[name], single).verdict == NOT_COMPARABLE
        assert judge(CLAIMS[name], three)[:2] == ("radii at 115 rpm: 3, and 5 are needed", NOT_COMPARABLE)


@pytest.mark.parametrize("name", [name for name in TESTS if MEASURES[CLAIMS[name].measure].events])
def test_times_that_scatter_beyond_the_tolerance_are_not_judged(name):
    """At the mean of two humps nothing happens; the median passage is judged."""
    run, *events = MEASURES[CLAIMS[name].measure].events
    tolerance = CLAIMS[name].tolerance
    for scattering in events:
        for factor, verdict in ((0.99, MET), (1.01, NOT_COMPARABLE if tolerance else MET)):
            e = later(good(), scattering, factor * (tolerance or 1.0), f"meshing/{run}", "sd_s")
            judged = judge(CLAIMS[name], replace(e, events=e.events.assign(mean_s=99.0)))
            assert judged.verdict == verdict and (verdict == MET or scattering in judged.measured)


def test_a_ring_that_bears_nothing_shows_neither_growth_nor_influence():
    e = good()
    for columns in (["ring_rms_n", "ring_sd_n"], ["left_rms_n", "left_sd_n"]):
        nothing = changed(e, columns, 0.0, "ring/.*")
        for name in ("C22a", "C22b", "C22c") if "ring_rms_n" in columns else ("C21a", "C24a"):
            assert judge(CLAIMS[name], nothing)[:2] == ("no force acts", NOT_COMPARABLE)
    # at one radius alone: the others are judged
    let_go = changed(e, ["left_rms_n", "left_sd_n"], 0.0, "ring/.*", None, [0.313])
    assert {judge(CLAIMS[name], let_go).verdict for name in ("C21a", "C21c", "C21d", "C21e")} == {MET}
    assert judge(CLAIMS["C21a"], SPOILT["C21a"](let_go)).verdict == NOT_MET
    free = changed(e, ["ring_rms_n", "ring_sd_n"], 0.0, "ring/.*", None, [0.303, 0.304])
    assert judge(CLAIMS["C22a"], free).verdict == MET
    idle = changed(e, "ring_share_pct", 0.0, "ring/.*", [150.0], [0.303])
    for name in ("C20b", "C21d", "C24a", "C24b"):
        assert judge(CLAIMS[name], idle)[:2] == ("a ring of 0.303 m carries nothing at 150 rpm", NOT_COMPARABLE)
    # that a force ends with the speed is no growth
    ends = changed(e, ["left_rms_n", "left_sd_n"], 0.0, "ring/.*", [210.0])
    assert judge(CLAIMS["C21a"], ends).verdict == NOT_MET


def test_a_sentence_is_judged_whole_and_counted_once():
    for evidence, shown in ((good(), 21), (SPOILT["C20b"](SPOILT["C23a"](good())), 19)):
        card = claims.judge_all(EVERY, evidence, "mine")
        assert tuple(card.columns) == claims.COLUMNS and len(card) == len(CLAIMS)
        assert card["verdict"].isin(claims.JUDGED).sum() == len(TESTS)
        judged = scorecard.sentence_verdicts(card, SENTENCES)
        assert judged["number"].tolist() == list(SENTENCES) and scorecard.count(judged) == (shown, 21)
    numbers = printed_numbers(EVERY, evidence)
    line = "13 of 14 independent printed numbers, 19 of 21 sentences and 3 of 4 conclusions (no. 1, 2 and 4)"
    assert scorecard.verdict_line(judged, numbers) == line
    failed = {row["number"]: [one["id"] for one in row["statements"]] for row in scorecard.failed_rows(card, judged)}
    assert failed == {15: ["C20b"], 19: ["C23a"]}
    lost = judged[judged["verdict"] == NOT_MET].set_index("number")
    assert lost["sentence"].to_dict() == {number: SENTENCES[number] for number in (15, 19)}
    assert lost["statements"][19] == "C23a"


def test_conclusions_are_tabulated_by_sentence_with_another_rig_and_the_tracks():
    cards = (claims.judge_all(EVERY, evidence, "mine") for evidence in (good(), SPOILT["C23a"](good())))
    judged = (scorecard.sentence_verdicts(card, SENTENCES) for card in cards)
    rows = scorecard.conclusion_table(*judged, of_tracks()["sentences"])
    assert rows.iloc[:, 0].str[0].tolist() == ["1", "1", "2", "3", "4"]
    third = rows[rows.iloc[:, 0].str.startswith("3. from 0.305 m on the right arc does not touch")]
    assert third.iloc[0, 1:].tolist() == ["●", "○", "0", "33"]
    assert (rows.drop(third.index)["rig with rubber's friction"] == "●").all()


@pytest.mark.parametrize(("field", "value", "words"), [
    ("measure", "no_such", ["C01a", "measure = 'no_such' is not a measure", "measures.py has them all"]),
    ("measure", "gap_after_projektion", ["C01a", "did you mean 'gap_after_projection'?"]),
    ("reason", ..., ["reason is missing"]), ("rule", "equal", ["C01a", "tolerance is missing"]),
    ("fails_if", ..., ["C01a", "fails_if is missing"]), ("part", "b", ["C01b occurs twice"]),
    ("numbers", 2, ["C01a", "number_names has 0 names for 2 numbers"]),
    ("number_names", ["one"], ["C01a", "number_names has 1 names for 0 numbers"]),
    ("numbers", 1, ["C01a", "group = '' for 1 numbers", "independent, same time, wheels, ours"]),
    ("group", "ours", ["C01a", "group = 'ours' for 0 numbers"]),
])  # fmt: skip
def test_bad_claims_are_refused_in_one_sentence(tmp_path, field, value, words):
    data = yaml.safe_load((CONFIG / "claims.yaml").read_text(encoding="utf-8"))
    first = data["claims"][0] | {field: value}
    data["claims"][0] = {key: value for key, value in first.items() if value is not ...}
    path = conftest.written(tmp_path / "claims.yaml", yaml.safe_dump(data))
    conftest.refused(claims.load_claims, path, words=words, start=path)


@pytest.mark.parametrize(("name", "column", "inside", "outside", "runs"), [
    ("C28b", "left_share_pct", [10.9], [11.0, np.nan], (RING,)),  # equal within 2
    ("C23a", "right_share_pct", [0.5], [0.51, np.nan], ("ring/.*", [115.0], [0.305])),  # at most 0.5
    ("C23b", "right_share_pct", [0.5], [0.49, np.nan], ("ring/.*", [115.0], [0.304])),  # at least 0.5
    # may fall by 0.7 % in between, not by 1.4 %, and must grow by more than 14 %
    ("C06a", "rms_g", [[1.0, 1.1, 1.092, 1.2]],
     [[1.0, 1.1, 1.085, 1.2], [1.0, 1.05, 1.1, 1.14], [1.0, 1.05, 1.1, np.nan]], (RECORDS,)),
])  # fmt: skip
def test_each_rule_ends_where_it_says(name, column, inside, outside, runs):
    for values, verdict in ((inside, MET), (outside, NOT_MET)):
        for value in values:
            assert judge(CLAIMS[name], changed(good(), column, value, *runs)).verdict == verdict


def test_a_maximum_has_one_reading_and_others_decide_nothing():
    """Met by a peak of like height or by the force after the touch, it is not met."""
    other = later(good(), "left maximum" + MEAN, 0.4)
    like = other.events[other.events["event"] == "left maximum" + MEAN].iloc[:1]
    like = like.assign(event="left maximum, peak 1 of like height", median_s=0.17)
    assert judge(CLAIMS["C16b"], replace(other, events=pd.concat([other.events, like])))[:2] == ("0.4", NOT_MET)
    for event in ("left maximum", "left maximum" + AFTER):
        assert judge(CLAIMS["C16b"], later(good(), event, 0.4)).verdict == MET


@pytest.mark.parametrize(("left", "right"), [(0.03, 0.0), (0.0, 0.03)])
def test_the_arc_that_touches_later_is_the_number_whichever_it_is(left, right):
    """The first contact of a passage is at 0 by definition: it is no number, since it cannot fail."""
    e = later(later(good(), "first left", left), "first right", right)
    number = printed_numbers([CLAIMS["C16g"]], e)
    assert number["measured"].tolist() == ["0.03"] and number["met"].all()


def test_a_printed_amplitude_within_the_range_over_the_starts_is_met():
    for amplitudes, verdict in (([0.70, 0.72, 0.85, 0.90], MET), (0.70, NOT_MET)):
        (table := good().starts).loc[lambda rows: rows["rpm"] == 115.0, "line_g"] = amplitudes
        assert judge(CLAIMS["C08"], replace(good(), starts=table)).verdict == verdict


def test_printed_numbers_are_counted_one_by_one():
    numbers = printed_numbers(EVERY, good())
    assert len(numbers) == sum(claim.numbers for claim in CLAIMS.values()) == 24 and numbers["met"].all()
    counted = {"independent": 14, "same time": 4, "wheels": 4, "ours": 2}
    assert numbers["group"].value_counts().to_dict() == counted and scorecard.missed_numbers(numbers) == "none"
    others = "4 of 4 that repeat a time in other units, 4 of 4 that the wheels decide and 2 of 2 that we infer"
    assert scorecard.other_numbers(numbers) == others
    numbers = printed_numbers(EVERY, later(good(), "out", 1.40))
    missed = numbers.loc[~numbers["met"], ["id", "part", "printed", "measured"]]
    assert missed.values.tolist() == [["C16", "d", "1.31", "1.4"]]
    text = "Without a ring, after the first contact: out of engagement (1.4, printed 1.31 s)"
    assert scorecard.missed_numbers(numbers) == text
    assert "(3 to 10.2, printed" in scorecard.missed_numbers(numbers.assign(measured="4.5 to 10.25; 3 to 9.5"))
    assert numbers["claim"].is_unique
    lost = printed_numbers(EVERY, replace(good(), starts=pd.DataFrame()))
    assert len(lost) == 24 and list(lost.loc[~lost["met"], "id"]) == ["C08"] * 4
    assert lost["claim"].tolist() == numbers["claim"].tolist()


def of_tracks() -> dict[str, pd.DataFrame]:
    """Tables of tracks, invented: four are judged, two of them engaged, one has no ring to choose."""
    rows = [["14", "Ring: it bears most", "engaged", 2, 0, 1.0, 0.22, 1.0, 1.0, 1.0, "follows"],
            ["14", "Ring: it bears most", "all", 3, 1, 0.667, 0.14, 0.98, 0.5, 0.75, "depends"],
            ["19", "Conclusion 3", "engaged", 1, 1, 0.0, 0.0, 0.95, 0.0, 0.5, "never"],
            ["19", "Conclusion 3", "all", 3, 1, 0.333, 0.02, 0.86, 0.25, 0.5, "depends"]]  # fmt: skip
    head = ["name", "statement", "tracks", "decided", "undecided", "share", "low", "high", "least", "most", "class"]
    draws = pd.DataFrame({"state": "done", "engaged": [1, 1, 0, 0], "radius": [0.308, 0.306, np.nan, 0.307],
                          "creep": [0.3, 3.0, 30.0, 1.0]})  # fmt: skip
    draws = draws.assign(**{f"equal_pitch {name}": 0.305 + at for name, at in
                            (("polygon", 0.0), ("arc", 0.003), ("pins", 0.004), ("chord", 0.006))})  # fmt: skip
    binned = pd.DataFrame({"name": ["19", "19"], "creep_high": [2.0, 80.0], "shown": [1, 0], "decided": [2, 1]})
    mobilised = pd.DataFrame({"creep": [0.2, 0.2, 2.0, 2.0], "mobilised_friction": [0.009, 0.016, 0.055, 0.11]})
    # rings to choose on three tracks from one start and two from another
    chosen = [
        (1, 1, 0.02, {"0.3": 0.309, "0.5": 0.307, "0.7": 0.306, "durations": 0.305}),
        (2, 1, 0.05, {"0.3": np.nan, "0.5": 0.309, "0.7": 0.309, "durations": 0.306}),
        (3, 1, 0.2, {"0.3": np.nan, "0.5": np.nan, "0.7": 0.305, "durations": np.nan}),
        (1, 2, 0.02, {"0.5": 0.308}), (3, 2, 0.2, {"0.5": np.nan}),
    ]  # fmt: skip
    rings = pd.DataFrame([
        {"draw": draw, "engaged": int(draw < 3), "start": start, "mobilised_friction": friction, "rule": rule,
         "radius_m": radius, "tooth_ratio": {"0.5": 0.1 * draw, "durations": 0.6 * draw}.get(rule, 0.2),
         "tension_ratio": 1.0 + draw, "state": "larger misses" if np.isnan(radius) else "chosen"}
        for draw, start, friction, choices in chosen for rule, radius in choices.items()
    ])  # fmt: skip
    rings = rings.assign(polygon_m=0.305, arc_m=0.308, pins_m=0.309, chord_m=0.311)
    return {"sentences": pd.DataFrame(rows, columns=head), "draws": draws, "map": binned, "mobilised": mobilised,
            "rings": rings}  # fmt: skip


def test_what_is_learned_of_tracks_names_engaged_ones_bounds_readings_and_friction():
    """The words around the counts are those of the README and the laboratory's page (`test_filled`)."""
    tables = of_tracks()
    (follows, free, brief), radius = learned_sentences(tables), ring_sentences(tables["rings"])
    assert radius.startswith(brief) and brief.endswith("have one pitch.")
    for text, counts in {
        follows: ["Each of the 2 sentences", "on more than 10 % of 4 tracks", "2 of them mesh as printed. 1 sentence",
                  "no. 14 (Ring: it bears most) on 100 % (22 to 100). Brackets have"],
        free: ["Conclusion 3 holds on 0 % (0 to 95; 0 to 50) of them", "on 1 of 2 whose ring", "of 0.055 to 0.11)",
               "and on 0 of 1 of the others."],
        radius: ["3 tracks, of which 2 mesh", "ring on 2, with 0.3 on 1 and with 0.7 on 3. On 1 a ring halves",
                 "on 1 of 1 below 0.03, 1 of 1 from there to 0.1 and 0 of 1 above 0.1", " 0.15 (0.11 to 0.19) of its",
                 " 2.50 (2.10 to 2.90) times", "+3.0 (+2.2 to +3.8) mm from `polygon`, +0.0 mm from `arc`, -1.0 mm",
                 "by durations recommends a ring on 2; on 2 of these", "on 1 more than all", "From a second start 2 of",
                 "the same on 1 and moves by a millimetre on 1."],
    }.items():  # fmt: skip
        assert [words for words in counts if words not in text] == []
    assert "of a tooth, recommends a ring on 0" in ring_sentences(tables["rings"].assign(state="none"))
    dependent = tables["sentences"].assign(**{"class": "depends"})
    assert "No sentence holds on nine of ten of these." in learned_sentences(tables | {"sentences": dependent})[0]
    tables["sentences"].loc[tables["sentences"]["name"] == "14", "share"] = 0.95
    assert learned_sentences(tables)[0].startswith("Each sentence but no. 14 fails on more than 10 % of 4 tracks")


def test_neighbours_lose_what_the_rig_meets():
    near = pd.DataFrame({"rig": [0, 1, 2], "7": [1.0, 0.0, 0.0], "19": [1.0, 1.0, np.nan]})
    judged = pd.DataFrame({"number": [7, 19, 3], "verdict": [NOT_MET, MET, MET]})
    said = neighbours_sentence(near, judged)
    assert "holds on 1 of 2 of them" in said and said.endswith("lost or not decided are 19 (1 of 2).")


def test_transition_velocity_outside_its_range_is_said_with_its_friction():
    rows = [["ring_contact.friction_static", 0.3, "1", 0.2, 0.9, "", "assumed"],
            ["ring_contact.transition_velocity", 1.5, "m/s", 0.01, 0.15, "above", "fitted"]]  # fmt: skip
    parameters = pd.DataFrame(rows, columns=["name", "value", "unit", "low", "high", "outside", "kind"])
    said = scorecard.outside_sentence(parameters, "mine", of_tracks()["mobilised"])
    assert "velocity 1.5 m/s, a mobilised friction of 0.009 to 0.016 (assumed: 0.01 to 0.15)" in said
    assert "mobilised" not in scorecard.outside_sentence(parameters, "mine")
