"""What the rigs of an ensemble say together: claims, parameters, targets that exclude each other."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy.stats import binomtest, kstest, spearmanr

from laboratory.inference.ensemble.history import columns_of, events_of, judged
from laboratory.inference.ensemble.stages import CHEAP, COMPARED, LAST, STUDY, Ensemble, rank, read_errors, stage_cases
from laboratory.inference.ensemble.waves import by_case, rig_at
from laboratory.inference.targets import Case
from laboratory.inference.verdict import CHOSEN, IDENTIFIED, verdict
from replication.paper.claims import JUDGED, REPRODUCED, Claim, judge
from replication.paper.evidence import Evidence
from trackdyn.parameters.rig import Rig, load_rig

# what a run with every link says in place of a record of 90 s, by the names of the latter
RECORDED = {"rpm": "rpm", "rms_g": "whole_rms", "sd_g": "whole_sd", "high_frequency_g": "whole_high_frequency"}


def evidence(e: Ensemble, rows: dict[str, pd.Series], rig: Rig, reading: str) -> Evidence:
    """What a rig's runs of the study say, as claims are judged by it.

    Records stand for those of 90 s by statistics over all links; there is no spectrum, and how well a loop closes is
    the step's.
    """
    passage = rig.loop_period(e.config.speed_rpm) / rig.chain.pitches
    metrics, events = [], []
    rings = {"no_ring": None, "ring": e.config.ring_radius_m}
    meshing = {Case(e.config.speed_rpm, ring).name: name for name, ring in rings.items()}
    records = {Case(rpm, e.config.ring_radius_m).name for rpm in e.form.records_rpm}
    for case, row in rows.items():
        speed, ring = case.split(" ")
        if case in records:
            metrics.append({"run": f"{speed}rpm", **{name: row.get(of) for name, of in RECORDED.items()}})
        if float(speed) not in e.form.speeds_rpm:
            continue
        metrics.append({"run": f"ring/{speed}rpm_{ring}", **row})
        if case in meshing:
            metrics.append({"run": f"meshing/{meshing[case]}", **row})
            events += [
                {"run": f"meshing/{meshing[case]}", "event": name, "mean_s": seconds}
                for name, seconds in events_of(row, reading, passage).items()
            ]
    table = pd.DataFrame(events, columns=["run", "event", "mean_s"])
    return Evidence(pd.DataFrame(metrics), table, rig, e.config.speed_rpm, e.config.ring_radius_m)


def claims_table(e: Ensemble, claims: Sequence[Claim]) -> pd.DataFrame:
    """For every claim the share of rigs of the study in which it is reproduced.

    Returns
    -------
    DataFrame
        ``id, part, claim, origin, used`` (target, held out, or neither), ``rigs`` (in which it could be judged),
        ``reproduced``, ``share``, and where no target excludes any of these rigs ``share_low, share_high`` (exact 95 %
        interval for a draw of so many rigs); a share of excluded rigs is a count and estimates nothing.
    """
    ranked = rank(e)
    readings, points = ranked["reading"], e.read(f"points_{STUDY}").set_index("rig")
    runs, cases = by_case(e.runs(STUDY)[CHEAP]), stage_cases(e, STUDY)
    complete = {rig: rows for rig, rows in runs.items() if len(rows) == len(cases)}
    all_evidence = {
        rig: evidence(e, rows, rig_at(e.unknowns, points.loc[rig]), readings[rig]) for rig, rows in complete.items()
    }
    passing = bool(complete) and bool((ranked.loc[list(complete), "excluded_by"] == 0).all())
    targets = {target.claim for target in e.config.targets}
    rows = []
    for claim in claims:
        found = [judge(claim, one).verdict for one in all_evidence.values()]
        counted = [one for one in found if one in JUDGED]
        good = sum(one == REPRODUCED for one in counted)
        held = any(claim.name.startswith(name) for name in e.config.held_out)
        used = "target" if claim.name in targets else "held out" if held else ""
        row = {"id": claim.id, "part": claim.part, "claim": claim.claim, "origin": claim.origin or "", "used": used}
        row |= {"rigs": len(counted), "reproduced": good}
        row |= {"share": good / len(counted) if counted else np.nan, "share_low": np.nan, "share_high": np.nan}
        if counted and passing:
            interval = binomtest(good, len(counted)).proportion_ci(method="exact")
            row |= {"share_low": interval.low, "share_high": interval.high}
        rows.append(row)
    return pd.DataFrame(rows)


def rigs_table(e: Ensemble) -> pd.DataFrame:
    """Rigs of the last wave with the targets that each misses and values of all unknowns, the ones that fewest targets
    exclude first.
    """
    ranked, points = rank(e), e.read(f"points_{LAST}").set_index("rig")
    values = [e.unknowns.values(points.loc[rig, e.unknowns.labels].to_numpy(dtype=float)) for rig in ranked.index]
    missed = [", ".join(missed_targets(e, row)) for _, row in ranked.iterrows()]
    head = ranked[["excluded_by", "worst", "loss", "reading"]].assign(missed=missed)
    return pd.concat([head.reset_index(), pd.DataFrame(values)], axis=1)


def missed_targets(e: Ensemble, row: pd.Series) -> list[str]:
    """Targets by which a rig is excluded, of its row of implausibilities (`history.judged`)."""
    return [target.name for target in e.targets if row[target.name] > e.config.cutoff]


def parameters_table(e: Ensemble) -> pd.DataFrame:
    """Every unknown: what it could be, and what it is in the rigs of the study.

    Returns
    -------
    DataFrame
        ``name, low, high, source``; ``q05, median, q95`` of the rigs (for a choice the share of each alternative in
        ``alternatives``); ``remaining``: width from 5 to 95 % over 0.9 of the range in the scale of the unknown;
        ``p_value`` of the hypothesis that the rigs are drawn from the whole range (Kolmogorov, Smirnov);
        ``identifiable`` (`inference.verdict`); ``shipped`` and whether the shipped rig's is ``outside`` the range.
    """
    x = e.read(f"points_{STUDY}")[e.unknowns.labels]
    shipped = e.unknowns.of_rig(load_rig(e.rig))
    rows = []
    for unknown in e.unknowns.unknowns:
        at = x[unknown.label].to_numpy()
        row = {"name": unknown.label, "source": unknown.source, "p_value": float(kstest(at, "uniform").pvalue)}
        if unknown.discrete:
            counts = pd.Series([unknown.value(one) for one in at]).value_counts(normalize=True)
            row["alternatives"] = ", ".join(f"{name} {counts.get(name, 0.0):.2f}" for name in unknown.choices)
            row["identifiable"] = bool(counts.max() > CHOSEN)
        else:
            q = np.quantile(at, [0.05, 0.5, 0.95])
            row |= {"low": unknown.intervals[0][0], "high": unknown.intervals[-1][1]}
            row |= dict(zip(("q05", "median", "q95"), map(unknown.value, q), strict=True))
            row |= {"remaining": min((q[2] - q[0]) / 0.9, 1.0), "shipped": shipped[unknown.label]}
            row["identifiable"] = verdict(at).word == IDENTIFIED
            row["outside"] = bool(np.isnan(unknown.position(shipped[unknown.label])))
        rows.append(row)
    columns = [
        "name", "low", "high", "q05", "median", "q95", "remaining", "p_value", "identifiable", "shipped", "outside",
        "alternatives", "source",
    ]  # fmt: skip
    return pd.DataFrame(rows).reindex(columns=columns)


def all_judged(e: Ensemble) -> pd.DataFrame:
    """Implausibilities of every rig that was run, by the cheap fidelity in the waves and the full one in the last."""
    known = read_errors(e)
    parts = [judged(e.config, e.targets, e.outputs(name), known, cheap=True) for name in (COMPARED, *e.waves)]
    last = judged(e.config, e.targets, e.outputs(LAST), known, cheap=False)
    return pd.concat([*(part[~part.index.isin(last.index)] for part in parts), last])


def all_points(e: Ensemble) -> pd.DataFrame:
    """Points of every rig of the waves and the last one, by rig."""
    tables = [e.read(f"points_{name}") for name in (COMPARED, *e.waves, LAST)]
    return pd.concat(tables).drop_duplicates("rig").set_index("rig")


def group_worst(e: Ensemble, table: pd.DataFrame) -> pd.DataFrame:
    """(rigs, claims) largest implausibility among the targets of each claim."""
    groups = dict.fromkeys(target.group for target in e.targets)
    return pd.DataFrame({g: table[[t.name for t in e.targets if t.group == g]].max(axis=1) for g in groups})


def pareto_rigs(e: Ensemble, first: str = "C16", second: str = "C17") -> pd.DataFrame:
    """Rigs of which no other is nearer to both of two claims: worst implausibility by each, and what the rig is.

    Returns
    -------
    DataFrame
        Sorted by ``first``; with seat depth, clearance of the seat (r3 less the arc's radius), ring radius less
        equal-pitch radius (m), and every choice.
    """
    worst = group_worst(e, all_judged(e))[[first, second]].sort_values([first, second])
    best = worst[second].cummin().shift(fill_value=np.inf)
    front = worst[worst[second] < best]
    front = front[np.isfinite(front).all(axis=1)]
    points, rows = all_points(e), []
    for rig, row in front.iterrows():
        built = rig_at(e.unknowns, points.loc[rig])
        values = e.unknowns.values(points.loc[rig, e.unknowns.labels].to_numpy(dtype=float))
        rows.append({
            "rig": rig, first: row[first], second: row[second], "seat_depth_m": built.groove.seat_depth,
            "seat_clearance_m": built.groove.r3 - built.chain.connector_radius,
            "ring_less_equal_pitch_m": e.config.ring_radius_m - built.sprocket.equal_pitch_radius,
            **{unknown.label: values[unknown.label] for unknown in e.unknowns.unknowns if unknown.discrete},
        })  # fmt: skip
    return pd.DataFrame(rows)


def with_default(card: pd.DataFrame, shares: pd.DataFrame, rig: str = "shipped") -> pd.DataFrame:
    """The scorecard of one rig with the number of the ensemble's rigs beside each verdict."""
    own = card[card["rig"] == rig].astype(object).fillna("")
    of = shares.astype({"part": object}).fillna({"part": ""}).set_index(["id", "part"])
    rows = of.reindex(pd.MultiIndex.from_frame(own[["id", "part"]]))
    text = [
        ""
        if pd.isna(row["share"])
        else f"{row['reproduced']:.0f} of {row['rigs']:.0f}"
        + ("" if pd.isna(row["share_low"]) else f" ({row['share_low']:.0%} to {row['share_high']:.0%})")
        for _, row in rows.iterrows()
    ]
    table = own[["id", "part", "claim", "origin", "measured"]].assign(**{f"verdict of {rig}": own["verdict"]})
    return table.assign(used=rows["used"].to_numpy(), **{"rigs in which it is reproduced": text})


def position_of_shipped(e: Ensemble) -> str:
    """Where the shipped rig lies: in words."""
    values = e.outputs("shipped")
    if values.empty:
        return "The shipped rig did not come out at the full fidelity; nothing can be said of its place."
    own = judged(e.config, e.targets, values, read_errors(e), cheap=False).iloc[0]
    lost = missed_targets(e, own)
    table = parameters_table(e)
    outside = table.loc[table["outside"].fillna(False).astype(bool), "name"]
    others = rank(e)["excluded_by"]
    return (
        f"The shipped rig is excluded by {len(lost)} of {len(e.targets)} targets "
        f"({', '.join(lost) or 'none'}); rigs of the last wave by "
        f"{others.min()} to {others.max()}. {len(outside)} of its values lie outside what the part "
        f"can be ({', '.join(outside) or 'none'}), "
        + ("so it is no member of the ensemble." if len(outside) else "so it may be a member of the ensemble.")
    )


def rank_indices(e: Ensemble) -> pd.DataFrame:
    """Spearman's rank correlation of every target's output with every unknown over the first wave, which fills the
    prior range.

    Returns
    -------
    DataFrame
        ``output``, ``rigs`` and a column an unknown; NaN where an output never changes.
    """
    x, y = e.read("points_1").set_index("rig")[e.unknowns.labels], e.outputs("1")
    rows = []
    for target in e.targets:
        values = y[columns_of(target)[0]].dropna()
        row = {"output": target.name, "rigs": len(values)}
        if values.nunique() > 2:
            row |= {name: float(spearmanr(x.loc[values.index, name], values).statistic) for name in x}
        rows.append(row)
    return pd.DataFrame(rows, columns=["output", "rigs", *x])
