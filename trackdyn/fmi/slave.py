"""The script inside a co-simulation unit: what FMI calls, passed on to `trackdyn.fmi.unit.Unit`.

It runs in the Python of whoever imports the unit, in which trackdyn must be installed.
"""

import json
from pathlib import Path

from pythonfmu3 import Float64, Fmi3Causality, Fmi3Initial, Fmi3Slave, Fmi3Status, Fmi3StepResult, Fmi3Variability
from pythonfmu3.unit import Unit as FmiUnit

from trackdyn.errors import TrackdynError
from trackdyn.fmi.unit import Unit
from trackdyn.jit import source_hash
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene

UNITS = {
    "s": {"s": 1}, "m": {"m": 1}, "N": {"kg": 1, "m": 1, "s": -2}, "N.m": {"kg": 1, "m": 2, "s": -2},
    "rad/s": {"rad": 1, "s": -1}, "rev/min": {"rad": 1, "s": -1, "factor": 0.10471975511965977},
    "g": {"m": 1, "s": -2, "factor": 9.81},
}  # fmt: skip


class Track(Fmi3Slave):
    """A double-pin track drive."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        described = json.loads(Path(self.resources, "scene.json").read_text(encoding="utf-8"))
        fields, self.sources = described["scene"], described["sources"]
        self.modelName, self.description = described["name"], described["text"]
        self.unit = Unit(Scene(**fields | {"rig": Rig.model_validate(fields["rig"])}))
        self.register_units([FmiUnit(name, **parts) for name, parts in UNITS.items()])
        self.time = 0.0
        whole = {"variability": Fmi3Variability.continuous}
        self.register_variable(Float64("time", unit="s", causality=Fmi3Causality.independent, **whole))
        self.register_variable(Float64(
            "speed_ramp", unit="s", description="time in which a new speed is reached; 0: within the exchange",
            causality=Fmi3Causality.parameter, variability=Fmi3Variability.tunable, initial=Fmi3Initial.exact,
            getter=lambda: self.unit.speed_ramp, setter=lambda value: setattr(self.unit, "speed_ramp", value),
        ))  # fmt: skip
        for signal in self.unit.inputs:
            self._register(signal, self.unit.wanted, Fmi3Causality.input)
        self.values = dict.fromkeys((signal.name for signal in self.unit.outputs), 0.0)
        for signal in self.unit.outputs:
            self._register(signal, self.values, Fmi3Causality.output)

    def _register(self, signal, values, causality) -> None:
        taken = causality == Fmi3Causality.input
        self.register_variable(
            Float64(
                signal.name,
                start=signal.start if taken else None,
                unit=signal.unit,
                description=signal.text,
                causality=causality,
                variability=Fmi3Variability.continuous,
                initial=None if taken else Fmi3Initial.calculated,
                getter=lambda: values[signal.name],
                setter=lambda value: values.__setitem__(signal.name, value),
            )
        )

    def exit_initialization_mode(self):
        """Settle the loop with the inputs as they are."""
        if self.sources != source_hash():
            self.log("this trackdyn is not the version that made the unit", Fmi3Status.warning)
        self.unit.start()
        self.values.update(self.unit.values)

    def do_step(self, current_time, step_size):
        """One exchange; what is refused ends the simulation with one sentence in the log."""
        try:
            self.unit.step(current_time, step_size)
        except TrackdynError as error:
            self.log(str(error), Fmi3Status.error)
            return Fmi3StepResult(status=Fmi3Status.error)
        self.time = current_time + step_size
        self.values.update(self.unit.values)
        return Fmi3StepResult(status=Fmi3Status.ok)

    def _get_fmu_state(self):
        return {"unit": self.unit.keep(), "time": self.time}

    def _set_fmu_state(self, state):
        wanted = self.unit.wanted
        self.unit.back(state["unit"])
        wanted.update(self.unit.wanted)  # the one that the variables write to
        self.unit.wanted, self.time = wanted, state["time"]
        self.values.update(self.unit.values)
