"""trackdyn: dynamics of a double-pin caterpillar track, a replication of Wang et al. (2023).

Examples
--------
>>> from trackdyn import Scene, load_rig, sense, simulate
>>> scene = Scene(load_rig("config/rig.yaml"), motor_rpm=115, duration=20)
>>> recording = simulate(scene)
>>> signal = sense(recording)
"""

from trackdyn.errors import DivergenceError, InputError, TrackdynError
from trackdyn.measure.sensor import sense
from trackdyn.parameters.rig import Rig, load_rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recording import Recording, load_recording
from trackdyn.simulation.simulate import simulate
from trackdyn.version import __version__


def __getattr__(name):
    """`trackdyn.show` and `trackdyn.sweep`, whose libraries are loaded with the first use."""
    if name == "show":
        from trackdyn.report.page.show import show

        return show
    if name != "sweep":
        raise AttributeError(f"module 'trackdyn' has no attribute {name!r}")
    from trackdyn.sweeps.sweep import sweep

    return sweep


__all__ = [
    "DivergenceError",
    "InputError",
    "Loop",
    "Recording",
    "Rig",
    "Scene",
    "TrackdynError",
    "__version__",
    "load_recording",
    "load_rig",
    "sense",
    "show",
    "simulate",
    "sweep",
]
