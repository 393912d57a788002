"""Metrics of runs, and events of the meshing process."""

from trackdyn.sweeps.job import run_job

import pandas as pd

from trackdyn.files import write_csv, write_text
from trackdyn.measure.columns import schema_text
from trackdyn.measure.contacts import mean_events, smoothed_maxima, spells
from trackdyn.measure.metrics import run_metrics
from trackdyn.simulation.recording import load_recording


def main(job) -> None:
    """Rule `metrics`."""
    runs, events, contacts = [], [], []
    for run, path in zip(job.params.runs, job.input.recordings, strict=True):
        recording = load_recording(path)
        runs.append(run_metrics(run, recording))
        if run.startswith("meshing/"):
            contacts.append(spells(recording).assign(run=run))
            events += [mean_events(recording).assign(run=run), smoothed_maxima(recording).assign(run=run)]
    out, table = job.output, pd.DataFrame(runs)
    write_csv(out.csv, table, float_format="%.9g")  # errors reach the seventh digit
    write_text(out.schema, schema_text(table.columns))
    table = pd.concat(events)
    write_csv(out.events, table)
    write_text(out.events_schema, schema_text(table.columns, "events"))
    write_csv(out.spells, pd.concat(contacts))


if __name__ == "__main__":
    run_job(main)
