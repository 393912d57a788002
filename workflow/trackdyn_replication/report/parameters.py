"""Table 1 and the list of parameters."""

from trackdyn.sweeps.snakemake_job import run_job

import numpy as np
import pandas as pd

from trackdyn.inputs.files import write_csv
from trackdyn.rig.groove import Groove
from trackdyn.rig.rig import load_rig, parameter_table


def table1(groove: Groove) -> pd.DataFrame:
    """Tabulate the geometry of the ten areas: ``area, type, O_x_mm, O_y_mm, r_mm, u_x, u_y, theta_deg, length_mm``."""
    table = pd.DataFrame({"area": np.arange(1, 11), "type": np.where(groove.convex, "convex", "concave")})
    table[["O_x_mm", "O_y_mm"]] = 1e3 * groove.centre + 0.0  # no -0
    table["r_mm"] = 1e3 * groove.radius
    table[["u_x", "u_y"]] = groove.direction
    table["theta_deg"] = np.degrees(groove.half_angle)
    table["length_mm"] = 2e3 * groove.radius * groove.half_angle
    return table


@run_job
def main(job) -> None:
    """Rule `parameters`."""
    table, groove = parameter_table(job.input.rig), load_rig(job.input.rig).groove_profile
    write_csv(job.output.csv, table)
    write_csv(job.output.groove, table1(groove))
