"""Write the measured parts of the README and of pages in docs/ from the results of a full run."""

import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import replacing, write_text
from trackdyn.measure.catalogue import NAMED
from trackdyn.measure.columns import significant
from trackdyn.measure.ring_rule import DurationRule, RingRule, with_tooth_forces
from trackdyn_replication.paper.claims import NO_TEST
from trackdyn_replication.paper.finding import TABLE as GRIP
from trackdyn_replication.paper.scorecard import MARKS, conclusion_table, outside_sentence
from trackdyn_replication.paper.tracks import FOLDER, RINGS, learned_sentences
from trackdyn_replication.report.figures.trade import answers, trade_sentence
from trackdyn_replication.report.summary import blocks, summary
from trackdyn_replication.study.accuracy.default_step import default_step_text
from trackdyn_replication.study.extremes.resolved import short_runs_verdict
from trackdyn_replication.study.variants import METHOD_WORDS, PHYSICS_WORDS, VARIANTS

MEASURED = "docs/measured"
BEGIN, END = "<!-- measured -->", "<!-- end -->"
# its tables (`stored`), and the function that writes its blocks
Page = tuple[str, tuple[str, ...], Callable[..., str | list[str]]]
# measures of the tables of fidelities, and of the study `trade`
DEPARTURES = ("rms", "high_frequency", "left_share")
ERRORS = ("rms", "left_peak", "left_share")


def settings_text(rows: pd.DataFrame, default_step: pd.DataFrame, short_runs: pd.DataFrame) -> str:
    """Tabulate CPU time and largest errors of an answer by setting of `trade` (``rows``); add the other two studies."""
    rows = answers(rows)
    rows["bare"] = ~rows["scene"].str.startswith("ring")
    lines = []
    for (physics, method, step), group in rows.groupby(["fidelity", "integrator", "step_s"], sort=False, dropna=False):
        named = PHYSICS_WORDS[physics] if physics in PHYSICS_WORDS else METHOD_WORDS[method]
        setting = named if pd.isna(step) else f"{named}, {1e3 * step:g} ms"
        worst = 100 * group.groupby(["measure", "bare"])["error"].max()
        line = {"setting": setting, "CPU s": group["cpu_s"].mean()}
        for name in ERRORS:
            pair = (worst.get((name, bare), np.nan) for bare in (False, True))
            line[NAMED[name].studied.short] = "/".join(significant(value, 2) for value in pair)
        lines.append(line)
    table = pd.DataFrame(lines).sort_values("CPU s", kind="stable")
    table["CPU s"] = table["CPU s"].map("{:.2g}".format)
    return f"{_markdown(table)}\n\n{default_step_text(default_step)}\n{short_runs_verdict(short_runs)}"


def _markdown(table: pd.DataFrame) -> str:
    return table.to_markdown(index=False, disable_numparse=True)


def readme_text(*tables: pd.DataFrame) -> list[str]:
    """Render the blocks of the README: verdict, conclusions, lessons, costs of an answer; tables as in `README`."""
    study, judged, numbers, grips, parameters, promises, near, *tracks = tables
    learned = dict(zip(TRACK_TABLES, tracks, strict=True))
    links = {"finding": "docs/answer.md#the-finding", "answer": "docs/answer.md"}
    return blocks(
        Path(__file__).with_name("readme.md.j2"),
        summary=summary(study, judged, numbers, parameters, near, learned, **links),
        conclusions=_markdown(conclusion_table(judged, grips, learned["sentences"])),
        learned="\n\n".join(learned_sentences(learned)),
        marks=", ".join(f"{mark} {name}" for name, mark in MARKS.items() if name != NO_TEST),
        outside=outside_sentence(parameters, judged["rig"].iloc[0], learned["mobilised"]),
        trade=trade_sentence(promises),
    )


def departures_text(rows: pd.DataFrame) -> str:
    """Tabulate the departures with their largest change in any scene; name those without change, or not possible."""
    lines, unchanged, lost = [], [], []
    for name in [variant.name for variant in VARIANTS if variant.departure and variant.name in set(rows["setting"])]:
        changes = rows.loc[rows["setting"] == name, [*DEPARTURES]].dropna(how="all")
        if changes.empty:
            lost.append(name)
            continue
        cells = [f"{column.loc[column.abs().idxmax()]:+.1f}" for _, column in changes.items()]
        cells = ["0" if float(cell) == 0 else cell for cell in cells]
        if set(cells) == {"0"}:
            unchanged.append(name)
        else:
            lines.append([f"`{name}`", *cells])
    table = _markdown(pd.DataFrame(lines, columns=["setting", *(NAMED[name].studied.short for name in DEPARTURES)]))
    others = (
        f"{words}: {', '.join(f'`{name}`' for name in names)}."
        for words, names in (("No change", unchanged), ("Not possible", lost))
        if names
    )
    return "\n\n".join((table, *others))


def ring_text(rows: pd.DataFrame) -> str:
    """Tabulate by track the ring by force and by durations; force, tension and sliding without and with it."""
    lines = []
    for track, group in rows.groupby("track", sort=False):
        grid, rule = with_tooth_forces(group[group["grid"] != "beyond"]), RingRule()
        radius = rule.radius(grid)
        chosen = {
            "radius (m)": [radius],
            "by speed (m)": [rule.radius(of_speed) for _, of_speed in grid.groupby("rpm")],
            "with 0.3 and 0.7 (m)": rule.band(grid).values(),
            "by durations (m)": [DurationRule(int(group["teeth"].iloc[0])).radius(grid)],
        }
        line = {"track": track, "rpm": ", ".join(f"{rpm:g}" for rpm in grid["rpm"].unique())}
        line |= {
            words: ", ".join(f"{value:.4f}".replace("nan", "none") for value in radii)
            for words, radii in chosen.items()
        }
        bare, ring = grid[grid["ring_radius_m"].isna()], grid[grid["ring_radius_m"] == radius]
        line["tooth (kN)"] = " → ".join(significant(float(of["tooth_peak_n"].max()) / 1e3) for of in (bare, ring))
        for words, column in (
            ("strand (N)", "settled_tension_n"),
            ("teeth (J)", "teeth_sliding_j"),
            ("ring (J)", "ring_sliding_j"),
        ):
            line[words] = " → ".join(significant(float(of[column].mean())) for of in (bare, ring))
        lines.append(line)
    return _markdown(pd.DataFrame(lines))


def fill(page: Path, sources: Sequence[Path], write: Callable[..., str | list[str]]) -> None:
    """Replace the measured blocks of a page, in their order, by those that ``write`` renders from tables."""
    for source in sources:
        if not source.exists():
            raise InputError(f"{source}: no measured data; make them with `snakemake -j2`")
    written = write(*[pd.read_csv(source, keep_default_na=True) for source in sources])
    texts = [written] if isinstance(written, str) else written
    before, *blocks = page.read_text(encoding="utf-8").split(BEGIN)
    if len(blocks) != len(texts) or any(block.count(END) != 1 for block in blocks) or END in before:
        often = "once" if len(texts) == 1 else f"{len(texts)} times"
        raise InputError(f"{page}: the marks {BEGIN} and {END} must occur {often} each")
    filled = [f"{BEGIN}\n\n{text}\n{END}{block.split(END)[1]}" for text, block in zip(texts, blocks, strict=True)]
    write_text(page, before + "".join(filled))


def write_pages(files: Iterable[str], pages: Iterable[Page], tables: str = MEASURED) -> None:
    """Copy pictures of the results to ``docs/pictures``, their tables to ``tables``; write the pages' blocks anew."""
    for file in map(Path, files):
        folder = "docs/pictures" if file.suffix in (".gif", ".png") else tables
        if file.name == "step_errors.csv":  # which the program reads
            folder = "trackdyn/measure"
        with replacing(Path(folder, file.name)) as temporary:
            temporary.write_bytes(file.read_bytes())
    for page, sources, write in pages:
        fill(Path(page), [*map(stored, sources)], write)


def stored(source: str) -> Path:
    """Return the file that a page is written from: one of ``docs/measured`` by its name, another one by its path."""
    return Path(source) if "/" in source else Path(MEASURED, source)


TRACK_TABLES = ("sentences", "map", "draws", "mobilised", "rings")  # of `learned_sentences`
README = (
    GRIP, "sentences.csv", "printed_numbers.csv", f"{FOLDER}/grips_sentences.csv", "parameters.csv",
    "planner.csv",
    *(f"{FOLDER}/plausible_{name}.csv" for name in ("near", *TRACK_TABLES[:-1])), RINGS,
)  # fmt: skip
PAGES: tuple[Page, ...] = (
    ("docs/speed-and-accuracy.md", ("trade.csv", "default_step.csv", "extremes_short_runs.csv"), settings_text),
    ("docs/deviations.md", ("fidelity.csv",), departures_text),
    ("docs/choose-a-ring.md", ("ring_trials.csv",), ring_text),
    ("README.md", README, readme_text),
)


def main(pages: Iterable[Page], tables: str = MEASURED) -> None:
    """Call `write_pages` with the files of the command line; a refusal is one sentence."""
    try:
        write_pages(sys.argv[1:], pages, tables)
    except InputError as error:
        sys.exit(f"trackdyn: {error}")


if __name__ == "__main__":
    main(PAGES)
