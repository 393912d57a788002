"""Mobilised friction of the default rig's ring by its creep slope."""

from trackdyn.sweeps.snakemake_job import run_job

import pandas as pd

from laboratory.plausible.settings import PlausibleConfig, load_plausible
from laboratory.plausible.shares import CREEP, CREEP_EDGES
from trackdyn.inputs.files import write_csv
from trackdyn.measure.whole_loop import mobilised_friction
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop


def mobilised_table(config: PlausibleConfig, rig: Rig, slopes: list[float]) -> pd.DataFrame:
    """Return the mobilised friction of a rig's ring at the printed radius, with other transition velocities alone.

    A row a creep slope (s/m) and a speed of the study, after its longest wait: ``creep, transition_velocity`` (m/s),
    ``rpm, mobilised_friction, error`` (1; over the passages of a turn).
    """
    rows = []
    for slope in slopes:
        velocity = rig.ring_contact.friction_static / slope
        other = rig.changed(ring_contact__transition_velocity=velocity)
        for rpm in config.radii_m:
            wait = max(start.wait_s for start in config.row.starts)
            loop = Loop(Scene(other, motor_rpm=rpm, ring_radius=config.ring_radius_m, **config.scene))
            loop.advance(wait)
            value, error, _ = mobilised_friction(loop.record(loop.scene.periods.turn + 1 / rig.rate))
            rows.append([slope, velocity, rpm, value, error])
    return pd.DataFrame(rows, columns=[CREEP, "transition_velocity", "rpm", "mobilised_friction", "error"])


@run_job
def main(job) -> None:
    """Rule `mobilised`."""
    config = load_plausible(job.input.config)
    rig = load_rig(config.near.rig)
    own = rig.ring_contact.friction_static / rig.ring_contact.transition_velocity
    write_csv(job.output[0], mobilised_table(config, rig, [own, *CREEP_EDGES]))
