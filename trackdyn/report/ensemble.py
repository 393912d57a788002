"""Writes what an ensemble found: tables, figures, a summary in words."""

from pathlib import Path

import pandas as pd

from trackdyn.inference.ensemble import verdicts
from trackdyn.inference.ensemble.history import judged
from trackdyn.inference.ensemble.ring_choice import CRITERIA, choice_table, recommendation, study_table
from trackdyn.inference.ensemble.stages import CHEAP, LAST, STUDY, Ensemble, read_errors
from trackdyn.inference.verdict import EDGE
from trackdyn.paper.claims import load_claims
from trackdyn.report.figures.ensemble import band_figure, choice_figure, conflict_figure, pairs_figure, pareto_figure
from trackdyn.report.style import save
from trackdyn.sweeps.store import DONE
from trackdyn.sweeps.table import write_table

SHOWN_PAIRS = 6  # unknowns of the pair plot: those that are left least of their ranges


def write_tables(e: Ensemble, claims: Path | str, card: pd.DataFrame) -> str:
    """All tables and the findings in words into the folder of the ensemble; the summary is returned.

    Parameters
    ----------
    card : DataFrame
        The scorecard of the shipped rig (``claims.csv`` of the results).
    """
    shares = verdicts.claims_table(e, load_claims(claims))
    study = study_table(_study(e), verdicts.rank(e)["excluded_by"])
    choices = pd.concat([choice_table(study, rpm).assign(rpm=rpm) for rpm in e.form.speeds_rpm], ignore_index=True)
    scorecard = verdicts.beside(card, shares)
    tables = {
        "rigs": verdicts.rigs_table(e),
        "parameters": verdicts.parameters_table(e),
        "claims": shares,
        "conflicts": verdicts.conflicts(e),
        "pareto": verdicts.pareto(e),
        "ranks": verdicts.rank_indices(e),
        "study": study,
        "choices": choices,
        "scorecard": scorecard,
    }
    for name, table in tables.items():
        write_table(table, e.folder / f"{name}.csv")
    found = _summary(e, tables)
    said = [(finding, "") for finding in found] + [(words, name) for name, words in SHOWN_FILES.items()]
    write_table(pd.DataFrame(said, columns=["finding", "file"]), e.folder / "summary.csv")
    return "\n".join(found)


# what the page on the ensemble shows beside the findings
SHOWN_FILES = {
    "claims.csv": "in how many rigs each claim is reproduced",
    "parameters.csv": "what is left of every range",
    "conflicts.csv": "every pair of claims",
    "pareto.csv": "the rigs nearest to C16 and C17 at once",
    "choices.csv": "every radius of the ring over the rigs",
    "conflicts.png": "How near the best rig comes to two claims at once",
    "fig24_bands.png": "Figure 24 over the rigs",
    "choice.png": "Which radius is best, by four criteria",
}


def _are(count: int) -> str:
    return f"{count} is" if count == 1 else f"{count} are"


def _summary(e: Ensemble, tables: dict[str, pd.DataFrame]) -> list[str]:
    rigs, conflicts, shares = tables["rigs"], tables["conflicts"], tables["claims"]
    every = verdicts.all_judged(e)
    best = every.sort_values(["excluded_by", "loss"]).iloc[0]
    lost = [target.name for target in e.targets if best[target.name] > e.config.cutoff]
    single = list(conflicts.loc[(conflicts["first"] == conflicts["second"]) & conflicts["excluded"], "first"])
    alone = "No rig that was run shows " + ", ".join(single) if single else "Every claim is shown by some rig"
    pairs = conflicts[conflicts["excluded"] & ~conflicts["first"].isin(single) & ~conflicts["second"].isin(single)]
    couples = ", ".join(f"{a} and {b}" for a, b in zip(pairs["first"], pairs["second"], strict=True))
    both = conflicts[(conflicts["first"] == "C16") & (conflicts["second"] == "C17")].iloc[0]
    apart = "no rig shows both" if both["excluded"] else f"rig {both['rig']} of `rigs.csv` shows both"
    fewest = []
    for wave in e.waves:
        ranked = judged(e.config, e.targets, e.outputs(wave), read_errors(e), cheap=True)
        fewest.append(f"{ranked['excluded_by'].min():.0f}" if len(ranked) else "none that came out whole")
    known = tables["parameters"].loc[tables["parameters"]["identifiable"].astype(bool), "name"]
    few = f"{_are(len(rigs))} too few to say which parameters the printed numbers identify"
    told = f"Parameters that the printed numbers identify: {', '.join(known) or 'none'}"
    held = shares[(shares["rigs"] > 0) & (shares["used"] == "held out")]
    names = held["id"] + held["part"].fillna("")
    lines = [
        f"Of {len(every)} rigs of which every run came out "
        f"{_are(int((every['excluded_by'] == 0).sum()))} excluded by no target "
        f"(cutoff {e.config.cutoff:g}). {len(rigs)} were run at full fidelity; of these "
        f"{_are(int((rigs['excluded_by'] == 0).sum()))}.",
        f"The least excluded rig misses {int(best['excluded_by'])} of {len(e.targets)} targets: "
        f"{', '.join(lost) or 'none'}.",
        f"The fewest exclusions of a rig, wave by wave: {', '.join(fewest)}, and "
        f"{int(rigs['excluded_by'].min())} in the last one; as long "
        "as that falls, more waves may find better rigs, and what no rig shows is said of the rigs that were run.",
        f"{alone}. Pairs of claims that rigs show one by one, and no rig together: {couples or 'none'}.",
        "C16 against C17: the nearest that any rig comes to both is an implausibility of "
        f"{both['least']:.3g}: {apart}.",
        f"{few if len(rigs) < 1 / EDGE else told}.",  # a twentieth of fewer rigs is none
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
    save(
        band_figure(done, "rms_n", "RMS of the normal force (N)", "Figure 23 (a) over the rigs", shipped),
        e.folder / "fig23_bands.png",
    )
    save(
        band_figure(done, "share_pct", "contact duration (% of a turn)", "Figure 24 over the rigs", shipped),
        e.folder / "fig24_bands.png",
    )
    every = verdicts.all_judged(e)
    save(conflict_figure(verdicts.conflicts(e), e.config.cutoff), e.folder / "conflicts.png")
    save(pareto_figure(verdicts.group_worst(e, every), verdicts.pareto(e), e.config.cutoff), e.folder / "pareto.png")
    parameters = verdicts.parameters_table(e).dropna(subset="remaining").sort_values("remaining")
    names = list(parameters["name"].head(SHOWN_PAIRS))
    save(pairs_figure(e.read(f"points_{LAST}"), e.read("points_1"), names), e.folder / "pairs.png")
    rpm = min(e.form.speeds_rpm)
    save(
        choice_figure(choice_table(study_table(runs, verdicts.rank(e)["excluded_by"]), rpm), rpm),
        e.folder / "choice.png",
    )
