"""Writes what an ensemble found: tables, figures, a summary in words."""

from pathlib import Path

import pandas as pd

from trackdyn.inference import verdicts
from trackdyn.inference.ring_choice import CRITERIA, choice_table, recommendation, study_table
from trackdyn.inference.stages import LAST, STUDY, Ensemble
from trackdyn.paper.claims import load_claims
from trackdyn.report.figures.ensemble import band_figure, choice_figure, conflict_figure, pairs_figure, pareto_figure
from trackdyn.report.style import save
from trackdyn.sweeps.row import DONE
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
    study = study_table(e.runs(STUDY))
    choices = pd.concat([choice_table(study, rpm).assign(rpm=rpm) for rpm in e.form.speeds_rpm], ignore_index=True)
    scorecard = verdicts.beside(card, shares)
    tables = {
        "rigs": verdicts.rigs_table(e), "parameters": verdicts.parameters_table(e), "claims": shares,
        "conflicts": verdicts.conflicts(e), "pareto": verdicts.pareto(e), "ranks": verdicts.rank_indices(e), "study": study,
        "choices": choices, "scorecard": scorecard,
    }  # fmt: skip
    for name, table in tables.items():
        write_table(table, e.folder / f"{name}.csv")
    found = _summary(e, tables)
    write_table(pd.DataFrame({"finding": found}), e.folder / "summary.csv")
    return "\n".join(found)


def _summary(e: Ensemble, tables: dict[str, pd.DataFrame]) -> list[str]:
    rigs, conflicts, shares = tables["rigs"], tables["conflicts"], tables["claims"]
    every = verdicts.all_judged(e)
    allowed = int((every["excluded_by"] == 0).sum())
    best = every.sort_values(["excluded_by", "loss"]).iloc[0]
    lost = [target.name for target in e.targets if best[target.name] > e.config.cutoff]
    alone = conflicts[conflicts["first"] == conflicts["second"]]
    pairs = conflicts[(conflicts["first"] != conflicts["second"]) & conflicts["excluded"]]
    single = set(alone.loc[alone["excluded"], "first"])
    real = pairs[~pairs["first"].isin(single) & ~pairs["second"].isin(single)]
    both = conflicts[(conflicts["first"] == "C16") & (conflicts["second"] == "C17")]["least"].iloc[0]
    parameters = tables["parameters"]
    known = parameters.loc[parameters["identifiable"].astype(bool), "name"]
    judged_claims = shares[shares["rigs"] > 0]
    held = judged_claims[judged_claims["used"] == "held out"]
    lines = [
        f"Of {len(every)} rigs that came out in the waves {allowed} are excluded by no target (cutoff {e.config.cutoff:g}); "
        f"{len(rigs)} were run at full fidelity, of which {int((rigs['excluded_by'] == 0).sum())} are excluded by none.",
        f"The least excluded rig misses {int(best['excluded_by'])} of {len(e.targets)} targets: {', '.join(lost) or 'none'}.",
        f"No rig shows {', '.join(sorted(single)) or 'any one claim less'} at all; pairs of claims that no rig shows together though "
        f"rigs show each alone: {', '.join(f'{a} and {b}' for a, b in zip(real['first'], real['second'], strict=True)) or 'none'}.",
        f"C16 against C17: the nearest any rig comes to both is an implausibility of {both:.3g}.",
        f"Identifiable parameters: {', '.join(known) or 'none'}.",
        verdicts.position_of_shipped(e),
        "Held-out claims that hold in every rig of the study: "
        + (", ".join(held.loc[held["share"] == 1, "id"] + held.loc[held["share"] == 1, "part"].fillna("")) or "none")
        + "; in none: " + (", ".join(held.loc[held["share"] == 0, "id"] + held.loc[held["share"] == 0, "part"].fillna("")) or "none") + ".",
    ]  # fmt: skip
    for rpm, table in tables["choices"].groupby("rpm"):
        lines += [f"{rpm:g} rpm, by {name}: {recommendation(table, name)}." for name in CRITERIA]
    return lines


def write_figures(e: Ensemble, metrics: pd.DataFrame) -> None:
    """All figures into the folder of the ensemble; ``metrics`` is ``metrics.csv`` of the shipped rig."""
    runs = e.runs(STUDY)
    done = runs[runs["state"] == DONE]
    done = done.assign(rig=done["name"].str.partition(" ")[0].astype(int))
    shipped = metrics[metrics["run"].str.startswith("ring/")]
    save(
        band_figure(done, "rms_n", "RMS of the normal force (N)", "Figure 23 (a) over the rigs", shipped),
        e.folder / "fig23_bands.png",
    )
    save(
        band_figure(done, "share_pct", "share of a sprocket turn (%)", "Figure 24 over the rigs", shipped),
        e.folder / "fig24_bands.png",
    )
    every = verdicts.all_judged(e)
    save(conflict_figure(verdicts.conflicts(e), e.config.cutoff), e.folder / "conflicts.png")
    save(pareto_figure(verdicts.group_worst(e, every), verdicts.pareto(e), e.config.cutoff), e.folder / "pareto.png")
    parameters = verdicts.parameters_table(e).dropna(subset="remaining").sort_values("remaining")
    names = list(parameters["name"].head(SHOWN_PAIRS))
    save(pairs_figure(e.read(f"points_{LAST}"), e.read("points_1"), names), e.folder / "pairs.png")
    rpm = min(e.form.speeds_rpm)
    save(choice_figure(choice_table(study_table(runs), rpm), rpm), e.folder / "choice.png")
