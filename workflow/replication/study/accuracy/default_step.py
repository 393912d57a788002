"""How far every included rig is off its limits at the step that a scene takes by default."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from replication.study.accuracy.statistics import LEAD_IN, scale_of
from replication.study.accuracy.trade import limits_of, run_answer
from trackdyn.errors import TrackdynError
from trackdyn.files import write_csv
from trackdyn.measure.sensor import whole_samples
from trackdyn.measure.uncertainty import RELATIVE, SHARES, error_against
from trackdyn.rig.rig import load_rig
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.scene.scene import Periods, Scene

COLUMNS = ["rig", "ring", "rpm", "step_s", "measure", "limit", "error", "uncertainty"]
SPEEDS = {"own": (150.0, 210.0), "none": (150.0, 180.0, 210.0)}  # motor, rev/min, with the ring of the rig and without
RINGS = {"own": "with their rings", "none": "without a ring"}
KNOWN = 0.5
TURNS = 2.5  # turns of the sprocket in a record of all links: some whole passages
FINER = (1, 2, 4)  # times: the steps over which a limit is extrapolated


def default_step_errors(rigs: Iterable[str], speeds: Mapping[str, Iterable[float]] = SPEEDS) -> pd.DataFrame:
    """Error and its standard error of every measure of a rig with its own ring and none: relative, shares in turns.

    Returns
    -------
    DataFrame
        ``COLUMNS``; the limits are those of all links over the default step, its half and its quarter.
    """
    rows = []
    for name in rigs:
        rig = load_rig(name)
        for ring, rpm in ((ring, rpm) for ring, rpms in speeds.items() for rpm in rpms):
            if ring == "own" and rig.ring_radius is None:
                continue
            seconds = whole_samples(rig.rate, TURNS * Periods.at(rig, rpm).turn + 0.01)
            fields = {"duration": seconds, "lead_in": LEAD_IN, "every_link": True}
            scene = Scene(rig, rpm, rig.ring_radius if ring == "own" else None, **fields)
            try:
                step = scene.time_step
                runs = {step / by: run_answer(scene.with_(step=step / by)) for by in FINER}
            except TrackdynError as error:  # refused by the program: no record, and so no error
                print(f"{name}, {rpm:g} rpm: {error}", flush=True)
                continue
            for measure, limit in limits_of(runs).items():
                if measure in RELATIVE + SHARES and limit.value:
                    errors = np.array(error_against(runs[step].series[measure], limit)) / scale_of(measure, limit.value)
                    rows.append([name, ring, rpm, step, measure, limit.value, *errors])
            print(f"{name}, ring {ring}, {rpm:g} rpm, {step:g} s", flush=True)
    return pd.DataFrame(rows, columns=COLUMNS)


def default_step_text(rows: pd.DataFrame) -> str:
    """The largest errors of RMS and mean left peak over rigs and speeds, with rings and without, a sentence each.

    An error that is not known to half of itself (`KNOWN`) is left out.
    """
    return "\n".join(_worst(group, RINGS[ring]) for ring, group in rows.groupby("ring", sort=False))


def _worst(rows: pd.DataFrame, rings: str) -> str:
    known = rows["measure"].isin(["rms", "left_peak"]) & (rows["uncertainty"] < KNOWN * rows["error"].abs())
    worst = rows.loc[known].assign(error=rows["error"].abs())
    worst = worst.loc[worst.groupby("measure")["error"].idxmax()].set_index("measure")
    parts = [
        f"{words} {100 * row['error']:.2g} +- {100 * row['uncertainty']:.2g} % ({row['rig']}, {row['rpm']:g} rpm)"
        for words, row in (("RMS", worst.loc["rms"]), ("mean left peak", worst.loc["left_peak"]))
    ]
    speeds = ", ".join(f"{rpm:g}" for rpm in sorted(rows["rpm"].unique()))
    return (
        f"The {rows['rig'].nunique()} included rigs at their default steps, {rings}, at {speeds} rpm have errors of at "
        f"most: {', '.join(parts)}."
    )


@run_job
def main(job) -> None:
    """Rule `default_step`."""
    write_csv(job.output[0], default_step_errors(shipped_rigs()))
