"""The files of the synthetic records and their description."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pandas as pd

from trackdyn.errors import InputError
from trackdyn.measure.sensor_csv import COLUMNS, write_sensor_csv
from trackdyn.synthetic import BITS, GENERATOR_VERSION, GRAVITY, RANGE_G, RATE_HZ, SPEEDS, closeness, generate


def write_record(folder, rpm: int) -> np.ndarray:
    """Write ``{rpm}rpm.csv`` into an existing folder and return its y acceleration, g.

    Raises
    ------
    InputError
        A speed that is not printed, or a folder that cannot be written.
    """
    t, ax, ay, az = generate(rpm)
    write_sensor_csv(Path(folder) / f"{rpm}rpm.csv", t, ax, ay, az, comments=_comments(SPEEDS[rpm]))
    return ay


def write_dataset(folder) -> pd.DataFrame:
    """Write the records of all speeds and their ``datapackage.json``; equal calls give equal bytes.

    Parameters
    ----------
    folder : path-like
        Folder, made if it does not exist.

    Returns
    -------
    DataFrame
        The table of :func:`closeness`.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: the folder cannot be made ({error.strerror}); take another.") from error
    table = closeness({rpm: write_record(folder, rpm) for rpm in SPEEDS})
    text = json.dumps(_datapackage(folder, table), indent=2, ensure_ascii=False) + "\n"
    (folder / "datapackage.json").write_bytes(text.encode("utf-8"))
    return table


def _comments(speed):
    """Comment lines at the top of a file."""
    return (
        "SYNTHETIC: not measured. Stand-in for the unpublished record of the paper's experiment;",
        "agreement of a simulation with it is no validation.",
        f"motor speed {speed.rpm} rev/min; {RATE_HZ} Hz; range +-{RANGE_G:g} g in {BITS} bit",
        "t_s: time, s; ax_g along the link, ay_g along its outward normal, az_g lateral: specific force, g",
        f"made by trackdyn.synthetic {GENERATOR_VERSION}, seed {speed.seed} (PCG64)",
        f"mean loop frequency {speed.loop_hz:.5f} Hz, fluctuation of the speed {speed.fluctuation:.5f} (RMS)",
    )


def _datapackage(folder, table):
    """Frictionless description of the written files."""
    axes = ("along the link, in the direction of travel", "along the outward normal of the link", "lateral")
    limits = {"minimum": -RANGE_G, "maximum": RANGE_G}
    fields = [{"name": COLUMNS[0], "type": "number", "unit": "s", "description": "Time."}]
    for name, axis in zip(COLUMNS[1:], axes, strict=True):
        what = f"Synthetic specific force {axis}; 1 g = {GRAVITY} m/s2."
        field = {"name": name, "type": "number", "unit": "g", "description": what, "constraints": limits}
        fields.append(field)
    resources = []
    for rpm, row in table.iterrows():
        speed, data = SPEEDS[rpm], (folder / f"{rpm}rpm.csv").read_bytes()
        resources.append(
            {
                "name": f"synthetic-{rpm}rpm",
                "path": f"{rpm}rpm.csv",
                "profile": "tabular-data-resource",
                "title": f"Synthetic record at a motor speed of {rpm} rev/min",
                "format": "csv",
                "mediatype": "text/csv",
                "encoding": "utf-8",
                "dialect": {"commentChar": "#", "header": True},
                "bytes": len(data),
                "hash": f"sha256:{hashlib.sha256(data).hexdigest()}",
                "seed": speed.seed,
                "fitted": {"loop_hz": speed.loop_hz, "fluctuation": speed.fluctuation},
                "printed": {"main_hz": speed.printed_hz, "amplitude_g": speed.printed_g},
                "achieved": {
                    "main_hz": round(row.achieved_hz, 5),
                    "amplitude_g": round(row.achieved_g, 4),
                    "amplitude_difference_percent": round(row.difference_percent, 2) + 0.0,  # no -0.0
                    "rms_g": round(row.rms_g, 4),
                    "sd_g": round(row.sd_g, 4),
                    "peak_g": round(row.peak_g, 3),
                    "clipped_samples": int(row.clipped),
                },
                "schema": {"fields": fields},
            }
        )
    return {
        "profile": "tabular-data-package",
        "name": "trackdyn-synthetic-link-acceleration",
        "title": "Synthetic acceleration of a link of a double-pin track",
        "description": (
            "SYNTHETIC, not measured. The paper's measured records are not published; these stand in for "
            "them, and agreement of a simulation with them is no validation. Made without simulated "
            "dynamics: a link on an ideal belt around three wheels (assumed layout, the same as the "
            "simulated rig had), a slowly fluctuating speed, half-sine impacts at every pitch that runs on "
            "or off a wheel, a sensor that rings on its glue, noise, 16 bit and a range of +-20 g. Fitted "
            "to the paper's printed main frequency and amplitude is the mean loop frequency, at 210 rpm the "
            "size of the fluctuation instead; everything else is assumed, RMS, SD and impacts included. "
            "'achieved' is taken as in the paper: the highest line of a rectangular-window spectrum of "
            "90,000 points at 1000 Hz."
        ),
        "version": GENERATOR_VERSION,
        "keywords": ["synthetic", "acceleration", "track", "not measured"],
        "licenses": [
            {
                "name": "CC0-1.0",
                "path": "https://creativecommons.org/publicdomain/zero/1.0/",
                "title": "CC0 1.0 Universal",
            }
        ],
        "generator": {
            "command": "python -m trackdyn.synthetic",
            "version": GENERATOR_VERSION,
            "random_numbers": "numpy PCG64",
        },
        "resources": resources,
    }
