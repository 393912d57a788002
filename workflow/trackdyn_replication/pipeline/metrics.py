"""Metrics of runs, and events of the meshing process."""

from trackdyn.sweeps.snakemake_job import run_job

from pathlib import Path

import pandas as pd

from trackdyn.inputs.files import write_csv, write_text
from trackdyn.measure.events import like_peaks, mean_events
from trackdyn.measure.metrics import run_metrics
from trackdyn.simulation.recording import load_recording


@run_job
def main(job) -> None:
    """Rules `measure`, and `metrics`, which joins its tables and adds the meshing process."""
    recordings = {run: load_recording(path) for run, path in zip(job.params.runs, job.input.recordings, strict=True)}
    runs = pd.DataFrame([run_metrics(run, recording) for run, recording in recordings.items()])
    out, parts = job.output, [Path(path).read_text(encoding="utf-8") for path in job.input.get("parts", ())]
    head, _, rows = runs.to_csv(index=False, lineterminator="\n", float_format="%.9g").partition("\n")
    # errors reach the seventh digit; all tables have the same head
    write_text(out.csv, f"{head}\n{rows}" + "".join(text.partition("\n")[2] for text in parts))
    if not parts:
        return
    events = [
        events(recording).assign(run=run)
        for run, recording in recordings.items()
        for events in (mean_events, like_peaks)
    ]
    write_csv(out.events, pd.concat(events))
