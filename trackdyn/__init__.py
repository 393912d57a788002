"""trackdyn: dynamics of a double-pin caterpillar track, a replication of Wang et al. (2023).

Names are imported at first use (SPEC 1 of Scientific Python).

Examples
--------
>>> from trackdyn import Scene, load_rig, measures, sense, simulate
>>> scene = Scene(load_rig("paper"), motor_rpm=115, duration=20)
>>> recording = simulate(scene)
>>> table = measures(recording)
>>> axes = sense(recording).plot()
"""

from importlib import import_module
from typing import TYPE_CHECKING

_MODULES = {
    "DivergenceError": "trackdyn.inputs.errors",
    "InputError": "trackdyn.inputs.errors",
    "Loop": "trackdyn.simulation.loop",
    "Recording": "trackdyn.simulation.recording",
    "Rig": "trackdyn.rig.rig",
    "Scene": "trackdyn.scene.scene",
    "TrackdynError": "trackdyn.inputs.errors",
    "RingRule": "trackdyn.measure.ring_rule",
    "SensorMapping": "trackdyn.fieldtest.sensor_mapping",
    "__version__": "trackdyn.version",
    "check": "trackdyn.simulation.rig_check",
    "compare": "trackdyn.fieldtest.compare",
    "export": "trackdyn.measure.export",
    "load_recording": "trackdyn.simulation.recording",
    "load_rig": "trackdyn.rig.rig",
    "measures": "trackdyn.measure.export",
    "plan": "trackdyn.measure.planner",
    "read_sensor": "trackdyn.fieldtest.sensor_csv",
    "ring_study": "trackdyn.sweeps.ring",
    "sense": "trackdyn.measure.sensor",
    "show": "trackdyn.plots.show",
    "simulate": "trackdyn.simulation.simulate",
    "sweep": "trackdyn.sweeps.sweep",
}
__all__ = list(_MODULES)

if TYPE_CHECKING:
    from trackdyn.fieldtest.compare import compare as compare
    from trackdyn.fieldtest.sensor_csv import read_sensor as read_sensor
    from trackdyn.fieldtest.sensor_mapping import SensorMapping as SensorMapping
    from trackdyn.inputs.errors import DivergenceError as DivergenceError
    from trackdyn.inputs.errors import InputError as InputError
    from trackdyn.inputs.errors import TrackdynError as TrackdynError
    from trackdyn.measure.export import export as export
    from trackdyn.measure.export import measures as measures
    from trackdyn.measure.planner import plan as plan
    from trackdyn.measure.ring_rule import RingRule as RingRule
    from trackdyn.measure.sensor import sense as sense
    from trackdyn.plots.show import show as show
    from trackdyn.rig.rig import Rig as Rig
    from trackdyn.rig.rig import load_rig as load_rig
    from trackdyn.scene.scene import Scene as Scene
    from trackdyn.simulation.loop import Loop as Loop
    from trackdyn.simulation.recording import Recording as Recording
    from trackdyn.simulation.recording import load_recording as load_recording
    from trackdyn.simulation.rig_check import check as check
    from trackdyn.simulation.simulate import simulate as simulate
    from trackdyn.sweeps.ring import ring_study as ring_study
    from trackdyn.sweeps.sweep import sweep as sweep
    from trackdyn.version import __version__ as __version__
else:  # a type checker would accept every name

    def __getattr__(name: str):
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        try:
            globals()[name] = value = getattr(import_module(_MODULES[name]), name)
        except ModuleNotFoundError as error:
            from trackdyn.inputs.errors import missing

            raise missing(error) from None
        return value


def __dir__() -> list[str]:
    return sorted(__all__)
