"""Files of an identification: the rig of the best values and the tables."""

from collections.abc import Iterator
from functools import reduce
from operator import getitem
from pathlib import Path

import yaml

from laboratory.inference.identification.identify import Identification
from trackdyn.files import replacing, write_csv, write_text
from trackdyn.rig.quantities import entries_of
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.rig.rig_file import read_rig


def best_rig_text(answer: Identification, rig_path: Path | str) -> str:
    """Text of the rig's file at ``rig_path`` with the best values of an ``answer``.

    The source of each value says from which records it was identified and how sure that is.
    """
    data, rig = read_rig(rig_path), answer.unknowns.rig
    entries, files = entries_of(data), ", ".join(measurement.record.path.name for measurement in answer.measured)
    rows = zip(answer.tables["unknowns"].to_dict("records"), answer.unknowns.unknowns, strict=True)
    rows_by_name = {name: row for row, unknown in rows for name in unknown.names}
    for name, value in answer.unknowns.changes(answer.unknowns.values(answer.best)).items():
        if name not in entries:  # its default
            *sections, field = rig.fields[name].keys
            own = {"unit": rig.fields[name].unit, "source": "default"}
            entries[name] = reduce(getitem, sections, data)[field] = own
        row, entry = rows_by_name[name], entries[name]
        entry["value"] = float(f"{value:.6g}")
        entry["kind"] = "fitted"
        entry["source"] = (
            f"identified from {files}: {row['verdict']}, 90 % interval {row['q05']:.4g} to {row['q95']:.4g} "
            f"within {row['low']:.4g} to {row['high']:.4g}; before: {entry['source']}"
        )
    return "\n".join([f"# {rig_path} with values identified by `trackdyn identify`.", *_lines(data)]) + "\n"


def _lines(section: dict, indent: str = "") -> Iterator[str]:
    """Sections below each other, an entry on a line of its own, as rig files have it."""
    for name, item in section.items():
        if not indent:
            yield ""
        if "value" in item:
            flow = yaml.safe_dump(item, default_flow_style=True, sort_keys=False, width=10**6, allow_unicode=True)
            yield f"{indent}{name}: {flow.strip()}"
        elif item:
            yield f"{indent}{name}:"
            yield from _lines(item, f"{indent}  ")


def write_answer(answer: Identification, rig_path: Path | str, out: Path) -> Rig:
    """Write the rig of ``rig_path`` with the best values of an ``answer``, and the tables, into the folder ``out``.

    Returns the rig as it is read back; `InputError`: the values make no rig.
    """
    with replacing(out / "rig.yaml") as temporary:
        write_text(temporary, best_rig_text(answer, rig_path))
        rig = load_rig(temporary)  # refuses values that make no rig
    for name, table in answer.tables.items():
        write_csv(out / f"{name}.csv", table)
    return rig
