"""The scorecard of a rig, counted and as text."""

from trackdyn.sweeps.snakemake_job import run_job

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pandas as pd

from trackdyn.inputs.files import write_csv
from trackdyn.measure.columns import listed, significant
from trackdyn_replication.paper import claims
from trackdyn_replication.paper.claims import GROUPS, INDEPENDENT, JUDGED, MET, NOT_COMPARABLE, NOT_MET, VERDICTS
from trackdyn_replication.paper.evidence import collect
from trackdyn_replication.paper.published import load_cells
from trackdyn_replication.paper.tracks import RING_VELOCITY, creep_slope, mobilised, percents, track_rows

RADIUS = "C26a"  # of the ring to choose
CONCLUSION = r"^Conclusion (\d)"  # numbered by the paper, in Sect. 6.2; two sentences may be one of them
MARKS = dict(zip(VERDICTS, ("●", "○", "◇", "–"), strict=True))


def sentence_verdicts(card: pd.DataFrame, sentences: Mapping[int, str]) -> pd.DataFrame:
    """Judge sentences of the paper as a whole: shown where all of their statements are, with those that decide."""
    rows = []
    for number, parts in card.dropna(subset="sentence").groupby("sentence"):
        lost = parts[parts["verdict"] == NOT_MET]
        verdicts = set(parts["verdict"])
        verdict = NOT_MET if len(lost) else min(verdicts - {MET}, default=MET)
        deciding = ", ".join(_names(lost if len(lost) else parts))
        rows.append([parts["rig"].iloc[0], int(number), sentences[int(number)], verdict, deciding])
    return pd.DataFrame(rows, columns=["rig", "number", "sentence", "verdict", "statements"])


def _names(card: pd.DataFrame) -> pd.Series:
    """Return the names of the statements of a scorecard: ``C16b``."""
    return card["id"] + card["part"].fillna("")


def _records(card: pd.DataFrame) -> list[dict]:
    """Return the rows of a scorecard with their names, empty cells as text."""
    return card.assign(name=_names(card)).astype(object).fillna("").to_dict("records")


def count(judged: pd.DataFrame) -> tuple[int, int]:
    """Count the sentences that are shown, and those that are judged (`sentence_verdicts`)."""
    return int((judged["verdict"] == MET).sum()), int(judged["verdict"].isin(JUDGED).sum())


def number_count(numbers: pd.DataFrame, group: str = INDEPENDENT) -> str:
    """Count of the printed numbers of a group that a rig meets within their tolerance (`claims.printed_numbers`)."""
    rows = numbers[numbers["group"] == group]
    return f"{int(rows['met'].astype(bool).sum())} of {len(rows)} {GROUPS[group]}"


def other_numbers(numbers: pd.DataFrame) -> str:
    """Count the printed numbers that depend on others, or are no number of the paper's."""
    groups = set(numbers["group"]) - {INDEPENDENT}
    return listed([number_count(numbers, group) for group in GROUPS if group in groups])


def missed_numbers(numbers: pd.DataFrame) -> str:
    """Return the independent printed numbers that are not met, with their values here and as printed."""
    missed = numbers[(numbers["group"] == INDEPENDENT) & ~numbers["met"].astype(bool)]
    texts = []
    for row in missed.astype(object).fillna("").itertuples():
        unit = "" if row.unit == "1" else f" {row.unit}"
        texts.append(f"{row.claim} ({_span(str(row.measured))}, printed {row.printed}{unit})")
    return "; ".join(texts) or "none"


def _span(text: str) -> str:
    """Round numbers to three digits; word ranges of several speeds as one, from the smallest number to the largest."""
    if ";" not in text:
        return _rounded(text)
    numbers = [float(number) for number in re.findall(r"\d+(?:\.\d+)?", text)]
    return _rounded(f"{min(numbers)} to {max(numbers)}")


def number_rows(numbers: pd.DataFrame) -> list[dict]:
    """Return the rows of a table of printed numbers: ``number, group, printed, here, tolerance, met``."""
    rows = []
    for row in numbers.astype(object).where(numbers.notna(), "").to_dict("records"):
        unit = "" if row["unit"] == "1" else f" {row['unit']}"
        rows.append({
            "number": row["claim"], "group": row["group"], "printed": str(row["printed"]), "here": str(row["measured"]),
            "tolerance": "as it reads" if row["tolerance"] == "" else f"± {row['tolerance']:g}{unit}",
            "met": MARKS[MET if row["met"] else NOT_MET],
        })  # fmt: skip
    return rows


def verdict_line(judged: pd.DataFrame, numbers: pd.DataFrame) -> str:
    """Return the counts of a rig, printed numbers first."""
    (sentences, total), by_number = count(judged), _conclusions(judged)
    met = [number for number, rows in by_number if set(rows["verdict"]) == {MET}]
    which = f" (no. {listed(met)})" if met else ""
    counts = f"{sentences} of {total} sentences and {len(met)} of {len(by_number)} conclusions{which}"
    return f"{number_count(numbers)}, {counts}"


def conclusion_table(judged: pd.DataFrame, grips: pd.DataFrame, tracks: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the conclusions on the ring: marks of a rig and of one that grips, and shares of sampled tracks."""
    gripping, shares, rows = grips.set_index("number")["verdict"], track_rows(tracks), {}
    for number, sentences in _conclusions(judged):
        for row in sentences.itertuples():
            words = f"{number}. {row.sentence.partition(': ')[2]}"
            marks = MARKS[row.verdict], MARKS[gripping.get(row.number, NOT_COMPARABLE)]
            rows[row.number] = [words, *marks, *percents(shares, str(row.number))]
    heads = ["conclusion on the ring", f"rig {judged['rig'].iloc[0]}", "rig with rubber's friction"]
    heads += ["% of tracks that mesh as printed", "% of all tracks"]
    return pd.DataFrame.from_dict(rows, orient="index", columns=heads)


def failed_rows(card: pd.DataFrame, judged: pd.DataFrame) -> list[dict]:
    """Return the sentences that are not met, each with the statements that decide it (`_statement`)."""
    rows = []
    for sentence in judged[judged["verdict"] == NOT_MET].itertuples():
        of_it = card[(card["sentence"] == sentence.number) & (card["verdict"] == NOT_MET)]
        statements = [_statement(row) for row in _records(of_it)]
        rows.append({"number": sentence.number, "sentence": sentence.sentence, "statements": statements})
    return rows


def _conclusions(judged: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Group sentences by the number of their conclusion."""
    return list(judged.groupby(judged["sentence"].str.extract(CONCLUSION, expand=False)))


def outside_sentence(parameters: pd.DataFrame, rig: str, of_ring: pd.DataFrame | None = None) -> str:
    """Word the fitted values, and those outside of their ranges; with the ring's velocity its mobilised friction."""
    outside = parameters[parameters["outside"].notna() & (parameters["outside"] != "")]
    cells = []
    for name, value, unit, low, high in outside[["name", "value", "unit", "low", "high"]].itertuples(index=False):
        cell = f"{re.sub('[._]', ' ', name)} {significant(float(value), 3)} {unit}"
        if name == RING_VELOCITY and of_ring is not None:
            cell += f", {mobilised(of_ring, creep_slope(parameters))}"
        cells.append(f"{cell} (assumed: {low:g} to {high:g})")
    kinds = parameters["kind"].value_counts()
    fitted, known = kinds.get("fitted", 0), kinds.get("printed", 0) + kinds.get("derived", 0)
    count = f"{known} of the {len(parameters)} parameters of the rig `{rig}`"
    text = f"The paper prints or implies {count}; {fitted} are fitted."
    return f"{text} Values outside of the assumed ranges: {'; '.join(cells)}." if cells else text


def statements_by_label(
    card: pd.DataFrame, judged: pd.DataFrame, shares: Mapping[str, pd.DataFrame]
) -> dict[str, list[dict]]:
    """Return the paper's statements by label of figure or table, in their sentences; those without one come last."""
    card = card[~_waits(card)]
    tracks = {name: track_rows(shares[name]) for name in ("sentences", "claims") if name in shares}
    sentences = judged.set_index("number")
    groups: dict[str, dict[int, dict]] = {}
    labels: dict[int, str] = {}  # a sentence is where its first statement is
    for position, row in enumerate(_records(card)):
        number = int(row["sentence"] or 0)
        named = re.search(r"(Fig|Table)s?\.? (\d+)", row["place"])  # the first: ``Figs. 19, 20`` is Figure 19
        heading = f"{'Figure' if named[1] == 'Fig' else named[1]} {named[2]}" if named else row["place"]
        label = labels.setdefault(number or -1 - position, heading)
        whole = {
            "number": number,
            "sentence": sentences["sentence"].get(number, ""),
            "verdict": sentences["verdict"].get(number, NOT_COMPARABLE),
            "shares": percents(tracks.get("sentences"), str(number)),
            "statements": [],
        }
        sentence = groups.setdefault(label, {}).setdefault(number, whole)
        sentence["statements"].append(_statement(row) | {"shares": percents(tracks.get("claims"), row["name"])})
    return {label: sorted(rows.values(), key=lambda row: row["number"] or 99) for label, rows in groups.items()}


def _waits(card: pd.DataFrame) -> pd.Series:
    """Return a mask of the statements that lack cells of the article's tables."""
    return (card["verdict"] == NOT_COMPARABLE) & card["place"].str.startswith("Table")


def waiting_sentence(card: pd.DataFrame) -> str:
    """Word the statements that lack cells of the article's tables; empty if none does."""
    names = [*_names(card[_waits(card)])]
    waits = f"{len(names)} statements ({', '.join(names)}) wait for cells of Tables 2 to 4, which our text lacks; "
    return waits + "`config/article.csv` takes those of Table 3." if names else ""


def _statement(row: Mapping) -> dict:
    """Return a row of the scorecard as text."""
    unit = "" if row["unit"] in ("1", "") else f" ({row['unit']})"
    lost = row["verdict"] == NOT_COMPARABLE
    why = (
        row["fails_if"] and f"Fails if {row['fails_if']}.",
        row["reason"],
        f"{row['measured']}." if row["measured"] and lost else "",
    )
    return {
        "id": row["name"],
        "claim": f"{row['claim']}{unit}",
        "printed": _rounded(str(row["printed"])) or "–",
        "measured": "" if lost else _rounded(str(row["measured"])),
        "difference": _difference(str(row["printed"]), str(row["measured"])),
        "verdict": row["verdict"],
        "why": " ".join(filter(None, why)),
    }


def _difference(printed: str, measured: str) -> str:
    """Subtract printed from measured, number by number; a dash where one of them is no list of numbers."""
    try:
        pairs = zip(*(map(float, text.split(",")) for text in (measured, printed)), strict=True)
        return ", ".join(f"{value - reference:+.2g}" for value, reference in pairs)
    except ValueError:
        return "–"


def _rounded(text: str) -> str:
    """Round the numbers of a text to three significant digits, those of a fit; a range without width is one number."""
    rounded = re.sub(r"\d+\.\d+", lambda number: significant(float(number[0])), text)
    return re.sub(r"\b(\S+) to \1(?![\d.])", r"\1", rounded)


@run_job
def main(job) -> None:
    """Rule `claims`."""
    params, output, path = job.params, job.output, job.input.claims
    evidence = collect(Path(job.input.metrics).parent, params.rpm, params.rounded)
    if job.input.cells:
        evidence = replace(evidence, cells=load_cells(job.input.cells[0]))
    statements = claims.load_claims(path)
    card = claims.judge_all(statements, evidence, params.rig)
    write_csv(output.csv, card)
    write_csv(output.sentences, sentence_verdicts(card, claims.load_sentences(path)))
    write_csv(output.numbers, claims.printed_numbers(statements, evidence, params.rig))
