"""The scorecard read: counted, in words, and the rigs beside each other."""

import pandas as pd

from replication.paper.claims import JUDGED, ORIGIN_WORDS, ORIGINS, REPRODUCED

SHORT = {  # the claims of Sect. 6 that can fail, in a few words
    "C16": "without a ring, both arcs touch at once; times of their maxima",
    "C20": "the ring bears the force, which varies less than without it",
    "C21": "forces grow with speed, most on the left arc, and little in all",
    "C22": "the ring force grows with the ring radius",
    "C23": "right-arc contact ends at a ring radius of 0.305 m",
    "C24": "the ring radius hardly changes the left-arc force",
    "C25": "from 0.307 m on, the left contact duration is near 10 % of a turn",
    "C26": "the recommended ring radius is 0.308 m, the equal-pitch radius",
}
SECTION_6 = ("C16", "C28")
OPEN = ("predicted", "transfer")  # origins that a fit leaves open


def counts(card: pd.DataFrame) -> pd.DataFrame:
    """Count the claims that are reproduced: every judged part of one origin is.

    Returns
    -------
    DataFrame
        A row for every rig and origin: ``rig, origin, claims, came_out``. A claim without a judged part counts
        nowhere, one whose parts have two origins once for each, and claims that share their data as one.
    """
    judged = card[card["verdict"].isin(JUDGED)]
    complete = (judged["verdict"] == REPRODUCED).groupby([judged["rig"], judged["origin"], judged["counts_as"]]).all()
    rows = [
        {"rig": rig, "origin": origin, "claims": len(found), "came_out": int(found.sum())}
        for rig in dict.fromkeys(card["rig"])
        for origin in ORIGINS
        for found in [complete[[key[:2] == (rig, origin) for key in complete.index]]]
    ]
    return pd.DataFrame(rows, columns=["rig", "origin", "claims", "came_out"])


def claim_counts(card: pd.DataFrame) -> pd.DataFrame:
    """What is reproduced, such as ``26 of 33``: a row for the parts of Sect. 6 and for each origin, a column a rig."""
    rigs = list(dict.fromkeys(card["rig"]))
    judged = card[card["verdict"].isin(JUDGED)]
    met, sixth = judged["verdict"] == REPRODUCED, judged["id"].between(*SECTION_6)
    parts = [sixth & (judged["rig"] == rig) for rig in rigs]
    lines = {f"parts of {' to '.join(SECTION_6)}": [f"{met[of].sum()} of {of.sum()}" for of in parts]}
    found = counts(card).set_index(["rig", "origin"])
    for origin, words in ORIGIN_WORDS.items():
        of_rigs = [found.loc[(rig, origin)] for rig in rigs]
        if any(row["claims"] for row in of_rigs):
            lines[words] = [f"{row['came_out']} of {row['claims']}" for row in of_rigs]
    return pd.DataFrame.from_dict(lines, orient="index", columns=rigs).rename_axis("reproduced").reset_index()


def open_claims(card: pd.DataFrame, rig: str) -> tuple[list[str], list[str]]:
    """Sentences on the claims that a fit leaves open (``OPEN``): those that a rig shows, and those that it does not."""
    own = card[(card["rig"] == rig) & card["origin"].isin(OPEN) & card["verdict"].isin(JUDGED)]
    shown: list[str] = []
    not_shown: list[str] = []
    for (claim_id, origin), rows in own.groupby(["id", "origin"], sort=False):
        lost = [part or claim_id for part in rows.loc[rows["verdict"] != REPRODUCED, "part"].fillna("")]
        words = SHORT.get(claim_id, rows["claim"].iloc[0])
        failed = f", which fails in {', '.join(lost)}" if lost else ""
        (not_shown if lost else shown).append(f"{words} ({claim_id}, {origin}{failed})")
    return shown, not_shown


def statements(card: pd.DataFrame) -> pd.DataFrame:
    """What the text says, a row a judged claim, and of each rig ``yes``, ``no`` or which parts it does not show.

    Returns
    -------
    DataFrame
        ``id, place, words``, and a column for each rig.
    """
    judged = card[card["verdict"].isin(JUDGED)].astype(object).fillna("")
    rigs = list(dict.fromkeys(card["rig"]))
    rows = []
    for name, parts in judged.groupby("id", sort=False):
        row = {"id": name, "place": parts["place"].iloc[0], "words": SHORT.get(name, parts["claim"].iloc[0])}
        for rig in rigs:
            own = parts[parts["rig"] == rig]
            lost = own.loc[own["verdict"] != REPRODUCED, "part"].tolist()
            row[rig] = (
                "–" if own.empty else "yes" if not lost else "no" if len(lost) == len(own) else f"not {', '.join(lost)}"
            )
        rows.append(row)
    return pd.DataFrame(rows, columns=["id", "place", "words", *rigs])


def headline(card: pd.DataFrame, rig: str) -> str:
    """How many claims of each origin a rig reproduces, in one sentence, predictions first."""
    found = counts(card).query("rig == @rig and claims > 0")
    message = [f"{row.came_out} of {row.claims} {ORIGIN_WORDS[row.origin]}" for row in found.itertuples()]
    return f"Reproduced: {', '.join(message)}."


def side_by_side(card: pd.DataFrame) -> pd.DataFrame:
    """The scorecard with a row a part, and measured value and verdict of every rig in columns of their own."""
    rigs = list(dict.fromkeys(card["rig"]))
    shown = ["id", "part", "place", "claim", "origin", "printed", "tolerance", "unit", "speeds"]
    parts = {rig: card[card["rig"] == rig].set_index(["id", "part"]) for rig in rigs}
    table = parts[rigs[0]].reset_index()[shown]
    for rig, rows in parts.items():
        before = f"{rig}: " if len(rigs) > 1 else ""
        for name in ("measured", "verdict"):
            table[before + name] = rows[name].to_numpy()
    return table.join(parts[rigs[0]].reset_index()[["fails_if"]])
