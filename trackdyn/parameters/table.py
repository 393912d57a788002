"""The parameters of a rig file as a table."""

from pathlib import Path

import pandas as pd

from trackdyn.parameters.quantities import entries_of, number_of
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.rig_file import read_rig


def parameter_table(path: Path | str) -> pd.DataFrame:
    """Every parameter of a rig file: ``name, value, unit, kind, low, high, outside, source``, and the derived ones.

    ``outside`` says on which side a value leaves its range.
    """
    rig = load_rig(path)
    rows = [{"name": name, **entry} for name, entry in entries_of(read_rig(path)).items()]
    derived = f"from the equal-pitch radius, {rig.sprocket.teeth} [asin(a/2r) + asin(b/2r)] = pi"
    rows.append(dict(name="connector length", value=rig.connector_length, unit="m", kind="derived", source=derived))
    rows.append(dict(name="pin circle", value=rig.pin_circle, unit="m", kind="derived", source=derived))
    for row in rows:
        value, low, high = (number_of(row.get(key)) for key in ("value", "low", "high"))
        row["outside"] = "below" if value < low else "above" if value > high else ""
    return pd.DataFrame(rows, columns=["name", "value", "unit", "kind", "low", "high", "outside", "source"])
