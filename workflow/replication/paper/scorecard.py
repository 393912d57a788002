"""The scorecard read: counted, in words, and the rigs beside each other."""

import re
from collections.abc import Mapping, Sequence

import pandas as pd

from replication.paper.claims import JUDGED, NO_VALUE, NOT_COMPARABLE, NOT_SHOWN, SHOWN, VERDICTS
from trackdyn.measure.cells import significant

RADIUS = "C26a"  # the radius to choose
CONCLUSION = r"^Conclusion (\d)"  # numbered by the paper, in Sect. 6.2; two sentences may be one of them
MARKS = dict(zip(VERDICTS, ("●", "○", "◇", "–"), strict=True))
SHORT = {  # parts of claims in a few words, in the order of a summary
    "C26a": "radius to choose by our rule, by speed (m)",
    "C06a": "RMS of the acceleration, by speed (g)",
    "C08": "amplitude of the dominant peak, by speed (g)",
    "C15": "no ring: areas that the arcs touch",
    "C27a": "no ring: contact duration of the left arc (% of a turn)",
    "C27b": "no ring: contact duration of the right arc (% of a turn)",
    "C17a": "ring: first touch of the left arc (s after that of the link)",
    "C28b": "ring: contact duration of the left arc (% of a turn)",
    "C20a": "ring: its force over that of both arcs",
    "C23a": "ring from 0.305 m on: contact duration of the right arc, by speed (% of a turn)",
    "C24": "force of the left arc: largest deviation from its mean over all radii, by speed (%)",
}
IN_WORDS = {  # of the paper, which prints no number
    "C06a": "grows",
    "C20a": "mainly the ring",
    "C23a": "no contact",
    "C24": "practically none",
}


def sentence_verdicts(card: pd.DataFrame, sentences: Mapping[int, str]) -> pd.DataFrame:
    """Sentences of the paper judged whole: shown where all of their statements are.

    Returns
    -------
    DataFrame
        ``rig, number, sentence, verdict, statements`` (those that decide: the ones that are not shown, else all).
    """
    rows = []
    card = card.assign(name=card["id"] + card["part"].fillna(""))
    for (rig, number), parts in card.dropna(subset="sentence").groupby(["rig", "sentence"], sort=False):
        lost = parts[parts["verdict"] == NOT_SHOWN]
        verdicts = parts["verdict"].unique()
        verdict = NOT_SHOWN if len(lost) else SHOWN if list(verdicts) == [SHOWN] else min(set(verdicts) - {SHOWN})
        deciding = ", ".join((lost if len(lost) else parts)["name"])
        rows.append([rig, int(number), sentences[int(number)], verdict, deciding])
    table = pd.DataFrame(rows, columns=["rig", "number", "sentence", "verdict", "statements"])
    order = {rig: position for position, rig in enumerate(dict.fromkeys(card["rig"]))}
    return table.sort_values(["rig", "number"], key=lambda column: column.replace(order), ignore_index=True)


def count(judged: pd.DataFrame, rig: str) -> tuple[int, int]:
    """Sentences that a rig shows, and how many are judged (`sentence_verdicts`)."""
    verdicts = judged.loc[(judged["rig"] == rig) & judged["verdict"].isin(JUDGED), "verdict"]
    return int((verdicts == SHOWN).sum()), len(verdicts)


def headline(judged: pd.DataFrame, rig: str) -> str:
    """The count of a rig, and which of the numbered conclusions on the ring it shows."""
    shown, total = count(judged, rig)
    return (
        f"The rig `{rig}` shows {shown} of the {total} sentences of Sects. 5.2 and 6 that can be judged. "
        f"Of the paper's four conclusions on the ring it shows {conclusions(judged, rig)}."
    )


def conclusions(judged: pd.DataFrame, rig: str) -> str:
    """The numbered conclusions on the ring that a rig shows, in the words of the paper."""
    rows = judged[judged["rig"] == rig]
    numbers = rows["sentence"].str.extract(CONCLUSION, expand=False)
    words = [
        f"{number} ({'; '.join(of['sentence'].str.partition(': ')[2])})"
        for number, of in rows.groupby(numbers)
        if set(of["verdict"]) == {SHOWN}
    ]
    return _listed(words) or "none"


def track_rows(claims: pd.DataFrame) -> pd.DataFrame:
    """Rows of plausible tracks (``docs/measured/plausible_claims.csv``), equal pitch read along the arc, by statement
    and ring.
    """
    return claims[claims["equal_pitch"] == "arc length"].set_index(["name", "ring"])


def share_of_tracks(rows: pd.DataFrame, name: str, ring: str) -> str:
    """Share of the tracks that show a statement, % with its 90 % interval; ``rows`` of `track_rows`."""
    row = rows.loc[(name, ring)]
    return f"{100 * row['share']:.0f} % ({100 * row['low']:.0f} to {100 * row['high']:.0f})"


def learned_sentences(claims: pd.DataFrame) -> list[str]:
    """Sentences on plausible tracks: with a ring that slips and one that grips, equal pitch read along the arc.

    ``claims`` are shares by scenario (``docs/measured/plausible_claims.csv``).
    """
    rows = track_rows(claims)
    free, bears = (
        {ring: share_of_tracks(rows, name, ring) for ring in ("slips", "grips")} for name in ("C23a", "C20a")
    )
    return [
        f"We drew {rows['rigs'].max()} tracks from the ranges of real parts. With a ring of 0.305 m or more, no right "
        f"arc touches a tooth on {free['slips']} of them if the ring slips nearly freely, and on {free['grips']} if it "
        "grips as rubber does.",
        f"The ring bears most of the force on {bears['slips']} of the tracks if it slips, and on {bears['grips']} if "
        "it grips. Brackets hold 90 % intervals.",
    ]


def neighbours_sentence(near: pd.DataFrame) -> str:
    """Count that nine of ten neighbours of the fitted rig hold (``docs/measured/plausible_near.csv``)."""
    others, at_rig = near[near["rig"] > 0]["shown"], near[near["rig"] == 0].iloc[0]
    return (
        "A neighbour of the rig has every fitted value changed by up to 1 %. Nine of ten neighbours show at least "
        f"{int(others.quantile(0.1, interpolation='lower'))} sentences, and their median is {others.median():g}; in "
        f"records as short as theirs the rig itself shows {at_rig['shown']:g}."
    )


def radius_sentence(card: pd.DataFrame, rig: str, own: bool = False) -> str:
    """The ring to choose by speed, and why; the paper's choice beside it but for an ``own`` rig."""
    rows = card[(card["id"] + card["part"].fillna("") == RADIUS) & (card["rig"] == rig) & card["verdict"].isin(JUDGED)]
    if rows.empty:
        return "Without a ring study of enough radii no radius is chosen."
    row = rows.iloc[0]
    speeds: dict[str, list[str]] = {}  # that a radius is chosen at
    for radius, rpm in zip(
        str(row["measured"]).split(","), str(row["speeds"]).removesuffix(".0").split(","), strict=True
    ):
        speeds.setdefault(radius.strip(), []).append(rpm.strip())
    served = [rpm for radius, of in speeds.items() if radius != NO_VALUE for rpm in of]
    rule = (
        "Our rule takes the smallest ring with which right arcs hardly touch (below 0.5 % of a turn) and left arcs "
        "touch for at most a tooth's share of a turn (100 % / teeth) plus 2 %."
    )
    paper = "" if own else f" The paper chooses {row['printed']} m and states no rule."
    if not served:
        return f"No radius of the study serves. {rule}{paper}"
    chosen = _listed(
        [
            f"{radius} m at {'every speed' if len(speeds) == 1 else f'{_listed(of)} rpm'}"
            for radius, of in speeds.items()
            if radius != NO_VALUE
        ]
    )
    lost = f" At {_listed(speeds[NO_VALUE])} rpm no radius of the study serves." if NO_VALUE in speeds else ""
    return f"The ring to choose has a radius of {chosen}.{lost} {rule}{paper}"


def _listed(words: Sequence[str]) -> str:
    """Words as a list in a sentence: ``150, 180 and 210``."""
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def outside_sentence(parameters: pd.DataFrame, rig: str) -> str:
    """Sentence on what is fitted, and on the values that no real part has, each beside its range."""
    kinds = parameters["kind"].value_counts()
    fitted = kinds.get("fitted", 0)
    known = len(parameters) - fitted - kinds.get("assumed", 0)
    count = len(parameters)
    text = f"The paper prints or implies {known} of the {count} parameters of the rig `{rig}`; {fitted} are fitted."
    cells = outside_values(parameters)
    return f"{text} Values that no real part has: {'; '.join(cells)}." if cells else text


def outside_values(parameters: pd.DataFrame) -> list[str]:
    """Values that no real part has, each beside its range."""
    outside = parameters[parameters["outside"].notna() & (parameters["outside"] != "")]
    return [
        f"{re.sub('[._]', ' ', name)} {significant(float(value), 3)} {unit} (real parts: {low:g} to {high:g})"
        for name, value, unit, low, high in outside[["name", "value", "unit", "low", "high"]].itertuples(index=False)
    ]


def answer_sentences(
    card: pd.DataFrame,
    judged: pd.DataFrame,
    parameters: pd.DataFrame,
    claims: pd.DataFrame | None = None,
    own: bool = False,
) -> list[str]:
    """The answer in sentences: plausible tracks, counts, the radius to choose, what is known of the first rig.

    Nothing of an ``own`` rig was fitted to the paper, which does not speak of it: the radius alone is said.
    """
    rigs = list(dict.fromkeys(card["rig"]))
    if own:
        return [radius_sentence(card, rigs[0], own)]
    return [
        *(learned_sentences(claims) if claims is not None else []),
        radius_sentence(card, rigs[0]),
        *(headline(judged, rig) for rig in rigs),
        outside_sentence(parameters, rigs[0]),
    ]


def page_answer(
    card: pd.DataFrame, judged: pd.DataFrame, claims: pd.DataFrame | None = None, own: bool = False
) -> list[str]:
    """The first sentences of the page: what was learned, the ring to choose and why, and the one count."""
    rig = card["rig"].iloc[0]
    learned = learned_sentences(claims) if claims is not None else []
    return [radius_sentence(card, rig, own)] if own else [*learned, radius_sentence(card, rig), headline(judged, rig)]


def said_of(card: pd.DataFrame, judged: pd.DataFrame, shares: Mapping[str, pd.DataFrame]) -> dict[str, list[dict]]:
    """Statements of the paper on each figure or table, by its label: sentences, and the statements that decide them.

    ``shares`` are those of plausible tracks (``sentences``, ``claims``) or empty. Statements without a sentence follow
    from another one or are not judged; they stand last, under a sentence of no number.
    """
    arc = {
        name: table[table["equal_pitch"] == "arc length"].set_index(["name", "ring"])["share"]
        for name, table in shares.items()
    }

    def percent(table: str, name: str) -> list[str]:
        values = [arc.get(table, {}).get((name, ring), float("nan")) for ring in ("slips", "grips")]
        return ["–" if pd.isna(value) else f"{100 * value:.0f}" for value in values]

    verdicts = judged.set_index(["number", "rig"])["verdict"]
    words = judged.drop_duplicates("number").set_index("number")["sentence"]
    said: dict[str, dict[int, dict]] = {}
    section_of: dict[int, str] = {}
    for (claim, letter), rows in card.fillna({"part": ""}).groupby(["id", "part"], sort=False):
        row = rows.astype(object).fillna("").iloc[0]
        number = int(row["sentence"] or 0)
        label = section_of.setdefault(number or -1 - len(section_of), _label(row["place"]))
        sentence = said.setdefault(label, {}).setdefault(
            number,
            {
                "number": number,
                "sentence": words.get(number, ""),
                "verdicts": [verdicts.get((number, rig), NOT_COMPARABLE) for rig in rows["rig"]],
                "shares": percent("sentences", str(number)),
                "statements": [],
            },
        )
        unit = "" if row["unit"] in ("1", "") else f" ({row['unit']})"
        sentence["statements"].append(
            {
                "id": f"{claim}{letter}",
                "claim": f"{row['claim']}{unit}",
                "printed": _rounded(str(row["printed"])) or "–",
                "measured": [
                    "" if verdict == NOT_COMPARABLE else _rounded(str(value))
                    for value, verdict in zip(rows["measured"].fillna(""), rows["verdict"], strict=True)
                ],
                "difference": _difference(str(row["printed"]), str(row["measured"])),
                "verdicts": list(rows["verdict"]),
                "shares": percent("claims", f"{claim}{letter}"),
                "why": " ".join(
                    filter(
                        None,
                        (
                            row["fails_if"] and f"Fails if {row['fails_if']}.",
                            row["reason"],
                            row["measured"] and row["verdict"] == NOT_COMPARABLE and f"{row['measured']}.",
                        ),
                    )
                ),
            }
        )
    return {label: sorted(rows.values(), key=lambda sentence: sentence["number"] or 99) for label, rows in said.items()}


def _label(place: str) -> str:
    """Figure or table that a place names first: ``Figs. 19, 20`` is Figure 19."""
    named = re.search(r"(Fig|Table)s?\.? (\d+)", place)
    return f"{'Figure' if named[1] == 'Fig' else named[1]} {named[2]}" if named else place


def judged_sentences(judged: pd.DataFrame, rig: str, shares: pd.DataFrame | None = None) -> list[list[str]]:
    """``number, sentence, verdict`` of a rig; with ``shares``, those of plausible tracks with a slipping and a gripping
    ring (%), equal pitch read along the arc.
    """
    rows = judged.loc[judged["rig"] == rig, ["number", "sentence", "verdict"]].astype(str).values.tolist()
    if shares is None:
        return rows
    arc = shares[shares["equal_pitch"] == "arc length"].set_index(["name", "ring"])["share"]
    arc.index = arc.index.set_levels(arc.index.levels[0].astype(str), level=0)
    cells = [[arc.get((row[0], ring), float("nan")) for ring in ("slips", "grips")] for row in rows]
    return [
        row + ["–" if pd.isna(share) else f"{100 * share:.0f}" for share in pair]
        for row, pair in zip(rows, cells, strict=True)
    ]


def statements(card: pd.DataFrame, names: Sequence[str] = tuple(SHORT)) -> pd.DataFrame:
    """Some statements in words: what is printed, and what each rig gives, with a mark (``MARKS``).

    Returns
    -------
    DataFrame
        ``statement, printed``, ``rig <name>`` for each rig, and ``difference`` of the first one.
    """
    card = card.astype(object).fillna("")
    name = card["id"] + card["part"]
    rows = []
    for requested in names:
        parts = card[name == requested].astype(str).set_index("rig")
        if parts.empty:
            continue
        printed = parts["printed"].iloc[0]
        row = {"statement": SHORT[requested], "printed": IN_WORDS.get(requested, printed)}
        for rig, judged in parts.iterrows():
            value = "" if judged["verdict"] == NOT_COMPARABLE else _rounded(judged["measured"])
            row[f"rig {rig}"] = f"{value} {MARKS[judged['verdict']]}".strip()
        row["difference"] = _difference(printed, parts["measured"].iloc[0])
        rows.append(row)
    return pd.DataFrame(
        rows, columns=["statement", "printed", *(f"rig {rig}" for rig in dict.fromkeys(card["rig"])), "difference"]
    ).fillna("–")


def _difference(printed: str, measured: str) -> str:
    """Measured less printed, number by number; a dash where one of them is no list of numbers."""
    try:
        pairs = zip(*(map(float, text.split(",")) for text in (measured, printed)), strict=True)
        return ", ".join(f"{value - reference:+.2g}" for value, reference in pairs)
    except ValueError:
        return "–"


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
