"""The file of the default rig: the end of the search."""

from trackdyn.sweeps.snakemake_job import run_job

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.plausible.draws import EQUAL_PITCH, run_rigs, scenes
from laboratory.plausible.search import Searching, free_unknowns
from laboratory.plausible.settings import PlausibleConfig, Scenario, load_plausible
from laboratory.plausible.study import judged_claims
from laboratory.plausible.unknowns import Unknowns, file_ranges
from laboratory.plausible.verdicts import judge_rig
from replication.paper.claims import load_sentences
from trackdyn.errors import InputError
from trackdyn.files import write_text
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.settling import settle
from trackdyn.sweeps.design import write_table

PITCH_PASSING_RPM, PITCH_PASSING_HZ = 115.0, 4.47  # where a damper loses what rubber of a loss factor does
ABOUT = "the rig of the paper: real parts and one assumption, a ring that slips; searched to show most of its sentences"
SLIPS = "the one assumption: the ring slips nearly freely (docs/answer.md)"
DAMPER = (
    "loss_factor of that stiffness at 4.47 Hz, the pitch-passing frequency of 115 rpm; only for bushing_law: viscous"
)
SECTION = re.compile(r"^(\w+):")
ENTRY = re.compile(r'^  (\w+): \{value: [^,]+, unit: ("1"|[^,]+), .*range: (.*)"\}$')
SOURCE_LINE = re.compile(r"#   (\[|judgement)")
HEAD = """# yaml-language-server: $schema=../schemas/rig.schema.json
about: "{about}"
# The rig: every parameter with value, unit, kind and source.
# kind: printed (stands in the paper), derived (from printed numbers), assumed (not in the paper),
# fitted (chosen so that the model shows a printed result; the source says which).
# low, high: what the part can be; the source of the range stands after "range:".
# `snakemake -s laboratory/Snakefile -j2 default_rig` makes this file (docs/answer.md).
# Outside what a part can be: {outside}.
"""


def rig_text(template: str, entries: Mapping[str, dict], about: str) -> str:
    """Text of a rig's file: another rig's with some entries exchanged.

    Parameters
    ----------
    template : str
        File in which every entry is a line, and the range stands behind ``range:`` in its source.
    entries : mapping
        ``section.field`` to ``value``, ``low``, ``high``, ``kind`` and ``source``.
    about : str
        What the rig is.
    """
    section, lines, outside = "", [], []
    for line in template[template.index("\ngravity:") + 1 :].splitlines():
        if match := SECTION.match(line):
            section = match[1]
        match = ENTRY.match(line)
        if match and (entry := entries.get(f"{section}.{match[1]}")):
            value = float(f"{entry['value']:.6g}")
            line = (
                f"  {match[1]}: {{value: {value!r}, unit: {match[2]}, kind: {entry['kind']}, low: {entry['low']:.6g}, "
                f'high: {entry["high"]:.6g}, source: "{entry["source"]}; range: {match[3]}"}}'
            )
            if not entry["low"] <= value <= entry["high"]:
                outside.append(f"{section}.{match[1]} ({value:g} for {entry['low']:g} to {entry['high']:g})")
        lines.append(line)
    head = HEAD.format(about=about, outside=", ".join(outside) or "nothing")
    sources = "".join(f"{line}\n" for line in template.splitlines() if SOURCE_LINE.match(line))
    return f"{head}{sources}\n" + "\n".join(lines) + "\n"


def rig_entries(
    config: PlausibleConfig, unknowns: Unknowns, values: Mapping[str, float], source: str
) -> dict[str, dict]:
    """Entries of a rig file (`rig_text`) for values by unknown; the range of a ratio becomes that of its value."""
    ranges, fields, entries = file_ranges(config.rig), unknowns.changes(values), {}
    for unknown in unknowns.unknowns:
        factor = fields.get(unknown.of, 1.0) if unknown.of else 1.0
        low, high = ranges[EQUAL_PITCH] if unknown.label == EQUAL_PITCH else (unknown.low, unknown.high)
        entry = {"low": low * factor, "high": high * factor, "kind": "fitted", "source": source}
        entries |= {name: entry | {"value": fields[name]} for name in unknown.names}
    rig = unknowns.rig.changed(**fields)
    radius, tension = entries["chain.connector_radius"], entries["tension.pre_tension"]
    radius["high"] = min(radius["high"], (1 - 1e-5) * rig.connector_length / 2)
    tension["low"] = _least_tension(rig, tension["low"])
    stiffness, loss = fields["bushing.stiffness"], entries["bushing.loss_factor"]
    damper = {name: loss[name] * stiffness / (2 * np.pi * PITCH_PASSING_HZ) for name in ("value", "low", "high")}
    return entries | {"bushing.damping": damper | {"kind": "assumed", "source": DAMPER}}


def _least_tension(rig: Rig, low: float) -> float:
    """Tension (N) from ``low`` on, in steps of 2 %, under which the chain of a rig can stand."""
    while low < rig.tension.pre_tension:
        try:
            settle(Scene(rig.changed(tension__pre_tension=low), motor_rpm=PITCH_PASSING_RPM))
            return low
        except InputError:
            low *= 1.02
    return rig.tension.pre_tension


def slip_entries(config: PlausibleConfig) -> dict[str, dict]:
    """Entries of the ring that the search assumes."""
    ranges = file_ranges(config.rig)
    return {
        name: {"value": value, "low": ranges[name][0], "high": ranges[name][1], "kind": "assumed", "source": SLIPS}
        for name, value in config.ring[config.search.scenario.ring].items()
    }


def judged_end(config: PlausibleConfig, rows: pd.DataFrame, searching: Searching, sentences) -> dict:
    """The row of least cost of a search (``rows``), with its verdicts on all scenes.

    ``shown_on_all_scenes`` counts the ``sentences`` that are shown.
    """
    best = rows.loc[rows["cost"].idxmin()].to_dict()
    unknowns = free_unknowns(config, Scenario(best["ring"], best["equal_pitch"]))
    rig = unknowns.rig.changed(**unknowns.changes(best))
    (row,) = run_rigs(config, [rig], scenes(config), searching.jobs, searching.store)
    verdicts = judge_rig(config, row, rig, searching.claims, sentences)
    return best | verdicts | {"shown_on_all_scenes": sum(verdicts.get(str(number)) == 1 for number in sentences)}


def searched_rig(config: PlausibleConfig, ends: pd.DataFrame) -> str:
    """File of the end that shows most sentences on all scenes, of as many the one of least cost."""
    best = ends.sort_values(["shown_on_all_scenes", "cost"], ascending=[False, True], kind="stable").iloc[0].to_dict()
    unknowns = free_unknowns(config, Scenario(best["ring"], best["equal_pitch"]))
    source = f"CMA-ES from {best['start']}, row {best['row']:g} (docs/answer.md)"
    entries = rig_entries(config, unknowns, best, source) | slip_entries(config)
    return rig_text(Path(config.rig).read_text(encoding="utf-8"), entries, ABOUT)


@run_job
def main(job) -> None:
    """Rule `default_rig`."""
    config, sentences = load_plausible(job.input.config), load_sentences(job.input.claims)
    searching = Searching(config, judged_claims(job.input.claims), job.threads, job.params.store)
    searched = [searching.search(name) for name in config.search.starts]
    ends = pd.DataFrame([judged_end(config, rows, searching, sentences) for rows in searched])
    write_table(pd.concat(searched, ignore_index=True), job.output.rows)
    write_table(ends, job.output.ends)
    write_text(Path(job.output.rig), searched_rig(config, ends))
