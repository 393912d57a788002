"""Computation of a row of a sweep: run its scene, return its numbers."""

from trackdyn.inputs.validation import validated
from trackdyn.jit import target_hash
from trackdyn.measure.events import mean_events
from trackdyn.measure.metrics import run_metrics
from trackdyn.measure.stopping import check_driven, run_steady
from trackdyn.measure.whole_loop import whole_loop
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene, StopRule
from trackdyn.scene.step import first_that_runs
from trackdyn.simulation.recording import Recording, sources_and_versions
from trackdyn.simulation.settling import SettledLoops
from trackdyn.simulation.simulate import simulate
from trackdyn.sources import module_hash

STARTS = SettledLoops()  # of this process: rows with the same settling share them


def run_row(rig: dict, changes: dict, scene: dict, stop_rule: dict) -> dict:
    """Return the values of a row (`sweep.SweepRow`) with the first of its steps that runs."""
    loaded = Rig.model_validate(rig)
    changed = loaded.changed(**changes) if changes else loaded
    rule = validated(StopRule, stop_rule | {"longest_turns": 1}, "stop_rule") if stop_rule else None

    def run(**step) -> dict:
        requested = Scene(changed, **scene | step)
        if rule:
            check_driven(requested)
            recording, converged = run_steady(requested, rule, STARTS)
            return run_values(recording) | {"contacts_converged": converged}
        recording = simulate(requested, starts=STARTS)
        measures = whole_loop(recording) if requested.every_link else {}
        # of all links, with errors
        return run_values(recording) | {
            f"whole_{name}{suffix}": value
            for name, estimate in measures.items()
            for suffix, value in zip(("", "_error", "_half_width"), estimate, strict=True)
        }

    steps = scene.get("step")
    return first_that_runs(steps, lambda step: run(step=step)) if isinstance(steps, list) else run()


def run_values(recording: Recording) -> dict:
    """Return the metrics of a recording, the layout of its loop, and the software that computed it."""
    values = {name: value for name, value in run_metrics("", recording).items() if name != "run"}
    sources, versions = sources_and_versions()
    software = {"python": recording.meta["python"]} | versions
    if recording.scene.pitches:
        values |= mean_events(recording).set_index("event")["median_s"].add_prefix("event ").to_dict()
    return values | recording.layout.known() | {
        "kernel_sources": sources, "row_sources": module_hash(__name__), "processor": target_hash(),
        "versions": ", ".join(f"{name} {version}" for name, version in software.items()),
    }  # fmt: skip
