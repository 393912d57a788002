"""The scorecard read: counted, in words, and the rigs beside each other."""

import re
from collections.abc import Sequence

import pandas as pd

from replication.paper.claims import JUDGED, NOT_COMPARABLE, NOT_SHOWN, SHOWN, VERDICTS
from trackdyn.measure.cells import significant

RADIUS = "C26a"  # the radius to choose
SECTIONS = ("C04", "C28")  # claims of Sects. 5.2 and 6
MARKS = dict(zip(VERDICTS, ("●", "○", "◇", "–"), strict=True))
SHORT = {  # parts of claims in a few words, in the order of a summary
    "C26a": "radius to choose by our rule, by speed (m)",
    "C06a": "RMS of the acceleration grows with speed (g)",
    "C08": "amplitude of the line of the loop, by speed (g)",
    "C15": "no ring: areas that the arcs touch",
    "C27a": "no ring: contact of the left arc (% of a turn)",
    "C27b": "no ring: contact of the right arc (% of a turn)",
    "C17a": "ring: left arc touches, ring left, out (s after the first touch)",
    "C28b": "ring: contact of the left arc (% of a turn)",
    "C20a": "ring: its force over that of both arcs",
    "C23a": "contact of the right arc from 0.305 m on, by speed (% of a turn)",
    "C24": "force of the left arc off its mean over all radii, by speed (%)",
    "C04a": "difference of the RMS from the field test, by speed (%)",
}


def count(card: pd.DataFrame, rig: str) -> tuple[int, int]:
    """Statements of Sects. 5.2 and 6 that a rig shows, and how many are judged."""
    judged = card[card["id"].between(*SECTIONS) & card["verdict"].isin(JUDGED) & (card["rig"] == rig)]
    return int((judged["verdict"] == SHOWN).sum()), len(judged)


def headline(card: pd.DataFrame, rig: str) -> str:
    """The count in a sentence."""
    shown, judged = count(card, rig)
    return f"The rig {rig} shows {shown} of {judged} statements of Sects. 5.2 and 6."


def answer_sentences(card: pd.DataFrame, parameters: pd.DataFrame, own: bool = False) -> list[str]:
    """The answer in three sentences: counts, the radius to choose, what is known of the parameters of the first rig.

    Nothing of an ``own`` rig was fitted to the paper, which does not speak of it: the radius alone is said.
    """
    rigs = list(dict.fromkeys(card["rig"]))
    choices = card[(card["id"] + card["part"].fillna("") == RADIUS) & card["verdict"].isin(JUDGED)].set_index("rig")
    radii = []
    for rig, row in choices.iterrows():
        values = [value.strip() for value in str(row["measured"]).split(",")]
        same = len(set(values)) == 1
        where = "at every speed" if same else f"at {row['speeds']} rpm"
        radii.append(f"{values[0] if same else ', '.join(values)} m {where} (rig {rig})")
    if own:
        return [f"The ring to choose has a radius of {'; '.join(radii)}."] if radii else []
    counts = [f"{shown} of {judged} (rig {rig})" for rig in rigs for shown, judged in [count(card, rig)]]
    kinds = parameters["kind"].value_counts()
    fitted = kinds.get("fitted", 0)
    known = len(parameters) - fitted - kinds.get("assumed", 0)
    outside = parameters.loc[parameters["outside"].notna(), "name"].str.replace("[._]", " ", regex=True)
    sources = f"The paper prints or implies {known} of {len(parameters)} parameters of {rigs[0]}"
    if fitted:
        sources += (
            f"; {fitted} were chosen so that its statements come out: the count says what the model can show, and "
            "predicts nothing"
        )
    if len(outside):
        sources += f". No real part has its values of {', '.join(outside)}"
    return [
        f"Statements of Sects. 5.2 and 6 that come out: {', '.join(counts)}.",
        f"The ring to choose has a radius of {'; '.join(radii)}, by a rule of ours; the paper chooses "
        f"{choices['printed'].iloc[0]} m and states no rule."
        if radii
        else "Without a ring study of enough radii no radius is chosen.",
        f"{sources}.",
    ]


def not_shown(card: pd.DataFrame, rig: str) -> list[str]:
    """Statements that a rig does not show, each with what was measured."""
    lost = card[card["id"].between(*SECTIONS) & (card["verdict"] == NOT_SHOWN) & (card["rig"] == rig)]
    units = lost["unit"].where(lost["unit"].astype(str) != "1", "").fillna("")
    return [
        f"{claim} (measured: {measured} {unit}".rstrip() + ")"
        for claim, measured, unit in zip(lost["claim"], lost["measured"], units, strict=True)
    ]


def statements(card: pd.DataFrame, names: Sequence[str] = tuple(SHORT)) -> pd.DataFrame:
    """Some statements in words: what is printed, and what each rig gives, with a mark (``MARKS``).

    Returns
    -------
    DataFrame
        ``statement, printed`` and ``rig <name>`` for each rig.
    """
    card = card.astype(object).fillna("")
    name = card["id"] + card["part"]
    rows = []
    for wanted in names:
        parts = card[name == wanted].astype(str).set_index("rig")
        if parts.empty:
            continue
        printed = parts["printed"].iloc[0]
        row = {"statement": SHORT[wanted], "printed": "in words" if printed.startswith("ours") else printed}
        for rig, judged in parts.iterrows():
            value = "" if judged["verdict"] == NOT_COMPARABLE else _rounded(judged["measured"])
            row[f"rig {rig}"] = f"{value} {MARKS[judged['verdict']]}".strip()
        rows.append(row)
    return pd.DataFrame(
        rows, columns=["statement", "printed", *(f"rig {rig}" for rig in dict.fromkeys(card["rig"]))]
    ).fillna("–")


def _rounded(text: str) -> str:
    """Text with three significant digits in its numbers; a fit says no more. A range without width is one number."""
    rounded = re.sub(r"\d+\.\d+", lambda number: significant(float(number[0])), text)
    return re.sub(r"\b(\S+) to \1(?![\d.])", r"\1", rounded)


def side_by_side(card: pd.DataFrame) -> pd.DataFrame:
    """The scorecard with a row a statement, and measured value and verdict of every rig in columns of their own."""
    rigs = list(dict.fromkeys(card["rig"]))
    columns = ["id", "part", "place", "claim", "printed", "tolerance", "unit", "speeds"]
    parts = {rig: card[card["rig"] == rig].set_index(["id", "part"]) for rig in rigs}
    table = parts[rigs[0]].reset_index()[columns]
    for rig, rows in parts.items():
        before = f"{rig}: " if len(rigs) > 1 else ""
        for name in ("measured", "verdict"):
            table[before + name] = rows[name].to_numpy()
    return table.join(parts[rigs[0]].reset_index()[["fails_if"]])
