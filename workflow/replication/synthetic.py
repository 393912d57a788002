"""SYNTHETIC stand-in for the measured acceleration of a track link, which the paper did not publish.

Nothing here is measured, and agreement of a simulation with it validates nothing; `DESCRIPTION` says what is printed,
what is fitted to that (:func:`fit`), and that all else is assumed. No dynamics of the simulator is used: a record is
the motion of a link on an ideal belt around the wheels, with the three causes that Sect. 5 of the paper names for the
sharper course of its experiment. The sprocket speed fluctuates slowly about its mean; contacts are short, half-sine
impacts whenever a pitch runs on or off a wheel; the sensor stands on glue and rings: the impacts pass through a damped
resonance. Noise, 16 bit and the range of +-20 g complete the sensor.
"""

import argparse
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import brentq
from scipy.signal import lfilter

from trackdyn.errors import InputError
from trackdyn.files import write_text
from trackdyn.parameters.layout import BeltPath, belt_path
from trackdyn.sensor.sensor_csv import COLUMNS, write_sensor_csv
from trackdyn.sensor.signals import main_line, rms, standard_deviation

COMMAND = "python -m replication.synthetic"
GENERATOR_VERSION = "1.0.0"

# printed: the sensor and the record of Sect. 5, and the number of links of Sect. 2
RATE_HZ = 1000
RECORD_S = 90.0
RANGE_G = 20.0
PITCHES = 35
GRAVITY = 9.81  # m/s2

# what the data package says of itself and of its columns
DESCRIPTION = """
SYNTHETIC, not measured. The paper's measured records are not published; these stand in for them, and agreement of a
simulation with them is no validation. Made without simulated dynamics: a link on an ideal belt around three wheels
(assumed layout: that of the rig first_fit, config/rigs/first_fit.yaml, on the other side of the sprocket; not that of
config/rigs/paper.yaml), a slowly fluctuating speed, half-sine impacts at every pitch that runs on or off a wheel, a
sensor that rings on its glue, noise, 16 bit and a range of +-20 g. Fitted to the paper's printed main frequency and
amplitude is the mean loop frequency, at 210 rpm the size of the fluctuation instead; everything else is assumed, RMS,
SD and impacts included. 'achieved' is taken as in the paper: the highest line of a rectangular-window spectrum of
90,000 points at 1000 Hz.
"""
AXES = ("along the link, in the direction of travel", "along the outward normal of the link", "lateral")

# assumed: centre x, y and radius under the pins (wheel or ring and half a link's thickness), m, of
# sprocket, idler and road wheel: nominal places of `first_fit`, mirrored. A copy: the data must not follow a refit.
CIRCLES = ((0.0, 0.0, 0.308 + 0.02), (1.05, -0.05, 0.28 + 0.02), (1.65, -0.50, 0.28 + 0.02))
LINK_LENGTH = 0.100  # pin to pin, m

# assumed: speed fluctuation. Whole cycles in a record leave the mean speed of the record alone; weights
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
AXIS_SHARE = (0.5, 1.0, 0.3)  # of an impact in x, y, z

# assumed: sensor
GLUE_HZ = 220.0
GLUE_DAMPING = 0.08
CROSS_AXIS = 0.02  # of y that the lateral axis shows
NOISE_G = 0.02  # RMS of each axis
BITS = 16
TOP_G = RANGE_G * (1.0 - 2.0 ** (1 - BITS))  # highest value that the converter gives
OVERSAMPLING = 8  # impacts of 1 ms and the ringing need more than the sampling rate


@dataclass(frozen=True)
class SyntheticSpeed:
    """One motor speed: what the paper prints and what the generator takes."""

    rpm: int  # motor speed, rev/min (printed)
    printed_hz: float  # experimental main frequency, Hz (printed, Sect. 5 on Fig. 18)
    printed_g: float  # its amplitude, g (printed, Sect. 5 on Fig. 18)
    loop_hz: float  # mean loop frequency, Hz (fitted, see :func:`fit`)
    # RMS of the slow fluctuation of the speed, relative to its mean (assumed :data:`LEAST_FLUCTUATION`, or fitted, see
    # :func:`fit`)
    fluctuation: float = LEAST_FLUCTUATION

    @property
    def seed(self) -> int:
        """Seed of the random numbers; the motor speed, so that no choice hides in it."""
        return self.rpm


SPEEDS = {
    115: SyntheticSpeed(115, 0.131, 1.083, loop_hz=0.13057),
    150: SyntheticSpeed(150, 0.176, 1.1200, loop_hz=0.17625),
    180: SyntheticSpeed(180, 0.2090, 1.1720, loop_hz=0.21111),
    210: SyntheticSpeed(210, 0.253, 0.7698, loop_hz=0.253, fluctuation=0.04965),
}
SyntheticRecord = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def generate(rpm: int, seed: int | None = None, duration_s: float = RECORD_S) -> SyntheticRecord:
    """A synthetic record at one of the printed motor speeds (rev/min), by default that of the committed data.

    Returns
    -------
    t, ax, ay, az : (N,) arrays
        Time, s, and specific force, g: x along the link in the direction of travel, y along its outward
        normal, z lateral. The speed fluctuates the same in a shorter record.
    """
    speed = _speed(rpm)
    return _record(speed, speed.seed if seed is None else seed, duration_s)


def fit(speed: SyntheticSpeed, seed: int | None = None) -> SyntheticSpeed:
    """Mean loop frequency, or else fluctuation, that gives the printed amplitude in a 90 s record.

    One scalar search, never two at once:

    1. The mean is searched between the line of the spectrum nearest to the printed frequency and half a
       line from it, on the side where the printed frequency lies; the fluctuation is the least one.
    2. Where the printed amplitude is higher than on the line itself, the loop runs on the line and a
       difference remains (:func:`closeness`); no gain hides it.
    3. Where it is lower than half way between two lines, the loop runs at the printed frequency and the
       fluctuation grows until the amplitude fits.

    Both numbers are rounded to 1e-5; :data:`SPEEDS` stores these results.

    A frequency can be fitted to an amplitude since the printed one is that of the highest line of 90,000 points at 1000
    Hz: lines are 1/90 Hz apart, and a rectangular window shows a belt that turns between two up to 36 % too low.
    At constant speed the printed 0.131 and 0.176 Hz alone make 1.088 and 1.123 g of the 1.17 g of this layout; 1.083
    and 1.120 g are printed. Even the 0.7698 g at 210 rpm could be had, just, 0.48 lines off, but an unsteady speed,
    which the paper names, needs no such coincidence. The printed numbers cannot tell the two apart.
    """
    seed = speed.seed if seed is None else seed

    def excess(loop_hz, fluctuation=LEAST_FLUCTUATION):
        trial = replace(speed, loop_hz=loop_hz, fluctuation=fluctuation)
        return main_line(_record(trial, seed)[2], RATE_HZ, speed.printed_hz)[1] - speed.printed_g

    line = round(speed.printed_hz * RECORD_S) / RECORD_S
    between = line + np.copysign(0.5 / RECORD_S, speed.printed_hz - line)
    loop_hz, fluctuation = line, LEAST_FLUCTUATION
    if excess(between) > 0.0:
        loop_hz, step = speed.printed_hz, 0.0025
        # a step at a time: beyond the first crossing the amplitude rises and falls
        while excess(loop_hz, fluctuation + step) > 0.0:
            fluctuation += step
        fluctuation = brentq(lambda x: excess(loop_hz, x), fluctuation, fluctuation + step, xtol=1e-6)
    elif excess(line) > 0.0:
        loop_hz = brentq(excess, between, line, xtol=1e-6)
    return replace(speed, loop_hz=round(loop_hz, 5), fluctuation=round(fluctuation, 5))


def closeness(records: Mapping[int, np.ndarray] | None = None) -> pd.DataFrame:
    """Printed and achieved dominant peak at each speed, as the paper takes it (rectangular window).

    ``records`` are y accelerations (g, sampled at 1000 Hz) by motor speed; generated if left out. Differences are in
    lines of the spectrum and in percent, ``clipped`` counts samples.
    """
    if records is None:
        records = {rpm: generate(rpm)[2] for rpm in SPEEDS}
    rows = []
    for rpm, ay in records.items():
        speed = _speed(rpm)
        hz, amplitude = main_line(ay, RATE_HZ, speed.printed_hz)
        row = {"rpm": rpm, "printed_hz": speed.printed_hz, "achieved_hz": hz}
        row["difference_bins"] = (hz - speed.printed_hz) * len(ay) / RATE_HZ
        row |= {"printed_g": speed.printed_g, "achieved_g": amplitude}
        row["difference_percent"] = 100.0 * (amplitude / speed.printed_g - 1.0)
        row |= {"rms_g": rms(ay), "sd_g": standard_deviation(ay), "peak_g": float(np.max(np.abs(ay)))}
        rows.append(row | {"clipped": int(np.sum(np.abs(ay) >= TOP_G))})
    return pd.DataFrame(rows).set_index("rpm")


def write_record(folder, rpm: int) -> np.ndarray:
    """Write ``{rpm}rpm.csv`` into an existing folder and return its y acceleration, g."""
    record = generate(rpm)
    write_sensor_csv(Path(folder) / f"{rpm}rpm.csv", *record, comments=_comments(SPEEDS[rpm]))
    return record[2]


def write_dataset(folder) -> pd.DataFrame:
    """Write the records of all speeds and their ``datapackage.json``; returns the table of :func:`closeness`.

    The folder is made if it does not exist. Equal calls give equal bytes.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: the folder cannot be made ({error.strerror}); take another.") from error
    table = closeness({rpm: write_record(folder, rpm) for rpm in SPEEDS})
    package = json.dumps(_datapackage(folder, table), indent=2, ensure_ascii=False)
    write_text(folder / "datapackage.json", package + "\n")
    return table


def _speed(rpm):
    """The speed, or InputError."""
    if rpm not in SPEEDS:
        problem = f"rpm is {rpm!r}, but the paper prints no experiment at that motor speed"
        raise InputError(f"{problem}; choose one of {', '.join(map(str, SPEEDS))}.")
    return SPEEDS[rpm]


def _record(speed, seed, duration_s=RECORD_S):
    """The record of :func:`generate` with the numbers of ``speed``."""
    if not (np.isfinite(duration_s) and duration_s * RATE_HZ >= 2):
        raise InputError(f"duration_s is {duration_s!r}; give a finite length of at least two samples, in s.")
    count = round(duration_s * RATE_HZ)
    t = np.arange(count) / RATE_HZ
    rng = np.random.Generator(np.random.PCG64(seed))
    path = belt_path(CIRCLES)
    start, phase = rng.uniform(0.0, path.length), rng.uniform(0.0, 2.0 * np.pi, CYCLES.size)
    s, v, vdot = _travel(t, speed, path.length, start, phase)

    fine = np.arange(count * OVERSAMPLING) / (RATE_HZ * OVERSAMPLING)
    shocks = _impacts(fine, _travel(fine, speed, path.length, start, phase)[0], path, speed, rng)
    signal = _glue(shocks).reshape(3, count, OVERSAMPLING).mean(axis=2)
    signal[:2] += _belt_acceleration(path, s, v, vdot)
    signal[2] += CROSS_AXIS * signal[1]
    signal += NOISE_G * rng.standard_normal(signal.shape)
    return (t, *_digitise(signal))


def _travel(t, speed, length, start, phase):
    """Arc length (m), velocity (m/s) and acceleration (m/s2) of the link along the belt at times t."""
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
    """Specific force x, y (2, n) in g in the middle of a link, a chord whose pins run on the belt (Eq. 40)."""

    def pin(s):
        position, heading, curvature = path.along(s)
        tangent = np.array([np.cos(heading), np.sin(heading)])
        # the belt runs clockwise: the centre of an arc lies to the right of the tangent
        return position.T, vdot * tangent + v**2 * curvature * np.array([tangent[1], -tangent[0]])

    (rear, of_rear), (front, of_front) = pin(s - LINK_LENGTH / 2), pin(s + LINK_LENGTH / 2)
    along = (front - rear) / np.hypot(*(front - rear))
    outward = np.array([-along[1], along[0]])
    force = 0.5 * (of_rear + of_front)
    force[1] += GRAVITY
    return np.array([np.sum(force * along, axis=0), np.sum(force * outward, axis=0)]) / GRAVITY


def _impacts(t, s, path, speed, rng):
    """Acceleration x, y, z (3, n) in g by impacts of all pitches, felt at the sensor, at fine times t."""
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


def _glue(a):
    """Response (3, n) of a mass on a spring and damper to the acceleration of its base, bilinear."""
    w, w0 = 2.0 * RATE_HZ * OVERSAMPLING, 2.0 * np.pi * GLUE_HZ
    damping = 2.0 * GLUE_DAMPING * w0 * w
    below = [w**2 + damping + w0**2, 2.0 * (w0**2 - w**2), w**2 - damping + w0**2]
    return lfilter([w0**2 + damping, 2.0 * w0**2, w0**2 - damping], below, a, axis=1)


def _digitise(a):
    """Round to the steps of the converter and cut at its range, g."""
    half = 2 ** (BITS - 1)
    return np.clip(np.rint(a * (half / RANGE_G)), -half, half - 1) * (RANGE_G / half)


def _comments(speed):
    """Comment lines at the top of a file."""
    return (
        "SYNTHETIC: not measured. Stand-in for the unpublished record of the paper's experiment;",
        "agreement of a simulation with it is no validation.",
        f"motor speed {speed.rpm} rev/min; {RATE_HZ} Hz; range +-{RANGE_G:g} g in {BITS} bit",
        "t_s: time, s; ax_g along the link, ay_g along its outward normal, az_g lateral: specific force, g",
        f"made by replication.synthetic {GENERATOR_VERSION}, seed {speed.seed} (PCG64)",
        f"mean loop frequency {speed.loop_hz:.5f} Hz, fluctuation of the speed {speed.fluctuation:.5f} (RMS)",
    )


def _datapackage(folder, table):
    """Frictionless description of the written files."""
    limits = {"minimum": -RANGE_G, "maximum": RANGE_G}
    fields = [{"name": COLUMNS[0], "type": "number", "unit": "s", "description": "Time."}]
    for name, axis in zip(COLUMNS[1:], AXES, strict=True):
        what = f"Synthetic specific force {axis}; 1 g = {GRAVITY} m/s2."
        fields.append({"name": name, "type": "number", "unit": "g", "description": what, "constraints": limits})
    resources = []
    for rpm, row in table.iterrows():
        speed, data = SPEEDS[rpm], (folder / f"{rpm}rpm.csv").read_bytes()
        title = f"Synthetic record at a motor speed of {rpm} rev/min"
        resource = {"name": f"synthetic-{rpm}rpm", "path": f"{rpm}rpm.csv", "profile": "tabular-data-resource"}
        resource |= {"title": title, "format": "csv", "mediatype": "text/csv", "encoding": "utf-8"}
        resource |= {"dialect": {"commentChar": "#", "header": True}, "bytes": len(data)}
        resource |= {"hash": f"sha256:{hashlib.sha256(data).hexdigest()}", "seed": speed.seed}
        resource["fitted"] = {"loop_hz": speed.loop_hz, "fluctuation": speed.fluctuation}
        resource["printed"] = {"main_hz": speed.printed_hz, "amplitude_g": speed.printed_g}
        off = round(row.difference_percent, 2) + 0.0  # no -0.0
        achieved = {"main_hz": round(row.achieved_hz, 5), "amplitude_g": round(row.achieved_g, 4)}
        achieved |= {"amplitude_difference_percent": off, "rms_g": round(row.rms_g, 4), "sd_g": round(row.sd_g, 4)}
        resource["achieved"] = achieved | {"peak_g": round(row.peak_g, 3), "clipped_samples": int(row.clipped)}
        resources.append(resource | {"schema": {"fields": fields}})
    licence = {"path": "https://creativecommons.org/publicdomain/zero/1.0/", "title": "CC0 1.0 Universal"}
    made = {"command": COMMAND, "version": GENERATOR_VERSION, "random_numbers": "numpy PCG64"}
    return {
        "profile": "tabular-data-package", "name": "trackdyn-synthetic-link-acceleration",
        "title": "Synthetic acceleration of a link of a double-pin track", "description": " ".join(DESCRIPTION.split()),
        "version": GENERATOR_VERSION, "keywords": ["synthetic", "acceleration", "track", "not measured"],
        "licenses": [{"name": "CC0-1.0", **licence}], "generator": made, "resources": resources,
    }  # fmt: skip


def main(argv=None) -> None:
    """Write the data set, or print what :func:`fit` gives for every speed."""
    parser = argparse.ArgumentParser(prog=COMMAND, description=main.__doc__)
    parser.add_argument("--out", default="data/synthetic", help="folder to write (default: %(default)s)")
    parser.add_argument("--fit", action="store_true", help="print the fitted constants, write nothing")
    arguments = parser.parse_args(argv)
    if arguments.fit:
        for speed in SPEEDS.values():
            print(fit(speed))
    else:
        print(write_dataset(arguments.out).round(4).to_string())


if __name__ == "__main__":
    main()
