"""Sampled tracks (``data/plausible``): the shares that show a statement of the paper, and the rings to choose."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from trackdyn.measure.columns import listed, significant
from trackdyn_replication.paper.claims import MET

FOLDER = "data/plausible"
ENGAGED, ALL = TRACKS = ("engaged", "all")  # tracks that are in mesh as long as printed, and all that are judged
FOLLOWS = "follows"  # class of a sentence that nine of ten tracks show
RUBBER = (2.0, 90.0)  # creep slope of a solid rubber wheel, s/m (ring_contact.transition_velocity of the rigs' files)
FREE = "19"  # sentence that a summary of the tracks names: conclusion 3
PITCH = "polygon"  # reading of equal pitch from which the recommended radius is counted
OTHER_PITCHES = ("arc", "pins", "chord")
RINGS = f"{FOLDER}/rings.csv"
# its rules, and two of its states (`laboratory.plausible.rings`)
HALF, OTHER_SHARES, DURATIONS, CHOSEN, NARROW = "0.5", ("0.3", "0.7"), "durations", "chosen", "larger misses"
FRICTIONS = (0.03, 0.1)  # mobilised, that part tracks by their rings: a factor of two below and above the finding's
STEP = 0.0005  # m: half of the step of the radii
RING_VELOCITY = "ring_contact.transition_velocity"
SHARES_READ = (
    "Brackets have the 90 % interval of a share of the decided tracks and, where some are not decided, the share with "
    "these as no and as yes."
)


def track_rows(table: pd.DataFrame) -> pd.DataFrame:
    """Rows of ``plausible_claims.csv`` or ``plausible_sentences.csv`` by name and `TRACKS`."""
    return table.assign(name=table["name"].astype(str)).set_index(["name", "tracks"])


def percents(rows: pd.DataFrame | None, name: str) -> list[str]:
    """Shares (%) of all tracks and of the engaged ones, of `track_rows`; a dash for what is not there."""
    values = [np.nan if rows is None else rows["share"].get((name, tracks), np.nan) for tracks in TRACKS]
    return ["–" if np.isnan(value) else f"{100 * value:.0f}" for value in values]


def share_of_tracks(rows: pd.DataFrame, name: str, tracks: str) -> str:
    """Share of the decided tracks that show a statement, %, with its 90 % interval and its bounds; of `track_rows`."""
    row = rows.loc[(name, tracks)]
    if not row["decided"]:
        return "none that was decided"
    share, low, high, least, most = (f"{100 * row[key]:.0f}" for key in ("share", "low", "high", "least", "most"))
    return f"{share} % ({low} to {high}; {least} to {most})" if row["undecided"] else f"{share} % ({low} to {high})"


def learned_sentences(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    """Word the results of plausible tracks: tables ``sentences``, ``map``, ``draws``, ``mobilised`` and ``rings``."""
    share = share_of_tracks(track_rows(tables["sentences"]), FREE, ENGAGED)
    cells = tables["map"][tables["map"]["name"].astype(str) == FREE]
    slips = cells["creep_high"] <= RUBBER[0]
    sums = (cells.loc[mask, ["shown", "decided"]].sum() for mask in (slips, ~slips))
    low, other = (f"{row['shown']:.0f} of {row['decided']:.0f}" for row in sums)
    friction = mobilised(tables["mobilised"], RUBBER[0])
    return [
        f"{follows_sentence(tables['sentences'], tables['draws'])} {SHARES_READ}",
        f"Conclusion 3 holds on {share} of them; of all tracks on {low} whose ring has little friction (a creep slope "
        f"below {RUBBER[0]:g} s/m, on the default rig {friction}), and on {other} of the others.",
        ring_sentences(tables["rings"], brief=True),
    ]


def follows_sentence(sentences: pd.DataFrame, draws: pd.DataFrame) -> str:
    """Name the sentences that nine of ten engaged tracks show."""
    rows = track_rows(sentences)
    engaged = rows.xs(ENGAGED, level="tracks")
    follow = [
        f"no. {name} ({statement}) on {share_of_tracks(rows, name, ENGAGED)}"
        for name, statement in engaged.loc[engaged["class"] == FOLLOWS, "statement"].items()
    ]
    done = draws[draws["state"] == "done"]
    count = int((done["engaged"] == 1).sum())
    hold = f"{len(follow) or 'No'} sentence{'s hold' if len(follow) > 1 else ' holds'} on nine of ten of these"
    names = f": {listed(follow)}" if follow else ""
    judged = rows.xs(ALL, level="tracks").query("decided > 0")
    robust = [f"no. {name}" for name in judged.index[judged["share"] >= 0.9]]
    each = f"sentence but {listed(robust)}" if robust else f"of the {len(judged)} sentences that they can show"
    return (
        f"Each {each} fails on more than 10 % of {len(done)} tracks sampled from assumed ranges. "
        f"{count} of them mesh as printed. {hold}{names}."
    )


def mobilised(table: pd.DataFrame, slope: float) -> str:
    """Word the mobilised friction of the default rig's ring over the speeds, for the creep slope nearest to one."""
    nearest = table["creep"].iloc[(table["creep"] - slope).abs().argmin()]
    values = table.loc[table["creep"] == nearest, "mobilised_friction"]
    return f"a mobilised friction of {significant(values.min(), 2)} to {significant(values.max(), 2)}"


def creep_slope(parameters: pd.DataFrame) -> float:
    """Creep slope of a rig's ring, its friction over the velocity at which it is reached, s/m."""
    of_rig = parameters.set_index("name")["value"]
    return float(of_rig["ring_contact.friction_static"]) / float(of_rig[RING_VELOCITY])


def of_start(rings: pd.DataFrame, rule: str, start: int = 0) -> pd.DataFrame:
    """Rows of ``rings.csv`` by a rule, of the first start or of a later one, by ``draw``."""
    starts = sorted(rings["start"].unique())
    return rings[(rings["start"] == starts[start]) & (rings["rule"] == rule)].set_index("draw")


def chosen_rings(rings: pd.DataFrame, rule: str = HALF) -> pd.DataFrame:
    """Rows of the tracks on which a rule recommends a ring."""
    rows = of_start(rings, rule)
    return rows[rows["state"] == CHOSEN]


def ring_sentences(rings: pd.DataFrame, brief: bool = False) -> str:
    """Word the rings to choose on sampled tracks: their count, gain, cost and place; more if not brief."""
    tracks, chosen, by_durations = of_start(rings, HALF), chosen_rings(rings), chosen_rings(rings, DURATIONS)
    others = [f"with {share} on {len(chosen_rings(rings, share))}" for share in OTHER_SHARES]
    narrow = int((tracks["state"] == NARROW).sum())
    labels = (f"below {FRICTIONS[0]:g}", f"from there to {FRICTIONS[1]:g}", f"above {FRICTIONS[1]:g}")
    bins = pd.cut(tracks["mobilised_friction"], [0.0, *FRICTIONS, np.inf], right=False, labels=labels)
    by_friction = [
        f"{(states == CHOSEN).sum()} of {len(states)} {name}"
        for name, states in tracks["state"].groupby(bins, observed=False)
    ]
    engaged = int(tracks["engaged"].sum())
    all_engaged = f"All {engaged} tracks that mesh as printed"
    judged = all_engaged if engaged == len(tracks) else f"{len(tracks)} tracks, of which {engaged} mesh as printed,"
    sentences = [
        f"{judged} were run from one start with rings in steps of a millimetre, at 115 and 210 rpm: "
        f"our rule, at most {HALF} of the force of a tooth, recommends a ring on {len(chosen)}, {listed(others)}. "
        f"On {narrow} a ring halves the force of a tooth, but not all up to a millimetre above it. "
        f"By the mobilised friction of a ring of 0.308 m there is a choice on {listed(by_friction)}."
    ]
    if len(chosen):
        gain, cost = (_spread(chosen[name], ".2f") for name in ("tooth_ratio", "tension_ratio"))
        above = {name: 1e3 * (chosen["radius_m"] - chosen[f"{name}_m"]) for name in (PITCH, *OTHER_PITCHES)}
        middles = [f"{_spread(above.pop(PITCH), '+.1f')} mm from `{PITCH}`"]
        middles += [f"{values.median():+.1f} mm from `{name}`" for name, values in above.items()]
        sentences.append(
            f"The recommended ring leaves a tooth {gain} of its force without a ring at {cost} times the tension "
            f"(median; 80 % of the tracks). Its radius is {listed(middles)}, readings of the radius at which links and "
            "teeth have one pitch."
        )
    if len(by_durations):
        more = [int((by_durations["tooth_ratio"] > limit).sum()) for limit in (float(HALF), 1.0)]
        sentences.append(
            f"The rule by durations recommends a ring on {len(by_durations)}; on {more[0]} of these a tooth bears more "
            f"than half of its force without a ring, on {more[1]} more than all of it."
        )
    if rings["start"].nunique() > 1:
        other = of_start(rings, HALF, 1)
        moved = (other["radius_m"].fillna(0.0) - tracks["radius_m"].fillna(0.0).reindex(other.index)).abs()
        sentences.append(
            f"From a second start {len(other)} of them were run: the choice is the same on {int((moved < STEP).sum())} "
            f"and moves by a millimetre on {int(moved.between(STEP, 3 * STEP).sum())}."
        )
    return " ".join(sentences[: 2 if brief else None])


def _spread(values: pd.Series, form: str) -> str:
    """Median, and in brackets the range of the middle 80 %."""
    low, middle, high = values.quantile([0.1, 0.5, 0.9])
    return f"{middle:{form}} ({low:{form}} to {high:{form}})"


def neighbours_free(near: pd.DataFrame) -> str:
    """Count the neighbours of the default rig that show conclusion 3 (``plausible_near.csv``)."""
    others = near[near["rig"] > 0]
    return f"{int((others[FREE] == 1).sum())} of {len(others)}"


def neighbours_sentence(near: pd.DataFrame, judged: pd.DataFrame) -> str:
    """Word the losses of neighbours of the default rig, of the sentences that it meets (``plausible_near.csv``)."""
    others, met = near[near["rig"] > 0], judged.loc[judged["verdict"] == MET, "number"].astype(int).astype(str)
    judged_names = others.columns[others.notna().any()]
    lost = [
        f"{name} ({missing} of {len(others)})"
        for name in met
        if name in judged_names and (missing := int((others[name] != 1).sum())) > 0.1 * len(others)
    ]
    return (
        "Neighbours of the default rig have each fitted and each sampled value moved by up to 1 %, equal pitch by up "
        "to 0.5 mm. "
        f"Conclusion 3 (sentence {FREE}) holds on {neighbours_free(near)} of them; lost or not decided are "
        f"{listed(lost) or 'no sentences by more than one in ten'}."
    )
