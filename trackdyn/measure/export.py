"""Tables of recordings: measures, contacts, and files for spreadsheets, pandas (CSV) and MATLAB (``.mat``)."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import InputError, shown
from trackdyn.inputs.files import replacing, write_text
from trackdyn.inputs.validation import typed
from trackdyn.measure.contacts import contacts
from trackdyn.measure.metrics import shown_measures
from trackdyn.model.arrays import SIDES
from trackdyn.simulation.recording import Recording, as_list

ENDINGS = (".csv", ".mat")
# text at the beginning of MATLAB 5 files; scipy's has the time, so that equal runs would give different files
MAT_HEADER = b"MATLAB 5.0 MAT-file, written by trackdyn; its variable origin names rig and scene".ljust(116)
# comment of a file, which distinguishes it from a measurement
SYNTHETIC = "synthetic, not measured"


class Measures(pd.DataFrame):
    """Table of measures that prints all rows and columns."""

    def __repr__(self) -> str:
        return self.to_string(float_format="{:.5g}".format, na_rep="-")

    __str__ = __repr__


@typed
def measures(recording: Recording) -> pd.DataFrame:
    """Return the measures of a run, such as ``measures(recording).loc["rms_g", ["value", "error"]]``.

    One row per measure with its name as index, such as ``rms_g`` or ``left_share_pct``, and the columns ``value``,
    ``error`` (standard error of scatter and step), ``half_width`` (half of the 95 % interval), both NaN if unknown,
    ``unit`` and ``measure``, a description. Measures are RMS, SD and lines of the acceleration; contact durations and
    peaks of the sprocket's arcs and the ring, if the scene logs contacts; sliding work. Measures that need a longer
    run are left out. A rig with several sensors has one row per measure of the acceleration and sensor, whose name is
    in one more column, ``sensor``.
    """
    table, errors = pd.DataFrame(shown_measures(recording)).set_index("name"), ["error", "half_width"]
    columns = ["value", *errors, "unit", "measure", *table.columns[5:]]
    return Measures(table.astype(dict.fromkeys(errors, float))[columns])


def contact_table(recording: Recording, pitches: Sequence[int] | int = ()) -> pd.DataFrame:
    """Return every contact with the sprocket that began and ended within the record, sorted by pitch.

    Parameters
    ----------
    recording : Recording
        Run with a log of contacts.
    pitches : sequence of int, or int
        Pitches, from 1; all of the chain if it is empty.

    Returns
    -------
    DataFrame
        ``pitch``, ``side`` (left, right, ring), ``groove`` (from 1; 0 for the ring), ``start_s``, ``end_s``,
        ``touching_s`` (time in contact, without the short gaps of merged contacts),
        ``share_pct`` (the same in percent of a turn of the sprocket), ``peak_n``, ``peak_s`` and ``impulse_ns``.

    Raises
    ------
    InputError
        The recording has no log of contacts, or the chain no such pitch.
    """
    pitches, count = as_list(pitches), recording.scene.rig.chain.pitches
    if not recording.scene.contact_log or recording.scene.chain == "belt":
        raise InputError("contacts: the recording has no log of them; run a scene with contact_log=True, and no belt")
    if wrong := [pitch for pitch in pitches if pitch not in range(1, count + 1)]:
        raise InputError(f"pitch = {shown(wrong[0])}: is not a pitch of this chain; 1 to {count} are")
    rows, turn = contacts(recording), recording.periods.turn
    names = ["pitch", "side", "groove", "start_s", "end_s", "touching_s", "share_pct", "peak_n", "peak_s", "impulse_ns"]
    rows |= {"pitch": rows["pitch"] + 1, "side": np.array(SIDES)[rows["side"]]}
    table = pd.DataFrame(rows | {"share_pct": 100 * rows["touching_s"] / turn}, columns=names)
    chosen = table[table["pitch"].isin(pitches)] if pitches else table
    return chosen.sort_values(["pitch", "start_s", "side"], ignore_index=True)


@typed
def export(
    recording: Recording,
    path: Path | str,
    sensor: str | int | None = None,
    pitches: Sequence | int = (),
    contacts: bool = False,
) -> pd.DataFrame:
    """Write a recording as a table, CSV or MATLAB's by the ending of the file, and return the table.

    Parameters
    ----------
    recording : Recording
        Run to export.
    path : path
        File with the ending ``.csv``, whose first line is a comment on program, rig and scene, or ``.mat``, with one
        variable per column and that comment as ``origin``.
    sensor : str or int, optional
        Sensor whose axes are written; all of them by default.
    pitches : sequence of int, or int
        Pitches whose contacts are written as well, from 1 (`Recording.to_frame`).
    contacts : bool
        Write a row for every contact (`contact_table`), of all pitches if none is stated, in place of the samples.

    Raises
    ------
    InputError
        The ending is another one, the recording lacks the data, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix not in ENDINGS:
        raise InputError(f"path = {shown(str(path))}: the name must end in {' or '.join(ENDINGS)}")
    if contacts:
        table = contact_table(recording, pitches)
    else:
        table = (recording if sensor is None else recording.with_sensor(sensor)).to_frame(pitches)
    origin = f"{SYNTHETIC}: {recording.origin}"
    if path.suffix == ".csv":
        write_text(path, f"# {origin}\n{table.to_csv(index=False, float_format='%.12g', lineterminator=chr(10))}")
        return table
    from scipy.io import savemat

    variables = {name: table[name].to_numpy() for name in table} | {"origin": origin}
    savemat(buffer := BytesIO(), variables, long_field_names=True, oned_as="column", do_compression=True)
    with replacing(path) as temporary:
        temporary.write_bytes(MAT_HEADER + buffer.getvalue()[len(MAT_HEADER) :])
    return table
