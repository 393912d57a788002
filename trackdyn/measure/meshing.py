"""Contact spells and the measures of Sect. 6: durations, phases and forces of the meshing.

A passage is one pass of a pitch over the sprocket. Its phase 0 is its first contact of any kind: the
ring's touch with a ring, the first arc's without. Phases are in turns of the sprocket from there on.
"""

import numpy as np
import pandas as pd

from trackdyn.integrate.spells import SPELL_COLUMNS
from trackdyn.recording import Recording

SIDES = ("left", "right", "ring")
NAN = float("nan")
# contacts of one side that are apart by less than this are one spell that chatters, s
MERGE_GAP = 0.004
# an area must be visited by spells of at least this share of a turn in all to be named, %
LEAST_SHARE = 0.1


def sprocket_period(recording: Recording) -> float:
    """Time of one sprocket turn, s; infinite at standstill."""
    rpm = recording.meta["scene"]["motor_rpm"]
    return 60 * recording.meta["rig"]["sprocket"]["transmission_ratio"] / rpm if rpm else np.inf


def loop_period(recording: Recording) -> float:
    """Time of one revolution of the loop, s."""
    rig = recording.meta["rig"]
    return sprocket_period(recording) * rig["chain"]["pitches"] / rig["sprocket"]["teeth"]


def raw_spells(recording: Recording) -> pd.DataFrame:
    """The log as it is, times from the start of the record, spells cut by its start left out."""
    table = pd.DataFrame(recording.spells, columns=list(SPELL_COLUMNS))
    begin, step = float(recording.begin), recording.meta["scene"]["step"]
    table = table[table["start_s"] > begin + 1.5 * step].copy()
    for column in ("start_s", "end_s", "peak_s"):
        table[column] -= begin
    table["pitch"] = table["pitch"].astype(int) + 1
    table["side"] = pd.Categorical.from_codes(table["side"].astype(int), categories=SIDES).astype(str)
    table[["groove", "areas"]] = table[["groove", "areas"]].astype(int)
    return table


def _area_names(bits: int) -> str:
    return ",".join(str(j + 1) for j in range(10) if bits >> j & 1) or "none"


def passages(recording: Recording) -> pd.DataFrame:
    """One row for each side of each whole passage.

    Returns
    -------
    DataFrame
        ``pitch, passage, first_s`` (first contact of any kind), ``side, start_s, end_s, touching_s,
        share_pct`` (of one sprocket turn), ``phase_start, phase_end`` (turns after the first contact),
        ``peak_n, peak_s, impulse_ns, square_n2s, areas`` (bit j - 1: area j). Passages cut by either
        end of the record are left out.
    """
    table = raw_spells(recording).sort_values(["pitch", "start_s"], kind="stable")
    turn = sprocket_period(recording)
    end = len(recording.time) / recording.rate
    if table.empty or not np.isfinite(turn):
        return pd.DataFrame(columns=["pitch", "passage", "first_s", "side", "start_s", "end_s", "touching_s", "share_pct",
                                     "phase_start", "phase_end", "peak_n", "peak_s", "impulse_ns", "square_n2s",
                                     "areas"])  # fmt: skip
    # a new passage begins with a new pitch or after half a turn without a beginning contact
    fresh = (table["pitch"].diff() != 0) | (table["start_s"] - table["end_s"].groupby(table["pitch"]).cummax().shift() > turn / 2)
    table["passage"] = fresh.cumsum()
    first = table.groupby("passage")["start_s"].transform("min")
    # whole: nothing of it can lie before the record's start or after its end
    whole = (first > turn / 2) & (first + turn < end)
    table = table[whole]
    table["first_s"] = first[whole]
    table["touching_s"] = table["end_s"] - table["start_s"]
    peak = table.loc[table.groupby(["passage", "side"])["peak_n"].idxmax()].set_index(["passage", "side"])
    grouped = table.groupby(["passage", "side"])
    out = grouped.agg(
        pitch=("pitch", "first"),
        first_s=("first_s", "first"),
        start_s=("start_s", "min"),
        end_s=("end_s", "max"),
        touching_s=("touching_s", "sum"),
        impulse_ns=("impulse_ns", "sum"),
        square_n2s=("square_n2s", "sum"),
        areas=("areas", lambda a: int(np.bitwise_or.reduce(a.to_numpy()))),
    )
    out[["peak_n", "peak_s"]] = peak[["peak_n", "peak_s"]]
    out["share_pct"] = 100 * out["touching_s"] / turn
    out["phase_start"] = (out["start_s"] - out["first_s"]) / turn
    out["phase_end"] = (out["end_s"] - out["first_s"]) / turn
    return out.reset_index()


def _mean(values) -> tuple[float, float]:
    """Mean and its standard error."""
    values = np.asarray(values, dtype=float)
    if len(values) == 0:
        return NAN, NAN
    return float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else NAN


def meshing_summary(recording: Recording) -> dict:
    """Shares, phases and forces of the contacts, means over whole passages of all connectors.

    RMS and SD are of the normal force over the whole run, times without contact included, as a record
    of one appointed connector would give: from the impulse and the integral of the squared force over
    whole passages, spread over one loop period each. ``*_contact_n`` are the second reading, over the
    time in contact alone. Without whole passages everything is NaN.
    """
    table = passages(recording)
    count = table["passage"].nunique() if len(table) else 0
    period = loop_period(recording)
    out: dict = {"passages": count}
    for side in SIDES:
        rows = table[table["side"] == side].set_index("passage") if count else table
        # a passage without this contact counts with zero
        every = rows.reindex(table["passage"].unique()) if count else rows
        share, error = _mean(every["share_pct"].fillna(0.0)) if count else (NAN, NAN)
        square, impulse = every["square_n2s"].fillna(0.0), every["impulse_ns"].fillna(0.0)
        mean_square, mean = (square.mean() / period, impulse.mean() / period) if count else (NAN, NAN)
        touching = rows["touching_s"].sum() if count else 0.0
        each = np.sqrt(square / period) if count else []
        out |= {
            f"{side}_share_pct": share,
            f"{side}_share_error_pct": error,
            f"{side}_rms_n": float(np.sqrt(mean_square)),
            f"{side}_rms_error_n": _mean(each)[1],
            f"{side}_sd_n": float(np.sqrt(max(mean_square - mean**2, 0.0))) if count else NAN,
            f"{side}_sd_error_n": _mean([np.sqrt(max(s / period - (i / period) ** 2, 0.0)) for s, i in zip(square, impulse, strict=True)])[1] if count else NAN,
            f"{side}_rms_contact_n": float(np.sqrt(square.sum() / touching)) if touching > 0 else (NAN if not count else 0.0),
            f"{side}_peak_n": float(rows["peak_n"].mean()) if len(rows) else NAN,
            f"{side}_phase_start": float(rows["phase_start"].mean()) if len(rows) else NAN,
            f"{side}_phase_end": float(rows["phase_end"].mean()) if len(rows) else NAN,
        }
        if side != "ring":
            out[f"{side}_areas"] = _visited(recording, side) if count else ""
    return out


def _visited(recording: Recording, side: str) -> str:
    """Areas visited for at least ``LEAST_SHARE`` of a turn a passage, such as ``2`` or ``2,3``."""
    arc = SIDES.index(side)
    areas = np.bincount(recording.area[:, :, arc].ravel(), minlength=11)[1:]
    # samples a passage that make up the least share of a turn
    loops = len(recording.time) / recording.rate / loop_period(recording)
    least = LEAST_SHARE / 100 * sprocket_period(recording) * recording.rate * loops * recording.area.shape[1]
    return _area_names(sum(1 << j for j in range(10) if areas[j] >= max(least, 1)))
