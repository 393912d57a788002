"""Results of the study of plausible tracks: maps, and the measured part of docs/answer.md."""

from trackdyn.sweeps.snakemake_job import run_job

import textwrap
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import blended_transform_factory

from laboratory.plausible.draws import EQUAL_PITCH
from laboratory.plausible.settings import load_plausible
from laboratory.plausible.verdicts import JAMMED
from trackdyn.measure.columns import listed, significant
from trackdyn.plots.style import BLACK, MARKERS, PAGE, SMALL, VERMILION, new_figure, save, styled
from trackdyn.rig.rig import load_rig
from trackdyn.sweeps.engine import DONE
from trackdyn_replication.paper import tracks as sampled
from trackdyn_replication.paper.finding import check_sentences, finding_sentences, ran
from trackdyn_replication.paper.published import RADIUS_CHOSEN
from trackdyn_replication.paper.scorecard import MARKS, number_count, other_numbers, verdict_line
from trackdyn_replication.report.filled import blocks

READING = "equal_pitch "  # begins the columns of readings
COLUMNS, PANEL = 3, 1.42  # of the maps; height of one, inch
PALE, DARK = 0.04, 0.75  # of the map of colours, so that black and white text can be read
LIGHT = 0.55  # share from which on text is white
BLUES = colormaps["Blues"]  # from pale to dark, which a print in grey keeps apart


def readings(draws: pd.DataFrame) -> dict[str, float]:
    """Return the polygonal radius (m) at which each reading of equal pitch is printed: median over the tracks."""
    return {
        name.removeprefix(READING): float((draws[EQUAL_PITCH] + RADIUS_CHOSEN - draws[name]).median())
        for name in draws
        if name.startswith(READING) and draws[name].notna().any()
    }


@styled
def map_figure(sentences: pd.DataFrame, binned: pd.DataFrame, draws: pd.DataFrame, of_ring: pd.DataFrame) -> Figure:
    """Draw the share of tracks that show each sentence over equal pitch and creep slope of the ring, a map each.

    Tables are those of `study.tables`, and `study.mobilised_table`, whose friction labels the creep slopes.
    """
    words = sentences.drop_duplicates("name").set_index("name")["statement"]
    names = list(dict.fromkeys(binned["name"]))
    rows = -(-(len(names) + 1) // COLUMNS)  # with the legend
    figure = new_figure(PANEL * rows + 0.3, PAGE)
    axes = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    marked, friction = readings(draws), of_ring.groupby("creep")["mobilised_friction"].mean()
    for ax, name in zip(axes, names, strict=False):
        _draw_map(ax, binned[binned["name"] == name], marked)
        ax.set_title("\n".join(textwrap.wrap(f"{name}. {words[name]}", 40)), fontsize=SMALL, pad=9)
    for ax in axes[len(names) :]:
        ax.axis("off")
    for ax in axes[max(0, len(names) - COLUMNS) : len(names)]:
        ax.set_xlabel("equal-pitch radius (mm)")
    for ax in axes[: len(names) : COLUMNS]:
        ax.set_ylabel("creep (s/m)")
        ax.set_yticks(ax.get_yticks(), [f"{creep:g} ({friction[creep]:.2g})" for creep in ax.get_yticks()])
    _draw_legend(axes[len(names)], marked)
    return figure


def _draw_map(ax: Axes, cells: pd.DataFrame, marked: dict[str, float]) -> None:
    """Draw the cells of a sentence with their counts, the readings of equal pitch above, rubber's range at the side."""
    for cell in cells.itertuples():
        share = cell.shown / cell.decided if cell.decided else np.nan
        colour = BLUES(PALE + (DARK - PALE) * share) if cell.decided else "0.9"
        span, middle = cell.pitch_high - cell.pitch_low, (cell.pitch_low + cell.pitch_high) / 2
        look = {"color": colour, "edgecolor": "white", "linewidth": 0.6}
        ax.bar(middle, cell.creep_high - cell.creep_low, span, cell.creep_low, **look)
        text = f"{cell.shown}/{cell.decided}" if cell.decided else "–"
        colour = "white" if share > LIGHT else BLACK
        alignment = {"ha": "center", "va": "center_baseline", "fontsize": SMALL, "color": colour}
        ax.text(middle, np.sqrt(cell.creep_low * cell.creep_high), text, **alignment)
    pitches, creeps = (sorted({*cells[f"{name}_low"], *cells[f"{name}_high"]}) for name in ("pitch", "creep"))
    ax.set(yscale="log", xlim=(pitches[0], pitches[-1]), ylim=(creeps[0], creeps[-1]))
    ax.grid(visible=False)
    ax.set_xticks(pitches, [f"{1e3 * pitch:g}" for pitch in pitches])
    ax.set_yticks(creeps, [f"{creep:g}" for creep in creeps])
    ax.minorticks_off()
    ax.tick_params(length=2)
    above = blended_transform_factory(ax.transData, ax.transAxes)
    for marker, radius in zip(MARKERS, marked.values(), strict=False):
        ax.plot(radius, 1.06, marker, transform=above, color=VERMILION, markersize=3.5, clip_on=False)
    margin_axes = blended_transform_factory(ax.transAxes, ax.transData)
    rubber = [max(sampled.RUBBER[0], creeps[0]), min(sampled.RUBBER[1], creeps[-1])]
    ax.plot(
        [1.025, 1.025], rubber, transform=margin_axes, color=BLACK, linewidth=2.5, clip_on=False, solid_capstyle="butt"
    )


def _draw_legend(ax: Axes, marked: dict[str, float]) -> None:
    """Draw the legend of marks and colours in a panel of its own."""
    for marker, (name, radius) in zip(MARKERS, marked.items(), strict=False):
        ax.plot([], [], marker, color=VERMILION, label=f"0.308 m read as {name}: {radius:.4f} m")
    low, high = sampled.RUBBER
    ax.plot([], [], color=BLACK, linewidth=2.5, label=f"creep assumed for rubber, {low:g} to {high:g} s/m")
    for share in (0.0, 0.5, 1.0):
        colour = BLUES(PALE + (DARK - PALE) * share)
        ax.plot([], [], "s", color=colour, markeredgecolor="0.6", markersize=7, label=f"{100 * share:.0f} % show it")
    ax.plot([], [], " ", label="brackets: mobilised friction on\nthe default track, mean of speeds")
    ax.legend(loc="center", title="cells: tracks that show it/decided", title_fontsize=SMALL, frameon=False)


def answer_text(*tables: pd.DataFrame) -> list[str]:
    """Word the finding, the results of the tracks, and the default rig: its ring, its bushings, its numbers."""
    study, rings, sentences, draws, of_ring, values, near, default, parameters, numbers, *gripping = tables
    grips, grips_sentences = gripping
    table, unjudged = _table(sentences, default)
    of_rig = parameters.set_index("name")["value"]
    stiffness, tension, radius = of_rig[["bushing.stiffness", "tension.pre_tension", EQUAL_PITCH]].astype(float)
    # the bushings' moment in the wrap over that of the tension; stiff bushings lift the chain off
    wrap = stiffness * load_rig("paper").pitch / 2 / (tension * radius**2)
    radii = load_plausible("config/plausible.yaml").rings.radii_m
    slope = sampled.creep_slope(parameters)
    # the values that separate most, each with the sentences that it does so for
    most = values.drop_duplicates("name").groupby("value", sort=False)["name"]
    texts = blocks(
        Path(__file__).with_name("answer.md.j2"),
        finding=" ".join(finding_sentences(ran(study))),
        checks=" ".join(check_sentences(ran(study))),
        **_outcomes(draws),
        follows=sampled.follows_sentence(sentences, draws),
        table=table,
        unjudged=", ".join(unjudged),
        separating=listed([f"`{value}` ({listed(names.astype(str).tolist())})" for value, names in most]),
        rings=sampled.ring_sentences(rings),
        at_end_pct=100 * sampled.chosen_rings(rings)["radius_m"].isin([radii[0], radii[-1]]).mean(),
        radii=radii,
        slope=significant(slope, 2),
        inside=sampled.RUBBER[0] <= slope <= sampled.RUBBER[1],
        rubber=sampled.RUBBER,
        mobilised=sampled.mobilised(of_ring, slope),
        wrap=significant(float(wrap), 2),
        neighbours=sampled.neighbours_sentence(near, default),
        numbers=number_count(numbers),
        others=other_numbers(numbers),
        shares_read=sampled.SHARES_READ,
        grips=verdict_line(grips_sentences, grips),
    )
    return [f"{text}\n" for text in texts]


def _outcomes(draws: pd.DataFrame) -> dict:
    """Count the draws that are judged, jam, or were refused, with the reasons by number."""
    judged, jammed = (draws["state"] == state for state in (DONE, JAMMED))
    causes = draws.loc[~judged & ~jammed, "reason"].fillna("").str.removeprefix("scene: ").str.removeprefix("rig: ")
    reasons = causes.str.split("( =|:)", regex=True).str[0].value_counts()
    return {
        "draws": len(draws), "judged": judged.sum(), "jammed": jammed.sum(),
        "refused_pct": 100 * reasons.sum() / len(draws), "chosen": RADIUS_CHOSEN,
        "reasons": ", ".join(f"{reason} ({count})" for reason, count in reasons.items()),
    }  # fmt: skip


def _table(sentences: pd.DataFrame, default: pd.DataFrame) -> tuple[str, list[str]]:
    """Tabulate shares of the engaged tracks and of all, with intervals and bounds in brackets, and the default rig."""
    rows = sampled.track_rows(sentences)
    verdicts = default.assign(number=default["number"].astype(str)).set_index("number")["verdict"]
    lines, unjudged = [], []
    for name in rows.index.unique("name"):
        if not rows.loc[(name, sampled.TRACKS[0])]["decided"]:
            unjudged.append(name)
            continue
        shares = [sampled.share_of_tracks(rows, name, tracks) for tracks in sampled.TRACKS]
        cells = [share.replace(" %", "").replace(" to ", "–") for share in shares]
        lines.append([name, *cells, MARKS[verdicts.get(name, "not comparable")]])
    heads = ["sentence", *(f"% of {tracks}" for tracks in sampled.TRACKS), default["rig"].iloc[0]]
    return pd.DataFrame(lines, columns=heads).to_markdown(index=False, disable_numparse=True), unjudged


@run_job
def main(job) -> None:
    """Rule `plausible_figure`."""
    tables = (pd.read_csv(job.input[name], dtype={"name": str}) for name in ("sentences", "map", "draws", "mobilised"))
    save(map_figure(*tables), job.output[0])
