"""The script inside a co-simulation unit: what FMI calls, passed on to `laboratory.fmi.unit.Unit`.

It runs in the Python of whoever imports the unit, in which trackdyn must be installed.
"""

import ctypes
import functools
import json
from copy import deepcopy
from pathlib import Path
from weakref import WeakSet

from pythonfmu3 import Float64, Fmi3Causality, Fmi3Initial, Fmi3Slave, Fmi3Status, Fmi3StepResult, Fmi3Variability
from pythonfmu3.unit import Unit as FmiUnit

from laboratory.fmi.unit import Unit
from trackdyn.errors import InputError, TrackdynError
from trackdyn.rig.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.sources import source_hash

UNITS = {
    "s": {"s": 1}, "m": {"m": 1}, "N": {"kg": 1, "m": 1, "s": -2}, "N.m": {"kg": 1, "m": 2, "s": -2},
    "rad/s": {"rad": 1, "s": -1}, "rev/min": {"rad": 1, "s": -1, "factor": 0.10471975511965977},
    "g": {"m": 1, "s": -2, "factor": 9.81},
}  # fmt: skip
NOT_SERIALIZED = "a state of this unit cannot be written to a file (canSerializeFMUState)"
_ALIVE = WeakSet()


def _hold(instance) -> None:
    """Keep an instance whole beyond an exception.

    With every exception PythonFMU3 gives back its references to instance, class and log, and goes on using them: the
    next call would find freed memory.
    """
    for logger in (type(instance), instance, instance.log_queue):
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(logger))


def _sentence(error: Exception) -> str:
    text = str(error) if isinstance(error, TrackdynError) else f"{type(error).__name__}: {error}"
    return " ".join(text.split())


def refusing(*modes: str):
    """Decorator of a method that is called in some modes only, if any are given; the log says why it refuses."""

    def decorate(method):
        @functools.wraps(method)
        def call(self, *arguments):
            try:
                if modes and self.mode not in modes:
                    must = f"it must be {' or '.join(modes)}"
                    raise InputError(f"{method.__name__} cannot be called while the unit is {self.mode}; {must}")
                return method(self, *arguments)
            except Exception as error:
                self.log(_sentence(error), Fmi3Status.error)
                _hold(self)
                raise InputError(_sentence(error)) from None

        return call

    return decorate


class Track(Fmi3Slave):
    """A double-pin track drive.

    ``mode`` is instantiated, initialising, stepping, failed or terminated.
    """

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.mode = "instantiated"
        _ALIVE.add(self)
        described = json.loads(Path(self.resources, "scene.json").read_text(encoding="utf-8"))
        fields, self.sources = described["scene"], described["sources"]
        self.modelName, self.description = described["name"], described["text"]
        self.unit = Unit(Scene(**fields | {"rig": Rig.model_validate(fields["rig"])}))
        self.register_units([FmiUnit(name, **parts) for name, parts in UNITS.items()])
        self.time = 0.0
        continuous = {"variability": Fmi3Variability.continuous}
        self.register_variable(Float64("time", unit="s", causality=Fmi3Causality.independent, **continuous))
        self.register_variable(Float64(
            "speed_ramp", unit="s", description="time in which a new speed is reached; 0: within the exchange",
            causality=Fmi3Causality.parameter, variability=Fmi3Variability.tunable, initial=Fmi3Initial.exact,
            getter=lambda: self.unit.speed_ramp, setter=lambda value: setattr(self.unit, "speed_ramp", value),
        ))  # fmt: skip
        for signal in self.unit.inputs:
            self._register(signal, "wanted", causality=Fmi3Causality.input, start=signal.start)
        for signal in self.unit.outputs:
            self._register(signal, "values", causality=Fmi3Causality.output, initial=Fmi3Initial.calculated)

    def _register(self, signal, numbers, **fields) -> None:
        """Register a signal, whose present value the unit has among its ``numbers``."""
        self.register_variable(Float64(
            signal.name, unit=signal.unit, description=signal.text, variability=Fmi3Variability.continuous,
            getter=lambda: getattr(self.unit, numbers)[signal.name],
            setter=lambda value: getattr(self.unit, numbers).__setitem__(signal.name, value), **fields,
        ))  # fmt: skip

    @refusing("instantiated")
    def enter_initialization_mode(self):
        self.mode = "initialising"

    @refusing("initialising")
    def exit_initialization_mode(self):
        """Settle the loop with the inputs as they are."""
        if self.sources != source_hash():
            self.log("this trackdyn is not the version that made the unit", Fmi3Status.warning)
        self.mode = "failed"
        self.unit.start()
        self.mode = "stepping"

    def do_step(self, current_time, step_size):
        """One exchange; what is refused ends the simulation with one sentence in the log."""
        try:
            if self.mode != "stepping":
                raise InputError(f"the unit cannot step while it is {self.mode}; initialise it first")
            self.unit.step(current_time, step_size)
        except Exception as error:
            self.log(_sentence(error), Fmi3Status.error)
            return Fmi3StepResult(status=Fmi3Status.error)
        self.time = current_time + step_size
        return Fmi3StepResult(status=Fmi3Status.ok)

    @refusing("instantiated", "initialising", "stepping", "failed")
    def terminate(self):
        self.mode = "terminated"

    @refusing("instantiated", "initialising", "stepping")
    def set_float64(self, vrs, values):
        """Take inputs and parameters; `InputError` for another variable."""
        for vr in vrs:
            variable = self.vars.get(vr)
            if variable is None or variable.causality not in (Fmi3Causality.input, Fmi3Causality.parameter):
                name = f"value reference {vr}" if variable is None else variable.name
                raise InputError(f"{name} cannot be written; only inputs and parameters can")
        super().set_float64(vrs, values)

    @refusing("stepping")
    def _get_fmu_state(self):
        return deepcopy((self.unit, self.time))

    @refusing("stepping", "failed")
    def _set_fmu_state(self, state):
        self.unit, self.time = deepcopy(state)
        self.mode = "stepping"

    @staticmethod
    def _fmu_state_to_bytes(state):
        for instance in _ALIVE:  # the call does not say whose state it is
            instance.log(NOT_SERIALIZED, Fmi3Status.error)
            _hold(instance)
        raise InputError(NOT_SERIALIZED)

    _fmu_state_from_bytes = _fmu_state_to_bytes


# every variable is a Float64: whoever asks for another kind is refused in a sentence
for _kind in ("float64", "int32", "int64", "uint64", "boolean", "string"):
    for _name in (f"get_{_kind}", f"set_{_kind}"):
        if _name not in vars(Track):
            setattr(Track, _name, refusing()(getattr(Fmi3Slave, _name)))
