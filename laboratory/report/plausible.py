"""Results of the study of plausible tracks: a picture, and the measured part of docs/answer.md."""

from trackdyn.sweeps.snakemake_job import run_job

import textwrap

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from laboratory.plausible.shares import DEPENDS, FOLLOWS, NEVER, NOT_JUDGED, outcomes
from replication.paper.scorecard import MARKS, learned_sentences
from trackdyn.measure.cells import significant
from trackdyn.plots.style import COLOURS, MARKERS, SMALL, new_figure, save, styled
from trackdyn.rig.rig import load_rig

CLASSES = {
    FOLLOWS: "Follow from the model",
    DEPENDS: "Depend on values or on a scenario",
    NEVER: "Shown by no track",
    NOT_JUDGED: "Kinematics and the wheels decide sentences",
}
UNITS = {"m": (1e3, "mm"), "N": (1e-3, "kN"), "Pa": (1e-6, "MPa"), "1": (1, "")}  # in place of those of a rig


def scenario_name(ring: str, equal_pitch: str) -> str:
    """Words for a scenario: ``slips, arc length``."""
    return f"{ring}, {equal_pitch}"


@styled
def shares_figure(sentences: pd.DataFrame, default: pd.DataFrame, rig: str) -> Figure:
    """Share of rigs by scenario with its interval, a row a sentence; beside it the verdict of the fitted rig."""
    names = list(dict.fromkeys(sentences["name"]))
    figure = new_figure(0.34 * len(names) + 0.9, 7.0)
    ax = figure.subplots()
    scenarios = list(sentences.groupby(["ring", "equal_pitch"], sort=False))
    for k, (scenario, rows) in enumerate(scenarios):
        rows = rows.set_index("name").loc[names]
        y = np.arange(len(names)) + 0.18 * (k - (len(scenarios) - 1) / 2)
        share, low, high = (100 * rows[column].to_numpy() for column in ("share", "low", "high"))
        ax.errorbar(
            share, y, xerr=[share - low, high - share], fmt=MARKERS[k], color=COLOURS[k], markersize=3.5, linewidth=0.7,
            label=scenario_name(*scenario),
        )  # fmt: skip
    verdicts = default[default["rig"] == rig].set_index("number")["verdict"]
    words = sentences.drop_duplicates("name").set_index("name")["statement"]
    for y, name in enumerate(names):
        ax.text(106, y, MARKS[verdicts.get(int(name), "not comparable")], ha="center", va="center")
    ax.text(106, -1.1, f"rig\n{rig}", ha="center", va="bottom", fontsize=SMALL)
    labels = ["\n".join(textwrap.wrap(f"{name}  {words[name]}", 52)) for name in names]
    ax.set_yticks(range(len(names)), labels, fontsize=SMALL)
    ax.set(xlim=(-2, 110), ylim=(len(names) - 0.5, -0.7), xlabel="share of plausible tracks that show it (%)")
    ax.set_xticks(range(0, 101, 20))
    ax.axvspan(90, 100, color="0.93", zorder=0)
    ax.legend(loc="upper center", bbox_to_anchor=(0.3, -0.07), ncols=2, fontsize=SMALL)
    return figure


def answer_text(sentences: pd.DataFrame, claims: pd.DataFrame, draws: pd.DataFrame, values: pd.DataFrame) -> str:
    """The 22 sentences in classes with their shares, the radius, and what separates the rigs."""
    paragraphs = [_outcomes_text(draws), *learned_sentences(claims)]
    for kind, title in CLASSES.items():
        rows = sentences[sentences["class"] == kind]
        if kind == NOT_JUDGED:
            paragraphs.append(f"{title}: {', '.join(map(str, dict.fromkeys(rows['name'])))}.")
        elif len(rows):
            paragraphs += [f"**{title}**", _class_text(rows)]
    return "\n\n".join([*paragraphs, _radius_text(draws), _values_text(values)]) + "\n"


def _class_text(rows: pd.DataFrame) -> str:
    """Shares of tracks (%), a column a ring, equal pitch read both ways in a cell; all zero: the sentences alone."""
    words = rows.drop_duplicates("name").set_index("name")["statement"]
    if not (rows["share"] > 0).any():
        return "\n".join(f"- {name}. {statement}" for name, statement in words.items())
    cells = rows.assign(percent=(100 * rows["share"]).map("{:.0f}".format))
    table = cells.groupby(["name", "ring"], sort=False)["percent"].agg("/".join).unstack()
    table = table.sort_index(key=lambda names: names.astype(int))
    table.insert(0, "% of the tracks, arc/polygon", [f"{name}. {words[name]}" for name in table.index])
    return table.to_markdown(index=False, disable_numparse=True)


def _outcomes_text(draws: pd.DataFrame) -> str:
    counts = outcomes(draws)
    ran = counts[counts["reason"] == "ran"]["rigs"]
    lost = len(draws) - ran.sum()
    return (
        f"The first {draws['draw'].nunique()} draws are stored. Of their {len(draws)} tracks {ran.sum()} ran "
        f"({ran.min()} to {ran.max()} a scenario); {lost} could not be built, did not come to rest or left the "
        "physical range."
    )


def _values_text(values: pd.DataFrame) -> str:
    if values.empty:
        return "No single value separates the tracks that show a sentence from the others beyond chance."
    parts, fields = [], load_rig("parts").fields
    for row in values.drop_duplicates("name").itertuples():  # the value that separates most
        unit = fields[row.value].unit
        factor, unit = UNITS.get(unit, (1, unit))
        shown, others = (significant(factor * number, 2) for number in (row.median_shown, row.median_not))
        parts.append(f"{row.name}: `{row.value}` ({shown} against {others} {unit}".rstrip() + ")")
    return "Medians of tracks that show a sentence, against others: " + "; ".join(parts) + "."


def _radius_text(draws: pd.DataFrame) -> str:
    columns = [name for name in draws if name.startswith("radius_")]
    parts = []
    for scenario, rows in draws.groupby(["ring", "equal_pitch"], sort=False):
        chosen = rows[columns].to_numpy().ravel()
        chosen = chosen[np.isfinite(chosen)]
        if len(chosen):
            low, middle, high = np.quantile(chosen, [0.1, 0.5, 0.9])
            parts.append(f"{scenario_name(*scenario)} {middle:.3f} ({low:.3f} to {high:.3f})")
    return (
        "**Radius to choose** by our rule, median and 80 % of the choices over tracks and speeds, m: "
        f"{'; '.join(parts)}."
    )


@run_job
def main(job) -> None:
    """Rule `plausible_figure`."""
    figure = shares_figure(
        pd.read_csv(job.input.sentences, dtype={"name": str}), pd.read_csv(job.input.default), job.params.rig
    )
    save(figure, job.output[0])
