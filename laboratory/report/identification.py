"""The page of an identification, with its pictures."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.inference.identification.answer import write_answer
from laboratory.inference.identification.calibration import CalibrationConfig
from laboratory.inference.identification.experiment import simulated_ay
from laboratory.inference.identification.features import turns_of
from laboratory.inference.identification.identify import Identification, Settings, identify
from laboratory.inference.identification.informative import requested_unknowns, tellable, unknown_of
from laboratory.inference.identification.measured import Measured, read_records
from laboratory.inference.identification.tables import wider
from laboratory.inference.verdict import IDENTIFIED, IN_DOUBT, ONE_SIDED
from laboratory.plausible.unknowns import Unknown
from laboratory.report.figures.identification import features_figure, posterior_figure, spectra_figure
from replication.report.page.builder import embedded_picture
from trackdyn.files import write_text
from trackdyn.plots.rendering import environment
from trackdyn.plots.style import save
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.rig.validation import validated
from trackdyn.rig.yaml_file import read_yaml
from trackdyn.scene.scene import Periods
from trackdyn.sensor.sensor_mapping import load_mapping

HERE = Path(__file__).parent
COLUMNS = ["unknown", "verdict", "best", "q05", "q95", "low", "high", "present", "width"]


def write_identification(
    measured: Sequence[Measured],
    rig_path: Path | str,
    unknowns: Sequence[Unknown],
    out: Path,
    store: Path,
    settings: Settings,
    synthetic: str = "",
    say: Callable[[str], None] = print,
) -> None:
    """Identify unknowns of a rig, by default those that the records can tell, and write files and page into ``out``.

    Raises
    ------
    InputError
        An unknown is none of the rig, or nothing can be identified (`identify`).
    """
    rig, widths = load_rig(rig_path), None
    for measurement in measured:
        turns, rpm = len(measurement.statistics), measurement.speed.rpm
        say(f"{measurement.record.path}: {turns} turns of the loop at {rpm:.5g} rev/min")
    if not unknowns:
        unknowns, widths = tellable(measured, rig, rig_path, store, settings.jobs, settings.progress)
    requested = requested_unknowns(unknowns, rig, rig_path)
    for unknown in requested.unknowns:
        scale = "its logarithm" if unknown.scale == "log" else "itself"
        say(f"unknown: {unknown.label} within {unknown.low:g} to {unknown.high:g}, even in {scale}")
    answer = identify(measured, requested, store, settings, say)
    if widths is not None:
        answer.tables["tellable"] = widths
    page = write_identification_page(answer, write_answer(answer, rig_path, out), out, synthetic)
    table = answer.tables["unknowns"]
    say(table.drop(columns=["scale"]).to_string(index=False, float_format=lambda value: f"{value:.4g}"))
    say(identification_headline(table))
    say(f"written: {page}")


def write_identification_page(answer: Identification, rig: Rig, out: Path, synthetic: str = "") -> Path:
    """Draw the figures and write ``index.html`` into ``out``.

    ``rig`` is the rig of the best values, ``synthetic`` what records are called that were not measured.
    """
    called = f"{synthetic} record" if synthetic else "record"
    tables, unknowns = answer.tables, answer.unknowns.unknowns
    points, verdicts = answer.draws.points[:, : len(unknowns)], list(tables["unknowns"]["verdict"])
    figures = {
        "posterior": posterior_figure(unknowns, points, answer.best, verdicts),
        "features": features_figure(tables["features"], called),
        "spectra": spectra_figure(_spectra(answer, rig), called),
    }
    held_out = tables.get("held_out")
    if held_out is not None:
        figures["held_out"] = features_figure(held_out, called)
    for name, figure in figures.items():
        save(figure, out / f"{name}.png")
    template = environment(HERE).get_template("identification.html.j2")
    text = template.render(
        headline=identification_headline(tables["unknowns"]),
        synthetic=synthetic,
        unknowns=_rows(tables["unknowns"][COLUMNS]),
        correlations=_rows(tables["correlations"]),
        discrepancies=_rows(tables["discrepancies"]),
        wider=wider(tables["discrepancies"]),
        held=None if held_out is None else {"inside": int(held_out["inside"].sum()), "count": len(held_out)},
        records=_rows(_records(answer)),
        tellable=_rows(tables["tellable"]) if "tellable" in tables else None,
        simulated=answer.effort,
        pictures={name: embedded_picture(out / f"{name}.png") for name in figures},
    )
    write_text(out / "index.html", text)
    return out / "index.html"


def identification_headline(table: pd.DataFrame) -> str:
    """The answer in a sentence, from the ``table`` of the unknowns."""
    parts = []
    for row in table.to_dict("records"):
        interval = f"{row['q05']:.3g} to {row['q95']:.3g}"
        if row["verdict"] == IDENTIFIED:
            parts.append(f"{row['unknown']} is {row['median']:.3g} ({interval})")
        elif row["verdict"] == ONE_SIDED:
            side = f"above {row['q05']:.3g}" if row["excluded"] == "low" else f"below {row['q95']:.3g}"
            parts.append(f"{row['unknown']} is {interval if row['excluded'] in ('', 'both') else side}")
        elif row["verdict"] == IN_DOUBT:
            parts.append(f"{row['unknown']} is in doubt ({interval}): no rig explains the records")
        else:
            parts.append(f"{row['unknown']} is not identified")
    return "; ".join(parts) + "."


def _spectra(answer: Identification, rig: Rig) -> list[tuple[str, float, np.ndarray, np.ndarray]]:
    """Whole turns of every record and of the best rig."""
    spectra = []
    for measurement in answer.measured:
        rate = measurement.speed.record_rate
        simulated = turns_of(simulated_ay(rig, measurement.speed, 1), rate, Periods.at(rig, measurement.speed.rpm).loop)
        measured = turns_of(measurement.record.ay_g, rate, measurement.turn_s)
        spectra.append((f"{measurement.name}: {measurement.speed.rpm:.4g} rev/min", rate, measured, simulated))
    return spectra


def _records(answer: Identification) -> pd.DataFrame:
    rows = [
        {"record": measurement.record.path.name, "speed_rpm": measurement.speed.rpm, "turn_s": measurement.turn_s}
        | {"turns": len(measurement.statistics)}
        | {name: getattr(measurement.record, name) for name in ("rate_hz", "seconds", "clipped")}
        for measurement in answer.measured
    ]
    return pd.DataFrame(rows)


def _rows(table: pd.DataFrame) -> list[dict]:
    """Rows as plain data."""
    return table.astype(object).where(table.notna(), None).to_dict("records")


@run_job
def main(job) -> None:
    """Rule `identify_synthetic`."""
    inputs, out = job.input, Path(job.output.page).parent
    config, rig = validated(CalibrationConfig, read_yaml(inputs.config), inputs.config), load_rig(inputs.rig)
    unknowns = [unknown_of(name) for unknown in config.unknowns for name in unknown.names]
    measured = read_records(inputs.records, rig, load_mapping(), config.speeds_rpm, config.ring_radius_m, "standard")
    choices = tuple(config.choices.items())
    measured = [replace(record, speed=record.speed._replace(choices=choices)) for record in measured]
    settings = Settings(config.simulations, 1, 3000, job.threads, config.seed, False)
    write_identification(measured, inputs.rig, unknowns, out, Path(job.params.store), settings, "synthetic")
