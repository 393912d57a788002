"""Files of the default rig, a draw of the sample, and of searched ones."""

from trackdyn.sweeps.snakemake_job import run_job

import re
from collections.abc import Mapping
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.plausible.draws import drawn_values
from laboratory.plausible.search import SEARCHED, Searching, searched_unknowns
from laboratory.plausible.settings import PlausibleConfig, load_plausible
from laboratory.plausible.unknowns import Unknowns, file_ranges
from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import write_csv, write_text
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.settling import settle

PITCH_PASSING_RPM, PITCH_PASSING_HZ = 115.0, 4.47  # where damper and loss factor lose the same energy
ABOUT = {
    "slips": "a rig fitted to the printed numbers within assumed ranges, but for a ring that slips",
    "shears": "a rig fitted to the printed numbers within assumed ranges, with a ring that gives way in shear",
    "grips": "a rig fitted to the printed numbers within assumed ranges, with a ring that grips as rubber does",
}
DEFAULT = "the rig of the paper: a track sampled from assumed ranges, chosen for the printed numbers that it meets"
SET = "set by the search (docs/answer.md)"
DAMPER = (
    "loss_factor of that stiffness at 4.47 Hz, the pitch-passing frequency of 115 rpm; only for bushing_law: viscous"
)
SECTION = re.compile(r"^(\w+):")
ENTRY = re.compile(r'^  (\w+): \{value: [^,]+, unit: ("1"|[^,]+), .*range: (.*)"\}$')
SOURCE_LINE = re.compile(r"#   (\[|judgement)")
HEAD = """about: "{about}"
# The rig: every parameter with value, unit, kind and source.
# kind: printed (stands in the paper), derived (from printed numbers), assumed (not in the paper),
# fitted (chosen so that the model shows a printed result; the source says which).
# low, high: the range that is assumed for the part; the source or the judgement behind it stands after "range:".
# `snakemake -s laboratory/Snakefile -j2 {command}` makes this file (docs/answer.md).
# Outside these ranges: {outside}.
"""


def rig_text(template: str, entries: Mapping[str, dict], about: str, command: str) -> str:
    """Return the text of a rig's file: that of another rig, the ``template``, with some entries exchanged.

    In the template every entry is a line, with ``range:`` and its source at the end. ``entries`` are ``value``,
    ``low``, ``high``, ``kind`` and ``source`` by ``section.field``.
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
    head = HEAD.format(about=about, command=command, outside=", ".join(outside) or "nothing")
    sources = "".join(f"{line}\n" for line in template.splitlines() if SOURCE_LINE.match(line))
    return f"{head}{sources}\n" + "\n".join(lines) + "\n"


def rig_entries(
    config: PlausibleConfig, unknowns: Unknowns, values: Mapping[str, float], source: str, kind: str
) -> dict[str, dict]:
    """Return entries of a rig file (`rig_text`) for values by unknown; the range of a ratio is that of its value."""
    ranges, fields, entries = file_ranges(config.rig), unknowns.changes(values), {}
    for unknown in unknowns.unknowns:
        factor = fields.get(unknown.of, 1.0) if unknown.of else 1.0
        # the range of the file where it has one, so that a value beyond it is seen
        own = unknown.low, unknown.high
        low, high = own if unknown.of else ranges.get(unknown.label, own)
        entry = {"low": low * factor, "high": high * factor, "kind": kind, "source": source}
        entries |= {name: entry | {"value": fields[name]} for name in unknown.names}
    rig = unknowns.rig.changed(**fields)
    radius, tension = entries["chain.connector_radius"], entries["tension.pre_tension"]
    radius["high"] = min(radius["high"], (1 - 1e-5) * rig.connector_length / 2)
    tension["low"] = _least_tension(rig, tension["low"])
    stiffness, loss = fields["bushing.stiffness"], entries["bushing.loss_factor"]
    damper = {name: loss[name] * stiffness / (2 * np.pi * PITCH_PASSING_HZ) for name in ("value", "low", "high")}
    return entries | {"bushing.damping": damper | {"kind": "assumed", "source": DAMPER}}


def _least_tension(rig: Rig, low: float) -> float:
    """Return the least tension (N) from ``low`` on, in steps of 2 %, under which the chain of a rig settles."""
    while low < rig.tension.pre_tension:
        try:
            settle(Scene(rig.changed(tension__pre_tension=low), motor_rpm=PITCH_PASSING_RPM))
            return low
        except InputError:
            low *= 1.02
    return rig.tension.pre_tension


def _rig_file(
    config: PlausibleConfig, name: str, values: Mapping[str, float], kind: str, source: str, about: str, command: str
) -> str:
    """Return the file of a rig with values by unknown of the search ``name``, and the fields that the search sets."""
    set_fields, ranges = config.search.searches[name].fields, file_ranges(config.rig)
    entries = rig_entries(config, searched_unknowns(config, name), values, f"{source} (docs/answer.md)", kind)
    choices = {field: value for field, value in set_fields.items() if isinstance(value, str)}
    for field in set_fields.keys() - choices:
        low, high = ranges[field]
        entries[field] = {"value": set_fields[field], "low": low, "high": high, "kind": "assumed", "source": SET}
    text = rig_text(Path(config.near.rig).read_text(encoding="utf-8"), entries, about, command)
    for field, choice in choices.items():
        text = with_choice(text, field, choice)
    return text


def default_rig(config: PlausibleConfig) -> str:
    """Return the file of the default rig: a draw of the sample, with the ring's friction of the search `slips`."""
    values = next(islice(drawn_values(config), config.default_draw, None))
    source = f"draw {config.default_draw} of the sample, fitted to nothing"
    return _rig_file(config, "slips", values, "assumed", source, DEFAULT, "default_rig")


def searched_rig(config: PlausibleConfig, rows: pd.DataFrame, name: str) -> str:
    """Return the file of the row that meets most independent numbers, of those shows most sentences, costs least."""
    ran = rows.dropna(subset="cost").sort_values("cost", kind="stable")
    best = ran.sort_values(["numbers", "sentences"], ascending=False, kind="stable").iloc[0].to_dict()
    if best["begin"] in {f"draw {draw}" for draw in config.search.draws}:
        kind, source = "assumed", f"{best['begin']} of the sample, fitted to nothing"
    else:
        kind = "fitted"
        # from which the linear programs went on (`Searching.search`)
        start = ran[ran["begin"] != SEARCHED].sort_values("numbers", ascending=False, kind="stable")["begin"].iloc[0]
        source = f"{best['begin']}, row {best['row']:g} of the search {name}, which began at {start}"
    return _rig_file(config, name, best, kind, source, ABOUT[name], "searched_rigs")


def with_choice(text: str, field: str, choice: str) -> str:
    """Return the text of a rig's file with another name for a field, whose line is added where it is missing."""
    section, name = field.split(".")
    line = f'  {name}: {{value: {choice}, unit: name, kind: assumed, source: "{SET}"}}\n'
    head, body = text.split(f"\n{section}:\n", 1)
    own, after = re.match(r"((?:  .*\n)*)(.*)", body, re.DOTALL).groups()
    own = re.sub(rf"  {name}: .*\n", "", own)
    return f"{head}\n{section}:\n{line}{own}{after}"


@run_job
def main(job) -> None:
    """Run the rule `searched_rigs` or, which needs no run, `default_rig`."""
    config = load_plausible(job.input.config)
    if job.rule == "default_rig":
        write_text(Path(job.output[0]), default_rig(config))
        return
    searching = Searching(config, job.input.claims, job.threads, job.params.store)
    tables = {name: searching.search(name) for name in job.params.searches}
    for (name, rows), path in zip(tables.items(), job.output.rigs, strict=True):
        write_text(Path(path), searched_rig(config, rows, name))
    write_csv(job.output.rows, pd.concat(tables.values(), ignore_index=True))
