"""Errors of every included rig at the default step of a scene, against limits, with several rings."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Iterable, Mapping, Sequence
from math import floor, log10
from re import fullmatch

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import TrackdynError
from trackdyn.inputs.files import write_csv
from trackdyn.measure.catalogue import BY_COLUMN, NAMED, SENSED
from trackdyn.measure.contacts import TOUCHING, passage_arrays
from trackdyn.measure.estimators import contact_series
from trackdyn.measure.sensor import whole_samples
from trackdyn.measure.uncertainty import STEP_ERRORS, Series, error_against
from trackdyn.measure.whole_loop import work_series
from trackdyn.rig.rig import load_rig
from trackdyn.rig.rig_file import shipped_rigs
from trackdyn.scene.rings import study_radii
from trackdyn.scene.scene import Periods, Scene
from trackdyn.simulation.recording import Recording
from trackdyn.simulation.simulate import simulate
from trackdyn_replication.study.accuracy.record_statistics import LEAD_IN, answers_of
from trackdyn_replication.study.accuracy.trade import limits_of

COLUMNS = ["rig", "ring_radius_m", "rpm", "step_s", "measure", "limit", "error", "uncertainty"]
RING, NONE = "with a ring", "without a ring"
SPEEDS = {RING: (150.0, 190.0), NONE: (150.0, 180.0, 210.0)}  # motor, rev/min
RADII = 3  # of a rig, from the least ring of a study to the largest, besides its own
KNOWN = 0.5
TURNS = 2.5  # turns of the sprocket in a record of all links: some whole passages
FINER = (1, 2, 4)  # times: the steps over which a limit is extrapolated
# columns of a run for measures of all links (`measure.whole_loop.series`); other measures are columns already
OF_LINKS = {name: NAMED[name].column.name for name in SENSED} | {"line": "line_g"}


def measures_of(recording: Recording) -> dict[str, Series]:
    """Return measures of a record of all links by columns of a run, per passage: acceleration, contacts, sliding."""
    of_links = answers_of(recording)
    measures = {column: of_links[name] for name, column in OF_LINKS.items()}
    contacts = contact_series(passage_arrays(recording), recording.periods.loop)
    contacts = {name: measure for name, measure in contacts.items() if BY_COLUMN[name].column.has_error}
    for name, measure in contacts.items():  # a side that hardly touches has no meaningful force
        share = contacts[f"{name.partition('_')[0]}_share_pct"].values
        if len(share) and share.mean() >= TOUCHING:
            measures[name] = measure
    return measures | work_series(recording)


def default_step_errors(rigs: Iterable[str], speeds: Mapping[str, Sequence[float]] = SPEEDS) -> pd.DataFrame:
    """Return errors and their standard errors of all measures of rigs with several rings and none (``COLUMNS``)."""
    rows = []
    for name in rigs:
        rig = load_rig(name)
        rings = [*sorted({*study_radii(rig, RADII), *filter(None, [rig.ring_radius])}), None]
        scenes = [(ring, rpm) for ring in rings for rpm in speeds[RING if ring else NONE]]
        for ring, rpm in scenes:
            seconds = whole_samples(rig.rate, TURNS * Periods.at(rig, rpm).turn + 0.01)
            try:
                scene = Scene(rig, rpm, ring, duration=seconds, lead_in=LEAD_IN, every_link=True)
                step = scene.time_step
                runs = {step / by: measures_of(simulate(scene.with_(step=step / by))) for by in FINER}
            except TrackdynError as error:  # refused by the program: no record, and so no error
                print(f"{name}, {ring} m, {rpm:g} rpm: {error}", flush=True)
                continue
            for measure, limit in limits_of(runs).items():
                rows.append([name, ring, rpm, step, measure, limit.value, *error_against(runs[step][measure], limit)])
            print(f"{name}, {ring} m, {rpm:g} rpm, {step:g} s", flush=True)
    return pd.DataFrame(rows, columns=COLUMNS)


def known_errors(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows whose error is known to half of itself (`KNOWN`), with its ``size``, over `Column.size`."""
    known = rows[rows["uncertainty"] < KNOWN * rows["error"].abs()]
    scale = np.array([BY_COLUMN[row.measure].column.size(row.limit) for row in known.itertuples()])
    return known.assign(size=known["error"].abs() / scale, uncertainty=known["uncertainty"] / scale)


def step_errors(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the largest known errors by groups of columns (`STEP_ERRORS`) and other columns, rounded up."""
    known, table = known_errors(rows), []
    others = (name for name in known["measure"].unique() if not any(fullmatch(group, name) for group in STEP_ERRORS))
    for pattern in (*STEP_ERRORS, *others):
        of_group = known[[fullmatch(pattern, name) is not None for name in known["measure"]]]
        bare = of_group["ring_radius_m"].isna()
        table.append([pattern, *(_rounded_up(of_group.loc[rows, "size"].max()) for rows in (~bare, bare))])
    return pd.DataFrame(table, columns=["columns", "with_ring", "without_ring"])


def _rounded_up(size: float) -> float:
    if not size > 0:
        return 0.0
    unit = 10.0 ** (floor(log10(size)) - 1)
    return float(f"{np.ceil(size / unit) * unit:.2g}")


def default_step_text(rows: pd.DataFrame) -> str:
    """Return sentences on the largest `known_errors` of RMS and mean left peak, with and without a ring."""
    sentences = []
    for bare, group in rows.groupby(rows["ring_radius_m"].isna()):
        known, parts = known_errors(group).set_index("measure"), []
        for words, column in (("RMS", "rms_g"), ("mean left peak", "left_peak_n")):
            if column in known.index:
                row = known.loc[[column]].sort_values("size").iloc[-1]
                ring = "" if pd.isna(row["ring_radius_m"]) else f"{row['ring_radius_m']:.4g} m, "
                size = f"{100 * row['size']:.2g} +- {100 * row['uncertainty']:.2g} %"
                parts.append(f"{words} {size} ({row['rig']}, {ring}{row['rpm']:g} rpm)")
        speeds = ", ".join(f"{rpm:g}" for rpm in sorted(group["rpm"].unique()))
        sentences.append(
            f"The {group['rig'].nunique()} included rigs at their default steps, {NONE if bare else RING}, at {speeds} "
            f"rpm have errors (+- standard error) of at most: {', '.join(parts)}."
        )
    return "\n".join(sentences)


@run_job
def main(job) -> None:
    """Rule `default_step`."""
    rows = default_step_errors(shipped_rigs())
    write_csv(job.output[0], rows)
    write_csv(job.output[1], step_errors(rows))
