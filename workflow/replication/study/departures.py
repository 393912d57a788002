"""What a departure from the paper changes: the statistics of a few scenes with one thing different, none refitted."""

from trackdyn.sweeps.job import run_job

import pandas as pd

from replication.study.accuracy.statistics import statistics_of, study_scene
from replication.study.settings import scene_name
from replication.study.variants import DEPARTURES, REFERENCE, Variant, change
from trackdyn.errors import TrackdynError
from trackdyn.files import write_csv
from trackdyn.measure.contacts import meshing_summary
from trackdyn.parameters.rig import Rig, load_rig
from trackdyn.scene.fidelity import PRESETS
from trackdyn.scene.scene import Scene
from trackdyn.simulation.simulate import simulate

SPEEDS_RPM, RADII_M, LOOP_TURNS = (115.0, 210.0), (0.308, None), 3
MEASURES = ("rms_g", "high_frequency_g", "left_share_pct", "right_share_pct", "ring_share_pct", "ring_rms_n")
COLUMNS = ["departure", "scene", "measure", "as_shipped", "changed", "difference", "failed"]


def variant_scenes(rig: Rig, variant: Variant = Variant()) -> dict[str, Scene]:
    """Scenes with one thing different, by their names."""
    changed = rig.changed(**variant.rig)
    return {
        scene_name(rpm, radius): study_scene(changed, rpm, radius, LOOP_TURNS, **PRESETS[REFERENCE]).with_(
            **variant.scene
        )
        for radius in RADII_M
        for rpm in SPEEDS_RPM
    }


def variant_measures(scene: Scene) -> dict[str, float | str]:
    """RMS and content above 20 Hz over whole revolutions (g), shares (%), RMS force of the ring (N)."""
    try:
        recording = simulate(scene)
    except TrackdynError as error:
        return {"failed": str(error)}
    signal, summary = statistics_of(recording), meshing_summary(recording)
    return {name: float(summary.get(name, signal.get(name.removesuffix("_g")))) for name in MEASURES}


def compare_departures(rig: Rig) -> pd.DataFrame:
    """Every departure beside the rig as it is shipped.

    Returns
    -------
    DataFrame
        ``departure, scene, measure, as_shipped, changed, difference, failed``; the difference of shares in points
        of a sprocket turn, of all else in percent; ``failed`` says why a run has no values.
    """
    shipped = {name: variant_measures(scene) for name, scene in variant_scenes(rig).items()}
    rows = []
    for name, variant in DEPARTURES.items():
        for key, scene in variant_scenes(rig, variant).items():
            values = variant_measures(scene)
            for measure in MEASURES:
                base, value = (of.get(measure, float("nan")) for of in (shipped[key], values))
                difference = change(measure, base, value) * (1 if measure.endswith("_pct") else 100)
                rows.append([name, key, measure, base, value, difference, values.get("failed", "")])
        print(name, flush=True)
    return pd.DataFrame(rows, columns=COLUMNS)


def main(job) -> None:
    """Rule `deviations`."""
    write_csv(job.output[0], compare_departures(load_rig(job.input.rig)))


if __name__ == "__main__":
    run_job(main)
