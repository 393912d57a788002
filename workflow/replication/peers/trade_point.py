"""The point of Exudyn in the picture of accuracy against cost: error of the RMS of all links, and CPU seconds."""

from trackdyn.sweeps.snakemake_job import run_job

from collections.abc import Sequence
from time import process_time

import numpy as np
import pandas as pd

from replication.peers.comparison import run_peer
from replication.peers.exudyn_loop import require_exudyn
from replication.study.accuracy.statistics import study_scene
from replication.study.settings import PEER_LAWS, PICTURED
from trackdyn.inputs.errors import InputError
from trackdyn.inputs.files import write_csv
from trackdyn.measure.sensor import whole_samples
from trackdyn.measure.uncertainty import weight_of_finer
from trackdyn.rig.rig import Rig, load_rig

ORDER = 2  # generalized-alpha method of Exudyn (Chung and Hulbert, J. Appl. Mech. 60, 1993)


def links_rms(centre: np.ndarray, rate: float) -> float:
    """RMS acceleration, m/s2, of links whose mass centres (s, p, 2), m, are recorded at ``rate`` (Hz)."""
    acceleration = np.diff(centre, 2, axis=0) * rate**2
    return float(np.sqrt((acceleration**2).sum(axis=2).mean()))


def peer_point(rig: Rig, steps_s: Sequence[float]) -> pd.DataFrame:
    """One row ``step_s, error, cpu_s`` for the larger of two steps (s); no row without Exudyn.

    The error is relative to the limit of Exudyn's own RMS at a step of zero (Richardson extrapolation). To settle the
    loop and to assemble the system count among the CPU seconds.
    """
    try:
        require_exudyn()
    except InputError as error:
        print(f"not run: {error}")
        return pd.DataFrame(columns=["step_s", "error", "cpu_s"])
    rate = rig.rate
    scene = study_scene(rig, *PICTURED, 1, tension="locked", contact_log=False, **PEER_LAWS)
    first = round((scene.ramp + scene.lead_in) * rate) + 1
    scene = scene.with_(lead_in=0.0, duration=scene.lead_in + scene.duration)
    run_peer(scene.with_(duration=whole_samples(rate, 0.01)), max(steps_s))  # compiles before anything is timed
    rms, cpu = {}, {}
    for step in steps_s:
        begin = process_time()
        run, _ = run_peer(scene, step)
        cpu[step] = process_time() - begin
        rms[step] = links_rms(run.centre[first:, ::2], rate)
    fine, coarse = sorted(rms)
    limit = rms[fine] + weight_of_finer(fine, coarse, ORDER) * (rms[fine] - rms[coarse])
    return pd.DataFrame([{"step_s": coarse, "error": abs(rms[coarse] / limit - 1), "cpu_s": cpu[coarse]}])


@run_job
def main(job) -> None:
    """Rule `peer_trade`."""
    write_csv(job.output[0], peer_point(load_rig(job.input.rig), job.params.steps_s))
