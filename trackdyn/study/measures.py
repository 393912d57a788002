"""What the studies of cost and accuracy compare: statistics of a run, the state after a window, the cost."""

import time

import numpy as np

from trackdyn.chain.kinematics import orient, place
from trackdyn.errors import DivergenceError
from trackdyn.measure.meshing import meshing_summary
from trackdyn.measure.metrics import energy_residual, loop_frequency, whole_revolutions
from trackdyn.measure.sensor import sense
from trackdyn.measure.signals import main_line_binfree, rms, standard_deviation
from trackdyn.recording import Recording
from trackdyn.scene import Scene
from trackdyn.settling import empty_record, settle
from trackdyn.simulate import make_stepper

NAN = float("nan")
SHARES = ("left_share", "right_share", "ring_share")
# compared as a share of the reference, in points of a sprocket turn, or as they are
RELATIVE = ("rms", "sd", "line", "left_peak")
ABSOLUTE = ("loop_gap", "energy_residual")
MEASURES = RELATIVE + SHARES + ABSOLUTE
BURSTS, BURST_SECONDS = 5, 0.1


def statistics_of(recording: Recording) -> dict[str, float]:
    """RMS, SD and main line (g), contact shares (%), peak of the left arc (N), loop gap (m), energy residual.

    RMS and SD are taken over whole revolutions of the loop, the peak is the mean over the passages of the largest force.
    """
    loop_hz = loop_frequency(recording)
    ay = sense(recording).ay
    whole = whole_revolutions(len(ay), recording.rate, loop_hz)
    found = {"rms": rms(ay[:whole]), "sd": standard_deviation(ay[:whole])}
    found["line"] = main_line_binfree(ay, recording.rate, expected_hz=loop_hz)[1]
    if len(recording.spells):
        meshing = meshing_summary(recording)
        found |= {name: meshing[f"{name}_pct"] for name in SHARES} | {"left_peak": meshing["left_peak_n"]}
    else:
        found |= dict.fromkeys((*SHARES, "left_peak"), NAN)
    return found | {
        "loop_gap": float(recording.gap.max()),
        "energy_residual": abs(energy_residual(recording)),
    }


def error_of(measure: str, value: float, reference: float) -> float:
    """Error of a statistic: relative, in turns of the sprocket for shares, in its own unit for gap and residual."""
    if measure in ABSOLUTE:
        return abs(value)
    if measure in SHARES:
        return abs(value - reference) / 100
    return abs(value - reference) / abs(reference) if reference else (0.0 if value == 0 else NAN)


def study_scene(rig, rpm: float, ring: float | None, turns: int, **fields) -> Scene:
    """A record of whole revolutions of the loop after four seconds of running."""
    rate = rig.sensor.rate
    turn = 60 * rig.sprocket.transmission_ratio / rpm * rig.chain.pitches / rig.sprocket.teeth
    duration = np.ceil((turns * turn + 0.01) * rate) / rate
    return Scene(rig, motor_rpm=rpm, ring_radius=ring, duration=float(duration), lead_in=3.0, **fields)


def cost(scene: Scene) -> tuple[float, float]:
    """Wall and CPU seconds per simulated second, medians of ``BURSTS`` bursts on one thread, compilation apart."""
    if scene.chain == "belt":
        raise ValueError("a belt has no time loop to measure")
    model, state, work, _ = settle(scene)
    samples = round(BURST_SECONDS * scene.rig.sensor.rate)
    go, _ = make_stepper(scene, model, state, work, samples)
    loop = len(model.shoes.link_body)
    record = empty_record(samples, len(state.angle), len(model.wheels.x), (1,), loop=loop, spells=40000)
    wall, cpu = [], []
    for burst in range(BURSTS + 2):
        record.spells.count[0] = 0
        begin = time.perf_counter(), time.process_time()
        bad = go(record, 0, samples)
        end = time.perf_counter(), time.process_time()
        if bad >= 0:
            raise DivergenceError(
                "the run left the physical range while its cost was measured; a smaller step would do"
            )
        if burst > 1:  # the first two compile and leave the ramp
            wall.append((end[0] - begin[0]) / BURST_SECONDS)
            cpu.append((end[1] - begin[1]) / BURST_SECONDS)
    return float(np.median(wall)), float(np.median(cpu))


def mass_centres(model, state, work) -> np.ndarray:
    """Mass centres of the bodies at a state, (n, 2), m."""
    orient(state.angle, work.cos, work.sin)
    place(model.chain, state, work)
    chain = model.chain
    x = work.pin_x[:-1] + chain.com_x * work.cos - chain.com_y * work.sin
    y = work.pin_y[:-1] + chain.com_x * work.sin + chain.com_y * work.cos
    return np.column_stack([x, y])
