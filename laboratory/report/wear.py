"""The measured part of the page on wear, from the lives alone."""

import numpy as np
import pandas as pd

from laboratory.wear.study import OF_A_LIFE, sensed, summarize, wear_answer, windows

# why a life of a drawn rig ended, by words of its ``end``, the first that it has
ENDS = {
    "reached ring": "the ring is worn to the last radius", "no longer touch": "the links no longer touch the ring",
    "touches no link": "the links no longer touch the ring", "arcs miss": "five arcs no longer follow the worn flank",
    "not resolved": "the step does not resolve the contacts",
    "physical range": "the step does not resolve the contacts", "": "the rig does not run",
}  # fmt: skip
COLUMNS = {
    "life_km": "life (km)", "right_begins_m": "right arc touches (mm)", "left_leaves_m": "left force leaves 15 % (mm)",
    "good_from_m": "window from (mm)", "good_to_m": "to (mm)", "good_km": "in it (km)",
}  # fmt: skip


def wear_text(lives: pd.DataFrame) -> str:
    """Lives of the last named rig as a table; the best first radius, what came of drawn rigs, what a sensor sees."""
    seen = windows(lives)
    summary = summarize(lives, seen)
    drawn = summary["rig"].str.startswith("drawn")
    named = summary[~drawn]
    last = named["rig"].iloc[-1]
    named, own = named[named["rig"] == last], lives[lives["rig"] == last]
    table = named[OF_A_LIFE[:3]].assign(**{"first radius (mm)": named["first_radius_m"].map(lambda r: f"{1e3 * r:g}")})
    for name, words in COLUMNS.items():
        scale, digits = (1.0, 0) if name.endswith("_km") else (1e3, 2)
        table[words] = [f"{scale * v:.{digits}f}" if pd.notna(v) else "–" for v in named[name]]
    lines = [table.to_markdown(index=False, disable_numparse=True), "", f"- {wear_answer(summary, seen)}"]
    if drawn.any():
        words = [next(kind for mark, kind in ENDS.items() if mark in end) for end in summary.loc[drawn, "end"]]
        counts = pd.Series(words).value_counts()
        worn = summary.loc[drawn & summary["end"].str.startswith("reached"), "life_km"]
        lines.append(f"- Ends of {drawn.sum()} rigs: " + "; ".join(f"{kind}: {n}" for kind, n in counts.items()) + ".")
        low, middle, high = np.quantile(worn, [0.05, 0.5, 0.95])
        lines.append(
            f"- Lives of the {len(worn)} rigs whose ring wears to the last radius: median {middle:.3g} km, 90 % of "
            f"them between {low:.3g} and {high:.3g} km, with the same coefficients for all."
        )
    deepest = 1e3 * named[["left_depth_m", "right_depth_m"]].max().max()
    lost = 1e3 * (named["first_radius_m"] - named["last_radius_m"]).max()
    lines.append(f"- Deepest wear of a groove in these lives: {deepest:.2g} mm, while the ring loses {lost:.2g} mm.")
    of_sensor = sensed(own)
    best = of_sensor.groupby("measure")["detectable_mm"].median().sort_values()
    named_best = ", ".join(f"{value:.2f} mm by `{name}`" for name, value in best.items())
    lines.append(f"- Least change of the ring's radius that two records tell apart (median, `{last}`): {named_best}.")
    return "\n".join(lines)
