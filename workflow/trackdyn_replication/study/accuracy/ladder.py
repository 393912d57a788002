"""Effect and cost of every setting of fidelity against those of the paper."""

from trackdyn.sweeps.snakemake_job import run_job

import time
from itertools import product

import numpy as np
import pandas as pd

from trackdyn.inputs.errors import TrackdynError
from trackdyn.inputs.files import write_csv
from trackdyn.measure.catalogue import ABSOLUTE, RELATIVE, SENSED, TOLERATED
from trackdyn.measure.stopping import run_steady
from trackdyn.measure.whole_loop import whole_loop
from trackdyn.rig.rig import Rig, load_rig
from trackdyn.scene.choices import PRESETS, WITHOUT_RING
from trackdyn.scene.scene import Scene, StopRule, steady_fields
from trackdyn.simulation.settling import SettledLoops
from trackdyn.simulation.simulate import simulate
from trackdyn_replication.study.accuracy.record_statistics import BELT_TURNS, NAN, TENSION, statistics_of
from trackdyn_replication.study.variants import REFERENCE, SETTINGS

LEAD_IN = 2.0  # s: some settings have softer modes than the ring study, and their own transients
MEASURED = ["scene", "setting", "measure", "value", "wall_s_per_s", "note"]


def measure_setting(
    rig: Rig, setting: str, speeds: list[float], radii: list[float | None], rule: StopRule
) -> pd.DataFrame:
    """Return statistics of one setting for every speed and ring, the whole loop as the sensor (``MEASURED``)."""
    rows, starts = [], SettledLoops()
    for rpm, radius in product(speeds, radii):
        name = f"{rpm:g} rpm, {'no ring' if radius is None else f'ring {radius:g} m'}"
        try:
            variant = SETTINGS[setting]
            fields = PRESETS[REFERENCE] | TENSION | {"ring_radius": radius} | variant.scene
            fields |= WITHOUT_RING.get(setting.removeprefix("preset="), {}) if radius is None else {}
            fields = steady_fields(rig, rpm, rule) | {"lead_in": LEAD_IN} | fields
            scene = Scene(rig.changed(**variant.rig), rpm, **fields)
            measures, wall, note = *_run(scene, rule, starts), ""
        except TrackdynError as error:
            measures, wall, note = {}, NAN, str(error)
        rows += [[name, setting, measure, measures.get(measure, NAN), wall, note] for measure in TOLERATED + ABSOLUTE]
        print(f"{name}: {setting}", flush=True)
    return pd.DataFrame(rows, columns=MEASURED)


def _run(scene: Scene, rule: StopRule, starts: SettledLoops) -> tuple[dict[str, float], float]:
    """Return statistics of a scene, and wall seconds per simulated second."""
    if scene.chain == "belt":  # without a time loop: the cost is that of the whole record
        seconds = round(BELT_TURNS / scene.periods.loop_hz, 1)
        begin = time.perf_counter()
        recording = simulate(scene.with_(duration=seconds))
        return statistics_of(recording), (time.perf_counter() - begin) / seconds
    simulate(scene.with_(duration=0.01, lead_in=0.0), starts=starts)  # compiled before anything is timed
    recording, _ = run_steady(scene.with_(every_link=True), rule, starts)
    loop = whole_loop(recording)
    measures = {name: loop[name].value for name in SENSED}
    return statistics_of(recording) | measures, recording.wall / (len(recording.time) / recording.rate)


def compare_rungs(rungs: pd.DataFrame) -> pd.DataFrame:
    """Compare every setting (`measure_setting`) with the reference, shares in points of a turn, by scene."""
    reference = rungs.loc[rungs["setting"] == f"preset={REFERENCE}"].set_index(["scene", "measure"])["value"]
    rungs = rungs.iloc[pd.factorize(rungs["scene"])[0].argsort(kind="stable")]
    before = rungs.set_index(["scene", "measure"]).index.map(reference).to_numpy()
    change = (rungs["value"] - before).where(rungs["measure"].isin(TOLERATED))
    relative = rungs["measure"].isin(RELATIVE)
    return rungs.assign(difference_pct=change.mask(relative, 100 * (change / np.where(before == 0, np.nan, before))))


@run_job
def main(job) -> None:
    """Rule `fidelity_setting`."""
    rig, params, rule = load_rig(job.input.rig), job.params, StopRule(**job.params.stop_rule)
    write_csv(job.output[0], measure_setting(rig, job.wildcards.setting, params.speeds, params.radii, rule))
