"""Tracks sampled from assumed ranges: the shares of them that show a statement of the paper, and the rings to choose.

The tables lie in ``data/plausible``, whose README describes the columns.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from trackdyn.measure.cells import listed, significant
from trackdyn_replication.paper.claims import MET

FOLDER = "data/plausible"
ENGAGED, ALL = TRACKS = ("engaged", "all")  # tracks that are in mesh as long as printed, and all that are judged
FOLLOWS = "follows"  # class of a sentence that nine of ten tracks show
RUBBER = (2.0, 90.0)  # creep slope of a solid rubber wheel, s/m (ring_contact.transition_velocity of the rigs' files)
FREE = "19"  # sentence that a summary of the tracks names: conclusion 3
PITCH = "polygon"  # reading of equal pitch from which the recommended radius is counted
OTHER_PITCHES = ("arc", "pins", "chord")
RING_VELOCITY = "ring_contact.transition_velocity"
CREEP_BOUNDS = (RUBBER[0], 10.0)  # s/m, that part tracks by their rings
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
    """Share of the decided tracks that show a statement, %, with its 90 % interval and its bounds; of `track_rows`.

    The bounds stand behind a semicolon: what is not decided counts as no, and as yes.
    """
    row = rows.loc[(name, tracks)]
    if not row["decided"]:
        return "none that was decided"
    share, low, high, least, most = (f"{100 * row[key]:.0f}" for key in ("share", "low", "high", "least", "most"))
    return f"{share} % ({low} to {high}; {least} to {most})" if row["undecided"] else f"{share} % ({low} to {high})"


def learned_sentences(tables: Mapping[str, pd.DataFrame]) -> list[str]:
    """What plausible tracks say: tables ``sentences``, ``map``, ``draws`` and ``mobilised``."""
    share = share_of_tracks(track_rows(tables["sentences"]), FREE, ENGAGED)
    low, other = creep_counts(tables["map"], FREE)
    friction = mobilised(tables["mobilised"], RUBBER[0])
    return [
        f"{follows_sentence(tables['sentences'], tables['draws'])} {SHARES_READ}",
        f"With rings from 0.305 m on, no right arc touches a tooth (conclusion 3) on {share} of them; of all tracks on "
        f"{low} whose ring has a creep slope below {RUBBER[0]:g} s/m, and on {other} of the others. At that slope the "
        f"ring of the default rig has {friction}.",
        distance_sentence(tables["draws"]),
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
    return f"Of {len(done)} tracks sampled from assumed ranges {count} mesh as printed. {hold}{names}."


def mobilised(table: pd.DataFrame, slope: float) -> str:
    """Mobilised friction of the default rig's ring at its radius, with the creep slope (s/m) nearest to this one.

    ``table`` is ``plausible_mobilised.csv``; its range over the speeds is said.
    """
    nearest = table["creep"].iloc[(table["creep"] - slope).abs().argmin()]
    values = table.loc[table["creep"] == nearest, "mobilised_friction"]
    return f"a mobilised friction of {significant(values.min(), 2)} to {significant(values.max(), 2)}"


def creep_slope(parameters: pd.DataFrame) -> float:
    """Creep slope of a rig's ring, its friction over the velocity at which it is reached, s/m."""
    of_rig = parameters.set_index("name")["value"]
    return float(of_rig["ring_contact.friction_static"]) / float(of_rig[RING_VELOCITY])


def creep_counts(binned: pd.DataFrame, name: str) -> tuple[str, str]:
    """Tracks that show a sentence of those with a creep slope below that assumed for rubber, and of the others."""
    rows = binned[binned["name"].astype(str) == name]
    low = rows["creep_high"] <= RUBBER[0]
    sums = (rows.loc[mask, ["shown", "decided"]].sum() for mask in (low, ~low))
    first, second = (f"{row['shown']:.0f} of {row['decided']:.0f}" for row in sums)
    return first, second


def chosen_distances(draws: pd.DataFrame, reading: str = PITCH) -> pd.Series:
    """The ring to choose less the equal-pitch radius by a reading, mm, of every track that has a choice."""
    if "radius" not in draws:
        return pd.Series(dtype=float)
    return (1e3 * (draws["radius"] - draws[f"equal_pitch {reading}"])).dropna()


def distance_sentence(draws: pd.DataFrame) -> str:
    """The ring to choose as its distance from each reading of equal pitch, and how many tracks have none."""
    distances = chosen_distances(draws)
    if distances.empty:
        return "Our rule recommends no ring for any track."
    low, high = distances.quantile([0.1, 0.9])
    middles = {name: chosen_distances(draws, name).median() for name in (PITCH, *OTHER_PITCHES)}
    sides = [f"{abs(middle):.1f} mm {'above' if middle >= 0 else 'below'} `{name}`" for name, middle in middles.items()]
    ran = draws[draws["state"] == "done"]
    first, second = CREEP_BOUNDS
    words = (f"below {first:g} s/m", f"from there to {second:g} s/m", f"above {second:g} s/m")
    bins = pd.cut(ran["creep"], [0.0, first, second, np.inf], labels=words)
    parts = [f"{rows.isna().sum()} of {len(rows)} {name}" for name, rows in ran["radius"].groupby(bins, observed=False)]
    without = 100 * ran["radius"].isna().mean()
    return (
        "The rule by durations (that by the force of a tooth was not tried on these tracks) recommends a ring that "
        f"lies {sides[0]}, the radius at which links and teeth have one pitch "
        f"(median; 80 % of the choices {low:+.1f} to {high:+.1f} mm). By other readings of that radius it lies "
        f"{listed(sides[1:])}. For {without:.0f} % of the tracks there is none: by the creep slope of the ring for "
        f"{listed(parts)}."
    )


def neighbours_free(near: pd.DataFrame) -> str:
    """Count the neighbours of the default rig that show conclusion 3 (``plausible_near.csv``)."""
    others = near[near["rig"] > 0]
    return f"{int((others[FREE] == 1).sum())} of {len(others)}"


def neighbours_sentence(near: pd.DataFrame, judged: pd.DataFrame) -> str:
    """What neighbours of the default rig lose of the sentences that it meets (``plausible_near.csv``)."""
    others, met = near[near["rig"] > 0], judged.loc[judged["verdict"] == MET, "number"].astype(int).astype(str)
    judged_names = others.columns[others.notna().any()]
    lost = [
        f"{name} ({missing} of {len(others)})"
        for name in met
        if name in judged_names and (missing := int((others[name] != 1).sum())) > 0.1 * len(others)
    ]
    return (
        "Neighbours of the default rig have each fitted value moved by up to 1 %, equal pitch by up to 0.5 mm. "
        f"Conclusion 3 (sentence {FREE}) holds on {neighbours_free(near)} of them; lost or not decided are "
        f"{listed(lost) or 'no sentences by more than one in ten'}."
    )
