"""Writes what an ensemble found: tables, figures, a summary in words."""

from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.inference.ensemble import verdicts
from laboratory.inference.ensemble.conflicts import CONFLICT, FOUND, OPEN, SHOWN
from laboratory.inference.ensemble.history import judged
from laboratory.inference.ensemble.ring_choice import CRITERIA, choice_table, recommendation, study_table
from laboratory.inference.ensemble.stages import CHEAP, FIRST, LAST, LOCAL, SHIPPED_RIG, STUDY, Ensemble, read_errors
from laboratory.inference.verdict import EDGE
from laboratory.report.figures.ensemble import band_figure, choice_figure, conflict_figure, pairs_figure, pareto_figure
from replication.paper.claims import load_claims
from trackdyn.plots.style import save
from trackdyn.sweeps.store import DONE
from trackdyn.sweeps.table import write_table

SHOWN_PAIRS = 6  # unknowns of the pair plot: those that are left least of their ranges


def write_tables(e: Ensemble, claims: Path | str, card: pd.DataFrame) -> str:
    """All tables and the findings in words into the folder of the ensemble; the summary is returned.

    ``card`` is the scorecard of the shipped rig.
    """
    shares = verdicts.claims_table(e, load_claims(claims))
    study = study_table(_study(e), verdicts.rank(e)["excluded_by"])
    choices = pd.concat([choice_table(study, rpm).assign(rpm=rpm) for rpm in e.form.speeds_rpm], ignore_index=True)
    scorecard = verdicts.with_default(card, shares, "possible")
    tables = {
        "rigs": verdicts.rigs_table(e), "parameters": verdicts.parameters_table(e), "claims": shares,
        "pareto": verdicts.pareto_rigs(e), "ranks": verdicts.rank_indices(e), "study": study, "choices": choices,
        "scorecard": scorecard,
    }  # fmt: skip
    for name, table in tables.items():
        write_table(table, e.folder / f"{name}.csv")
    found = _summary(e, tables | {"conflicts": e.read("conflicts")})
    message = [(finding, "") for finding in found] + [(words, name) for name, words in SHOWN_FILES.items()]
    write_table(pd.DataFrame(message, columns=["finding", "file"]), e.folder / "summary.csv")
    return "\n".join(found)


# what the page on the ensemble shows beside the findings
SHOWN_FILES = {
    "claims.csv": "in how many rigs each claim is reproduced",
    "parameters.csv": "what is left of every range",
    "rigs.csv": "the rigs of the last wave, the least excluded first, with the targets that each misses",
    "conflicts.csv": "every claim and pair of claims, and sets of three of which all pairs are shown",
    "pareto.csv": "the rigs nearest to C16 and C17 at once",
    "choices.csv": "every radius of the ring over the rigs",
    "conflicts.png": "How near the best rig comes to two claims at once",
    "fig24_bands.png": "Figure 24 over the rigs",
    "choice.png": "Which radius is best, by four criteria",
}


def _are(count: int) -> str:
    return f"{count} is" if count == 1 else f"{count} are"


def _least(counts: pd.Series) -> str:
    return f"{counts.min():.0f}" if len(counts) else "none"


def _summary(e: Ensemble, tables: dict[str, pd.DataFrame]) -> list[str]:
    rigs, conflicts, shares = tables["rigs"], tables["conflicts"], tables["claims"]
    every = verdicts.all_judged(e)
    best = every.sort_values(["excluded_by", "loss"]).iloc[0]
    lost = verdicts.missed_targets(e, best)
    searched = conflicts[conflicts["verdict"] == CONFLICT].fillna({"search": np.inf})
    together = ", ".join(
        f"{row.claims.replace(' ', ' with ')} ({min(row.sample, row.search):.3g})" for row in searched.itertuples()
    )
    verdict = conflicts["verdict"].value_counts()
    both = conflicts.set_index("claims").loc["C16 C17"]
    nearest = "the shipped rig" if both["sample_rig"] == SHIPPED_RIG else f"rig {both['sample_rig']}"
    ends = rigs[rigs["rig"].between(FIRST[LOCAL], FIRST[LAST] - 1)]["excluded_by"]
    others = rigs[~rigs.index.isin(ends.index)]["excluded_by"]
    fewest = []
    for wave in e.waves:
        ranked = judged(e.config, e.targets, e.outputs(wave), read_errors(e), cheap=True)
        fewest.append(f"{ranked['excluded_by'].min():.0f}" if len(ranked) else "none that came out whole")
    known = tables["parameters"].loc[tables["parameters"]["identifiable"].astype(bool), "name"]
    few = f"{_are(len(rigs))} too few to say which parameters the printed numbers identify"
    identified = f"Parameters that the printed numbers identify: {', '.join(known) or 'none'}"
    held = shares[(shares["rigs"] > 0) & (shares["used"] == "held out")]
    names = held["id"] + held["part"].fillna("")
    lines = [
        f"Of {len(every)} rigs of which every run came out "
        f"{_are(int((every['excluded_by'] == 0).sum()))} excluded by no target "
        f"(cutoff {e.config.cutoff:g}). {len(rigs)} were run at full fidelity; of these "
        f"{_are(int((rigs['excluded_by'] == 0).sum()))}.",
        f"The least excluded rig misses {int(best['excluded_by'])} of {len(e.targets)} targets: "
        f"{', '.join(lost) or 'none'}.",
        f"The fewest exclusions of a rig: {', '.join(fewest)} in the waves, {_least(ends)} where local searches end, "
        f"{_least(others)} among the other rigs of the last wave, the last two at full fidelity. More searches may "
        "find better rigs.",
        "Minimal sets of claims that neither a rig that was run shows nor a search that is aimed at the set, each with "
        f"its nearest approach: {together or 'none'}. Of the other sets, rigs that were run show "
        f"{verdict.get(SHOWN, 0)}, and aimed searches found a rig for {verdict.get(FOUND, 0)}; {verdict.get(OPEN, 0)} "
        "were not searched.",
        "C16 and C17 at once: the nearest approach of a rig that was run is an implausibility of "
        f"{both['sample']:.3g} ({nearest}).",
        f"{few if len(rigs) < 1 / EDGE else identified}.",  # a twentieth of fewer rigs is none
        verdicts.position_of_shipped(e),
        f"Held-out claims that hold in each of {int(held['rigs'].max()) if len(held) else 0} rigs: "
        f"{', '.join(names[held['share'] == 1]) or 'none'}; in none of them: "
        f"{', '.join(names[held['share'] == 0]) or 'none'}.",
    ]
    for rpm, table in tables["choices"].groupby("rpm"):
        lines += [f"{rpm:g} rpm, by `{name}`: {recommendation(table, name)}." for name in CRITERIA]
    return lines


def _study(e: Ensemble) -> pd.DataFrame:
    """Runs of the study at the speeds at which there is every radius."""
    runs = e.runs(STUDY)[CHEAP]
    return runs[runs["rpm"].isin(e.form.speeds_rpm)]


def write_figures(e: Ensemble, metrics: pd.DataFrame) -> None:
    """All figures into the folder of the ensemble; ``metrics`` is ``metrics.csv`` of the shipped rig."""
    runs = _study(e)
    done = runs[runs["state"] == DONE]
    done = done.assign(rig=done["name"].str.partition(" ")[0].astype(int))
    shipped = metrics[metrics["run"].str.startswith("ring/")]
    for number, part, column, unit in (
        ("23", " (a)", "rms_n", "RMS of the normal force (N)"),
        ("24", "", "share_pct", "contact duration (% of a turn)"),
    ):
        figure = band_figure(done, column, unit, f"Figure {number}{part} over the rigs", shipped)
        save(figure, e.folder / f"fig{number}_bands.png")
    every = verdicts.all_judged(e)
    save(conflict_figure(e.read("conflicts"), e.config.cutoff), e.folder / "conflicts.png")
    worst, front = verdicts.group_worst(e, every), verdicts.pareto_rigs(e)
    save(pareto_figure(worst, front, e.config.cutoff), e.folder / "pareto.png")
    parameters = verdicts.parameters_table(e).dropna(subset="remaining").sort_values("remaining")
    names = list(parameters["name"].head(SHOWN_PAIRS))
    save(pairs_figure(e.read(f"points_{LAST}"), e.read("points_1"), names), e.folder / "pairs.png")
    rpm = min(e.form.speeds_rpm)
    table = choice_table(study_table(runs, verdicts.rank(e)["excluded_by"]), rpm)
    save(choice_figure(table, rpm), e.folder / "choice.png")
