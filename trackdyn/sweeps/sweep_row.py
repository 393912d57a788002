"""One row: a scene in, numbers or a reason out."""

from psutil import virtual_memory

from trackdyn.jit import target_hash
from trackdyn.measure.events import event_times
from trackdyn.measure.metrics import run_metrics
from trackdyn.measure.stopping import check_driven, run_steady
from trackdyn.measure.whole_loop import whole_loop
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene, StopRule
from trackdyn.scene.step import first_that_runs
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recorder import cost
from trackdyn.simulation.recording import Recording, made_with
from trackdyn.simulation.settling import SettledLoops
from trackdyn.simulation.simulate import simulate
from trackdyn.sources import module_hash


class Rows:
    """Computes rows one after another, each within ``memory`` bytes; settled loops are shared among them."""

    def __init__(self, memory: float):
        self.memory = memory
        self._starts = SettledLoops()

    def __call__(self, rig: dict, changes: dict, scene: dict, stop_rule: dict) -> dict:
        """Values of a row (`sweep.SweepRow`) with the first of its steps that runs."""
        loaded = Rig.model_validate(rig)
        changed = loaded.changed(**changes) if changes else loaded

        def run(**step) -> dict:
            return self._values(Scene(changed, **scene | step), stop_rule)

        steps = scene.get("step")
        return first_that_runs(steps, lambda step: run(step=step)) if isinstance(steps, list) else run()

    def _values(self, requested: Scene, stop_rule: dict) -> dict:
        self._check_memory(requested)
        if stop_rule:
            check_driven(requested)
            recording, converged = run_steady(Loop(requested, self._starts), StopRule(**stop_rule, longest_turns=1))
            return run_values(recording) | {"contacts_converged": converged}
        recording = simulate(requested, starts=self._starts)
        measures = whole_loop(recording) if requested.every_link else {}
        # over all links, each with its error
        return run_values(recording) | {
            f"whole_{name}{suffix}": value
            for name, estimate in measures.items()
            for suffix, value in zip(("", "_error", "_half_width"), estimate, strict=True)
        }

    def _check_memory(self, scene: Scene) -> None:
        """That a row does not fit may be otherwise with other neighbours or on another machine: no refusal for good."""
        needed = cost(scene).memory
        if needed > (allowed := min(self.memory, virtual_memory().available)):
            raise MemoryError(
                f"a recording of {scene.duration:g} s needs about {needed / 1e6:.0f} MB of memory and the row may take "
                f"{allowed / 1e6:.0f} MB; use fewer jobs, more memory or a shorter duration"
            )


def run_values(recording: Recording) -> dict:
    """Metrics, how the loop stands, and what computed it."""
    values = {name: value for name, value in run_metrics("", recording).items() if name != "run"}
    sources, versions = made_with()
    made = {"python": recording.meta["python"]} | versions
    if recording.scene.pitches:  # where contacts are recorded pitch by pitch, more is known of them
        values |= {f"event {name}": seconds for name, seconds in event_times(recording).items()}
    return values | recording.meta["layout"] | {
        "kernel_sources": sources, "row_sources": module_hash(__name__), "processor": target_hash(),
        "versions": ", ".join(f"{name} {version}" for name, version in made.items()),
    }  # fmt: skip
