"""Any rig's loop in both codes, from one settled start: how far every body is from itself.

Wheels are fixed (arms and sliders stand still, the tensioner is locked), the speed is prescribed, drag and bushings are
viscous: that is what the other code's model has.
"""

import time

import numpy as np

from replication.peers.comparison import run_peer
from replication.study.settings import PEER_LAWS
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop

RAMP = 0.4  # s
STEP, PEER_STEP = 2e-5, 5e-4  # s, where the paper's rig agrees to 0.01 % of a link's way (Figure 14)
# Largest distance of a body from itself, as a part of the chain's way: five times what the paper's rig shows there,
# since other loops are longer and slacker.
TOLERANCE = 5e-4


def fixed(rig: Rig) -> Rig:
    """The rig with every wheel fixed where its file has it, and a prescribed speed without ripple."""
    changes = {
        f"{name}__{part}": None
        for name, wheel in rig.rollers.items()
        for part in ("arm", "slider")
        if getattr(wheel, part)
    }
    if changes or rig.drive:
        changes |= {"drive": None}
    return rig.changed(**changes, tension__kept="locked")


def rig_in_both(rig: Rig, sprocket_rpm: float, duration: float) -> dict:
    """Run a rig from rest in both codes.

    It is `fixed` first; it runs so long (s) after the ramp.

    Returns
    -------
    dict
        ``way_m``: of the chain; ``distance_m``: largest of any mass centre from itself in the other code at any
        sample; ``share``: one over the other; ``gap_m``: of the other code; ``wall_s``, ``peer_wall_s``.
    """
    motor = sprocket_rpm * rig.sprocket.transmission_ratio
    scene = Scene(
        fixed(rig), motor, duration=duration, lead_in=0.0, ramp=RAMP, step=STEP, spells=False, tension="locked",
        **PEER_LAWS,
    )  # fmt: skip
    run, _ = run_peer(scene, PEER_STEP)
    loop = Loop(scene)
    begin = time.perf_counter()
    places = [loop.mass_centres]
    for _ in range(len(run.time) - 1):
        loop.advance(1.0 / scene.rig.sensor.rate)
        places.append(loop.mass_centres)
    wall = time.perf_counter() - begin
    apart = np.hypot(*(np.array(places) - run.centre).transpose(2, 0, 1))
    way = abs(scene.sprocket_rate) * rig.pin_circle * (RAMP / 2 + duration)
    return {
        "way_m": way, "distance_m": float(apart.max()), "share": float(apart.max() / way),
        "gap_m": float(run.gap.max()), "wall_s": wall, "peer_wall_s": run.wall,
        "range_m": float(np.ptp(np.array(places)[:, :, 1])),
    }  # fmt: skip
