"""Advice from a ring study: the ring to choose, its reason, price and wear, or the reason why no ring serves."""

import pandas as pd

from trackdyn.measure.cells import listed, plain, significant, with_error
from trackdyn.measure.contacts import TOUCHING
from trackdyn.measure.ring_rule import (
    ARCS,
    DECIDED,
    MARGIN_PCT,
    NARROW,
    SPAN,
    DurationRule,
    RingRule,
    Window,
    condition_name,
    conditions,
    windows,
    with_tooth_forces,
)
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Periods

WITHOUT = "of that without a ring"


def held_for(study: pd.DataFrame, rule: RingRule, rig: Rig) -> str:
    """Return the loads for which the advice on a study of a rig holds, and the drag of the track in addition.

    The drag (N) is the motor's power over the speed of the chain less the load, with the ring to choose or without one.
    """
    chosen, loads = rule.radius(study), sorted(study["load_n"].unique())
    rows = study[study["ring_radius_m"].isna() if chosen != chosen else study["ring_radius_m"] == chosen]
    speed = rows["rpm"].map(lambda rpm: rig.pitch / Periods.at(rig, rpm).passage)
    drag = (rows["motor_power_w"] / speed - rows["load_n"]).dropna()
    own = f"its own drag, {_span(drag)} N" if len(drag) else "its own drag"
    if loads == [0.0]:
        return f"this holds for a track that pulls nothing: the motor overcomes {own}"
    return f"this holds for loads of {listed([f'{load:g}' for load in loads])} N on the chain, in addition to {own}"


def _everywhere(study: pd.DataFrame) -> str:
    return f"at every speed{' and load' if 'load_n' in study and study['load_n'].any() else ''}"


def advice(
    study: pd.DataFrame, rule: RingRule, durations: DurationRule, grips: pd.DataFrame | None = None
) -> list[str]:
    """Return sentences on a study: the ring to choose first, then its force, price and wear; or why no ring serves.

    After these the windows of radii in which the force is as small, the right arc is free and a tooth drives; the
    choice with other shares, and by the durations of the paper. ``grips`` are runs of the recommended ring with another
    law of its friction (`sweeps.ring.other_grips`).
    """
    table = with_tooth_forces(study)
    rings, bare = table.dropna(subset="ring_radius_m"), table["ring_radius_m"].isna() & (table["tooth_peak_n"] > 0)
    run = dict.fromkeys(condition_name(row) for row in rings.sort_values(conditions(table)).itertuples())
    known = {condition_name(row) for row in table[bare].itertuples()}
    if unknown := [at for at in run if at not in known]:
        sentences = [f"no ring can be chosen: the force of a tooth without a ring at {listed(unknown)} is not known"]
    elif (chosen := rule.radius(study)) == chosen:
        sentences = _choice(table, rule, chosen) + ([] if grips is None else [_other_grips(grips, rule)])
    else:
        sentences = _none(table, rule)
    for name, keeps in (
        (f"force of a tooth at most {rule.tooth_force:g} {WITHOUT}", rings["tooth_ratio"] <= rule.tooth_force),
        (f"right arc free, below {TOUCHING:g} % of a turn", rings["right_share_pct"] < TOUCHING),
        ("a tooth is touched", rings["tooth_peak_n"] > 0),
    ):
        radii = windows(keeps.groupby(rings["ring_radius_m"]).all().to_dict())
        sentences.append(f"{name}, {_everywhere(study)}: {'; '.join(map(str, radii)) or 'no radius'}")
    others = (f"{_radius(radius)} with {share:g}" for share, radius in rule.band(study).items())
    sentences.append(f"with another share instead of {rule.tooth_force:g} the rule recommends {', '.join(others)}")
    return [*sentences, _by_durations(rings, durations)]


def _choice(table: pd.DataFrame, rule: RingRule, chosen: float) -> list[str]:
    """Return sentences on a ring that serves."""
    rows = table[table["ring_radius_m"] == chosen].sort_values(conditions(table))
    sentences = [f"recommended: a ring of radius {chosen:.4g} m"]
    if chosen == table["ring_radius_m"].max():
        largest = f"the recommended radius is the largest of the study, {chosen:.5g} m"
        sentences.insert(0, f"{largest}: a larger one may load a tooth by more")
    forces = listed([f"{significant(row.tooth_peak_n)} N at {condition_name(row)}" for row in rows.itertuples()])
    ratios = listed([f"{ratio:.2f}" for ratio in rows["tooth_ratio"]])
    bound = f"{ratios} {WITHOUT}, at most {rule.tooth_force:g} as asked"
    sentences.append(f"the largest force of a tooth in a passage is {forces}: {bound}")
    if (decided := rule.decided(table)) != chosen:
        apart = (rule.tooth_force - rows["tooth_ratio"]) / rows["tooth_ratio_error"]
        row, errors = rows.loc[apart.idxmin()], apart.min()
        why = f"rings within {SPAN:.1%} of it keep the bound by less than {DECIDED:g} errors"
        if errors < DECIDED:
            value = f"{plain(with_error(row['tooth_ratio'], row['tooth_ratio_error']))} (standard error) {WITHOUT}"
            why = f"at {condition_name(row)} the force is {value}, {errors:.2g} of its errors below the bound, and "
            why += f"{DECIDED:g} decide; a smaller step does, or a ring of {_radius(decided)}"
        sentences.append(f"this is not decided: {why}")
    if untouched := [condition_name(row) for row in rows[rows["tooth_peak_n"] == 0].itertuples()]:
        sentences.append(f"friction drive: no tooth is touched at {listed(untouched)}, only the ring drives")
    sentences.append(_price(table, rows))
    if "mobilised_friction" in rows and rows["mobilised_friction"].notna().any():
        grip = f"a friction of {_span(rows['mobilised_friction'])} is in use, its tangential over its normal force"
        sentences.append(f"the ring's grip: {grip} (mobilised friction)")
    window = next(window for window in windows(rule.kept(table)) if chosen in window.radii)
    return [*sentences, _wear(table, chosen, window)]


def _other_grips(grips: pd.DataFrame, rule: RingRule) -> str:
    """Return a sentence on the force of a tooth with a ring that is soft or hard in shear."""
    words = []
    for row in grips.sort_values("shear_stiffness").itertuples():
        force = "no result" if row.tooth_ratio != row.tooth_ratio else f"{row.tooth_ratio:.2f} {WITHOUT}"
        used = getattr(row, "mobilised_friction", float("nan"))
        used = "" if used != used else f", a friction of {significant(float(used), 2)} in use"
        words.append(f"{force} with {1e-3 * row.shear_stiffness:g} kN/m a link{used}")
    hold = grips["tooth_ratio"] <= rule.tooth_force
    verdict = "the ring serves with both" if hold.all() else "the choice depends on how much the ring grips"
    law = "if the ring gives way in shear instead (friction_law: dahl)"
    return f"{law}, the force of a tooth at {condition_name(grips.iloc[0])} is {listed(words)}: {verdict}"


def _price(table: pd.DataFrame, rows: pd.DataFrame) -> str:
    """Return a sentence on the price of a ring: tension, sliding work and power with it and without a ring."""
    by = conditions(table)
    bare = rows[by].merge(table[table["ring_radius_m"].isna()], on=by, how="left")
    words = [f"tension of the strand {_span(rows['tension_ratio'])} times that without a ring"]
    for text, columns, unit in (
        ("sliding of teeth and ring", ["teeth_sliding_j", "ring_sliding_j"], "J a turn"),
        ("motor power", ["motor_power_w"], "W"),
    ):
        if {*columns} <= {*table}:
            before, after = (of.reindex(columns=columns).sum(axis=1, min_count=1) for of in (bare, rows))
            words.append(f"{text} {_span(before)} -> {_span(after)} {unit}")
    force = f", force of the ring {_span(rows['ring_peak_n'])} N" if "ring_peak_n" in rows else ""
    return f"its price: {', '.join(words)}{force}"


def _wear(table: pd.DataFrame, chosen: float, window: Window) -> str:
    """Return a sentence on the wear after which a ring no longer keeps the bound."""
    worn = 1e3 * (chosen - window.first)
    if window.below != window.below:
        return f"wear: the bound is kept by every smaller ring of the study, for {worn:.2g} mm"
    fails = _worst(table[table["ring_radius_m"] == window.below])
    span = f"{worn:.2g} to " if worn > 0.01 else "at most "
    return f"wear: the bound fails after {span}{1e3 * (chosen - window.below):.2g} mm, at {window.below:.5g} m {fails}"


def _none(table: pd.DataFrame, rule: RingRule) -> list[str]:
    """Return sentences on the reason why no ring serves."""
    rings, worst = table.dropna(subset="ring_radius_m"), rule.worst(table)
    bound = f"the force of a tooth at {rule.tooth_force:g} {WITHOUT} {_everywhere(table)}"
    if worst.empty:
        return [f"no ring can be chosen: none of these has a result {_everywhere(table)}, to keep {bound}"]
    least = rings[rings["ring_radius_m"] == worst.idxmin()]
    row, sentences = least.loc[least["tooth_ratio"].idxmax()], list[str]()
    arc = max(ARCS, key=lambda arc: row[f"{arc}_peak_n"])
    if serving := windows(rule.kept(table)):
        widest = max(serving, key=lambda window: window.last - window.first)
        if (width := widest.last - widest.first) < rule.wear:
            why = f"not over {1e3 * rule.wear:g} mm of wear: the widest window has {1e3 * width:.2g} mm"
        else:
            larger = _worst(rings[rings["ring_radius_m"] == widest.above])
            why = f"not a ring up to {SPAN:.1%} larger: at {widest.above:.5g} m {larger}"
        sentences.append(f"no ring of these serves: {'; '.join(map(str, serving))} keep {bound}, but {why}")
        if width < NARROW:
            sentences.append(f"the window is narrower than {1e3 * NARROW:g} mm, which a ring as made may miss")
    else:
        sentences.append(f"no ring of these keeps {bound}")
    place = f"{row['ring_radius_m']:.5g} m, at {condition_name(row)}, on the {arc} arc"
    sentences.append(f"the least share that any keeps {_everywhere(table)} is {row['tooth_ratio']:.2f}: {place}")
    touching = rings[rings["right_share_pct"] >= TOUCHING]
    free = set(rings["ring_radius_m"]) - set(touching["ring_radius_m"])
    back = touching[touching["ring_radius_m"] > min(free, default=float("inf"))]
    if len(back):
        first = back.loc[back["ring_radius_m"].idxmin()]
        share = f"{first['right_share_pct']:.2g} % of a turn at {condition_name(first)}"
        sentences.append(f"the right arc comes back at {first['ring_radius_m']:.5g} m: {share}")
    elif not free:
        sentences.append("the right arc is never free")
    tight = rings.loc[rings["ring_radius_m"].idxmax()]
    tension = f"tension of the strand {significant(float(tight['tension_ratio']))} times that without a ring"
    return [*sentences, f"the largest ring of the study, {tight['ring_radius_m']:.5g} m: {tension}"]


def _by_durations(rings: pd.DataFrame, durations: DurationRule) -> str:
    """Return a sentence on the ring by the durations of the paper, and the force of a tooth with it."""
    bounds = f"right arc below {TOUCHING:g} %, left arc at most a tooth's share of a turn and {MARGIN_PCT:g} points"
    radius = durations.radius(rings)
    rows = rings[rings["ring_radius_m"] == radius]
    force = f"; {_worst(rows)}" if len(rows) and rows["tooth_ratio"].notna().all() else ""
    return f"by contact durations, as the paper argues ({bounds}): {_radius(radius)}{force}"


def _worst(rows: pd.DataFrame) -> str:
    """Word the force of a tooth at the speed where its share is largest."""
    if rows["tooth_ratio"].isna().any():
        return f"is not known at {condition_name(rows[rows['tooth_ratio'].isna()].iloc[0])}"
    row = rows.loc[rows["tooth_ratio"].idxmax()]
    return f"a tooth bears {row['tooth_ratio']:.2f} {WITHOUT} at {condition_name(row)}"


def _span(values: pd.Series) -> str:
    return " to ".join(dict.fromkeys(significant(float(value)) for value in (values.min(), values.max())))


def _radius(radius: float) -> str:
    return f"{radius:.4g} m" if radius == radius else "none"


def compared(study: pd.DataFrame, rule: RingRule, durations: DurationRule) -> pd.DataFrame:
    """Return rows of `with_tooth_forces`, by speed, of the rings to compare, named in ``ring``.

    These are no ring, the one to choose and its neighbours, a millimetre or more away where there are such, the one by
    durations, and the one with the least force of a tooth.
    """
    table, names = with_tooth_forces(study), dict[float, list[str]]()
    radii, chosen, worst = sorted(table["ring_radius_m"].dropna().unique()), rule.radius(study), rule.worst(table)
    below, above = ([r for r in radii if sign * (r - chosen) > 0] for sign in (-1, 1))
    for name, near, far in (
        ("smaller", below[-1:], [r for r in below if chosen - r >= 2 * NARROW - 1e-9][-1:]),
        ("recommended", [chosen] if chosen == chosen else [], []),
        ("larger", above[:1], [r for r in above if r - chosen >= 2 * NARROW - 1e-9][:1]),
        ("by durations", [] if (radius := durations.radius(study)) != radius else [radius], []),
        ("least force", [worst.idxmin()] if len(worst) else [], []),
    ):
        for radius in far or near:
            names.setdefault(radius, []).append(name)
    named = table["ring_radius_m"].map({radius: ", ".join(words) for radius, words in names.items()})
    table["ring"] = named.mask(table["ring_radius_m"].isna(), "none")
    return table.dropna(subset="ring").sort_values([*conditions(table), "ring_radius_m"], na_position="first")
