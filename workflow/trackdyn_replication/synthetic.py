"""SYNTHETIC stand-in for the measured acceleration of a track link, which the paper did not publish.

Nothing here is measured, and agreement of a simulation with it validates nothing; ``data/synthetic/datapackage.json``
lists the printed numbers and those fitted to them; all others are assumed. No dynamics of the simulator is used: a
record is the motion of a link on an ideal belt around the wheels, with the causes that Sect. 5 of the paper names for
the sharper course of its experiment: the speed fluctuates slowly, contacts are short impacts whenever a pitch runs on
or off a wheel, and the sensor is glued on and rings.
"""

import hashlib
import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter

from trackdyn.fieldtest.sensor_csv import write_sensor_csv
from trackdyn.inputs.files import write_text
from trackdyn.measure.spectra import main_line, rms, standard_deviation
from trackdyn.rig.layout import BeltPath, belt_path

FOLDER = Path("data/synthetic")
GENERATOR_VERSION = "1.0.0"

# printed: the sensor and the record of Sect. 5, and the number of links of Sect. 2
RATE_HZ = 1000
RECORD_S = 90.0
RANGE_G = 20.0
PITCHES = 35
GRAVITY = 9.81  # m/s2

# assumed: centre x, y and radius under the pins (wheel or ring and half a link's thickness), m, of
# sprocket, idler and road wheel: of an earlier fit of the rig, mirrored. A copy: the data must not follow a refit.
CIRCLES = ((0.0, 0.0, 0.308 + 0.02), (1.05, -0.05, 0.28 + 0.02), (1.65, -0.50, 0.28 + 0.02))
LINK_LENGTH = 0.100  # pin to pin, m

# assumed: speed fluctuation. Whole cycles in a record do not change the mean speed of the record; weights
# of 1/cycles make the drift slow. A converter drive holds its speed to about half a percent.
CYCLES = np.arange(1, 9)
LEAST_FLUCTUATION = 0.005  # RMS, relative to the mean

# assumed: impacts on the link under the sensor, before the glue
IMPACT_G = 4.0  # median peak of the sensor's own link at 1 m/s; proportional to the speed
IMPACT_SPREAD = 0.4  # standard deviation of the logarithm of the peak
IMPACT_S = (0.001, 0.003)  # shortest and longest half sine, s
LEAVING = 0.4  # share of an impact at running off against running on
FAR = 0.35  # share that reaches the neighbouring link
REACH = 1.0  # length of chain over which that share falls to 1/e, m
AXIS_SHARE = (0.5, 1.0, 0.3)  # shares of an impact in x, y, z

# assumed: sensor
GLUE_HZ = 220.0
GLUE_DAMPING = 0.08
CROSS_AXIS = 0.02  # share of y that the lateral axis shows
NOISE_G = 0.02  # RMS of each axis
BITS = 16
TOP_G = RANGE_G * (1.0 - 2.0 ** (1 - BITS))  # highest value that the converter gives
OVERSAMPLING = 8  # impacts of 1 ms and the ringing need more than the sampling rate


class SyntheticSpeed(NamedTuple):
    """One motor speed: the printed numbers, and those fitted to them, to 1e-5.

    Lines of 90,000 points at 1000 Hz are 1/90 Hz apart, and a belt that turns between two shows up to 36 % less. So the
    mean loop frequency follows from the printed amplitude, between the line nearest to the printed frequency and half a
    line from it, on its side; on the line itself where the amplitude is higher than there. Where it is lower than half
    way between two lines, the loop turns at the printed frequency and the speed fluctuates to meet the amplitude.
    """

    printed_hz: float  # experimental main frequency, Hz (printed, Sect. 5 on Fig. 18)
    printed_g: float  # its amplitude, g (printed, Sect. 5 on Fig. 18)
    loop_hz: float  # mean loop frequency, Hz (fitted)
    # RMS of the slow fluctuation of the speed, relative to its mean (assumed, or fitted)
    fluctuation: float = LEAST_FLUCTUATION


SPEEDS = {  # by motor speed, rev/min (printed)
    115: SyntheticSpeed(0.131, 1.083, loop_hz=0.13057),
    150: SyntheticSpeed(0.176, 1.1200, loop_hz=0.17625),
    180: SyntheticSpeed(0.2090, 1.1720, loop_hz=0.21111),
    210: SyntheticSpeed(0.253, 0.7698, loop_hz=0.253, fluctuation=0.04965),
}


def generate(rpm: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Generate a record at a motor speed, its seed: time (s), specific force (g) along the link, outward, lateral."""
    speed, count = SPEEDS[rpm], round(RECORD_S * RATE_HZ)
    t = np.arange(count) / RATE_HZ
    rng = np.random.Generator(np.random.PCG64(rpm))
    path = belt_path(CIRCLES)
    start, phase = rng.uniform(0.0, path.length), rng.uniform(0.0, 2.0 * np.pi, CYCLES.size)
    s, v, vdot = _travel(t, speed, path.length, start, phase)

    fine = np.arange(count * OVERSAMPLING) / (RATE_HZ * OVERSAMPLING)
    shocks = _impacts(fine, _travel(fine, speed, path.length, start, phase)[0], path, speed, rng)
    # a mass on a spring and damper, the glue, by the bilinear transformation
    w, w0 = 2.0 * RATE_HZ * OVERSAMPLING, 2.0 * np.pi * GLUE_HZ
    damping = 2.0 * GLUE_DAMPING * w0 * w
    below = [w**2 + damping + w0**2, 2.0 * (w0**2 - w**2), w**2 - damping + w0**2]
    shocks = lfilter([w0**2 + damping, 2.0 * w0**2, w0**2 - damping], below, shocks, axis=1)
    signal = shocks.reshape(3, count, OVERSAMPLING).mean(axis=2)
    signal[:2] += _belt_acceleration(path, s, v, vdot)
    signal[2] += CROSS_AXIS * signal[1]
    signal += NOISE_G * rng.standard_normal(signal.shape)
    half = 2 ** (BITS - 1)  # steps of the converter, which is cut at its range
    return (t, *np.clip(np.rint(signal * (half / RANGE_G)), -half, half - 1) * (RANGE_G / half))


def achieved(rpm: int, ay: np.ndarray) -> dict[str, float]:
    """Measure a record's y acceleration (g): its dominant peak by a rectangular window, RMS, SD, largest value."""
    hz, g = main_line(ay, RATE_HZ, SPEEDS[rpm].printed_hz)
    return {
        "main_hz": round(hz, 5), "amplitude_g": round(g, 4),
        "amplitude_difference_percent": round(100 * (g / SPEEDS[rpm].printed_g - 1), 2) + 0.0,  # no -0.0
        "rms_g": round(rms(ay), 4), "sd_g": round(standard_deviation(ay), 4),
        "peak_g": round(float(np.max(np.abs(ay))), 3), "clipped_samples": int(np.sum(np.abs(ay) >= TOP_G)),
    }  # fmt: skip


def write_record(folder, rpm: int) -> np.ndarray:
    """Write ``{rpm}rpm.csv`` into an existing folder and return its y acceleration, g."""
    record, speed = generate(rpm), SPEEDS[rpm]
    comments = (
        "SYNTHETIC: not measured. Stand-in for the unpublished record of the paper's experiment;",
        "agreement of a simulation with it is no validation.",
        f"motor speed {rpm} rev/min; {RATE_HZ} Hz; range +-{RANGE_G:g} g in {BITS} bit",
        "t_s: time, s; ax_g along the link, ay_g along its outward normal, az_g lateral: specific force, g",
        f"made by replication.synthetic {GENERATOR_VERSION}, seed {rpm} (PCG64)",
        f"mean loop frequency {speed.loop_hz:.5f} Hz, fluctuation of the speed {speed.fluctuation:.5f} (RMS)",
    )
    write_sensor_csv(Path(folder) / f"{rpm}rpm.csv", *record, comments=comments)
    return record[2]


def write_dataset(folder) -> None:
    """Write the records of all speeds, and their description into ``datapackage.json``."""
    description = Path(folder) / "datapackage.json"
    package = json.loads(description.read_text(encoding="utf-8"))
    for resource, (rpm, speed) in zip(package["resources"], SPEEDS.items(), strict=True):
        ay, data = write_record(folder, rpm), (Path(folder) / resource["path"]).read_bytes()
        resource |= {"bytes": len(data), "hash": f"sha256:{hashlib.sha256(data).hexdigest()}", "seed": rpm}
        resource["fitted"] = {"loop_hz": speed.loop_hz, "fluctuation": speed.fluctuation}
        resource["printed"] = {"main_hz": speed.printed_hz, "amplitude_g": speed.printed_g}
        resource["achieved"] = achieved(rpm, ay)
    write_text(description, json.dumps(package, indent=2, ensure_ascii=False) + "\n")


def _travel(t, speed, length, start, phase):
    """Return arc length (m), velocity (m/s) and acceleration (m/s2) of the link along the belt at times t."""
    weight = speed.fluctuation * np.sqrt(2.0 / np.sum(1.0 / CYCLES**2)) / CYCLES
    omega = 2.0 * np.pi * CYCLES / RECORD_S
    mean = speed.loop_hz * length
    s, v, vdot = start + mean * t, np.full_like(t, mean), np.zeros_like(t)
    for w, o, p in zip(weight, omega, phase, strict=True):
        s += mean * w / o * (np.sin(o * t + p) - np.sin(p))
        v += mean * w * np.cos(o * t + p)
        vdot -= mean * w * o * np.sin(o * t + p)
    return s, v, vdot


def _belt_acceleration(path: BeltPath, s, v, vdot):
    """Return the specific force x, y (2, n), g, in the middle of a link, a chord with its pins on the belt (Eq. 40)."""

    def pin(s):
        position, heading, curvature = path.along(s)
        tangent = np.array([np.cos(heading), np.sin(heading)])
        # the belt runs clockwise: the centre of an arc lies to the right of the tangent
        return position.T, vdot * tangent + v**2 * curvature * np.array([tangent[1], -tangent[0]])

    (rear, of_rear), (front, of_front) = pin(s - LINK_LENGTH / 2), pin(s + LINK_LENGTH / 2)
    along = (front - rear) / np.hypot(*(front - rear))
    force = 0.5 * (of_rear + of_front)
    force[1] += GRAVITY
    return np.array([np.sum(force * axis, axis=0) for axis in (along, [-along[1], along[0]])]) / GRAVITY


def _impacts(t, s, path, speed, rng):
    """Return the acceleration x, y, z (3, n) in g by impacts of all pitches at the sensor, at fine times t."""
    pitch = path.length / PITCHES
    rate = RATE_HZ * OVERSAMPLING
    mean_speed = speed.loop_hz * path.length
    longest = int(np.ceil(IMPACT_S[1] * rate)) + 1
    out = np.zeros((3, t.size + longest))
    for i, begin in enumerate(path.start[:-1]):
        running_on = i % 2 == 0  # arcs begin at even places; the number of pitches tells how far away the impact is
        number = np.arange(np.ceil((s[0] - begin) / pitch), np.floor((s[-1] - begin) / pitch) + 1)
        time = np.interp(begin + number * pitch, s, t)
        links = np.minimum(number % PITCHES, -number % PITCHES)
        share = np.where(links == 0, 1.0, FAR * np.exp(-(links - 1) * pitch / REACH))
        peak = IMPACT_G * mean_speed * (1.0 if running_on else LEAVING) * share
        peak *= np.exp(IMPACT_SPREAD * rng.standard_normal(number.size))
        # on its own link a wheel pushes outward and lets go inward; waves along the chain have no side
        own = 1.0 if running_on else -1.0
        side = np.where(links == 0, own, np.where(rng.random(number.size) < 0.5, -1.0, 1.0))
        direction = rng.uniform(-1.0, 1.0, (3, number.size))
        direction[1] = side
        vector = np.array(AXIS_SHARE)[:, None] * direction * peak
        length = rng.uniform(*IMPACT_S, number.size)
        index = np.ceil(time * rate).astype(int)[:, None] + np.arange(longest)
        since = index / rate - time[:, None]
        shape = np.where(since < length[:, None], np.sin(np.pi * since / length[:, None]), 0.0)
        np.add.at(out, (slice(None), index), vector[:, :, None] * shape)
    return out[:, : t.size]


if __name__ == "__main__":
    write_dataset(FOLDER)
