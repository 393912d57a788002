"""Work of friction by area of the teeth and by wheel: what wears."""

import numpy as np

from trackdyn.simulation.recording import Recording


def sliding_per_km(recording: Recording) -> dict[str, float]:
    """Work of friction in J for each kilometre that the chain runs.

    Taken over as many whole passages of a pitch as the record holds: teeth and links meet alike in each. A kilometre is
    counted along the chain, pin to pin. ``sliding_area_1_j_km`` and so on are all connectors by area of the groove,
    ``sliding_teeth_j_km`` their sum, ``sliding_ring_j_km`` links on the sprocket's ring and ``sliding_wheels_j_km`` on
    the other wheels; nothing of a recording without an account of sliding, or shorter than a passage.
    """
    rows, rig, passage = recording.sliding, recording.scene.rig, recording.periods.passage
    last = len(rows) - 1
    count = 0 if not rows.size or np.isnan(passage) else int(last / recording.rate / passage)
    if count < 1:
        return {}
    begin = recording.steady_time(np.array([recording.seconds])) - count * passage
    work = rows[last] - rows[last - round((recording.seconds - recording.real_time(begin)[0]) * recording.rate)]
    single = recording.scene.chain == "single_pin"
    pitch = rig.single_pin_pitch if single else rig.chain.link_length + rig.connector_length
    by_km = work * (1000.0 / (count * pitch))
    areas = rows.shape[1] - recording.wheel_rate.shape[1]
    columns = {f"sliding_area_{area}_j_km": float(by_km[area - 1]) for area in range(1, areas + 1)}
    columns["sliding_teeth_j_km"] = float(by_km[:areas].sum())
    columns["sliding_ring_j_km"] = float(by_km[areas])
    columns["sliding_wheels_j_km"] = float(by_km[areas + 1 :].sum())
    return columns
