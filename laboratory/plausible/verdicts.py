"""Rows judged by the claims of the paper, sentence by sentence."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.plausible.draws import DrawnRig, scenes
from laboratory.plausible.rows import Values, scene_name
from laboratory.plausible.settings import PlausibleConfig
from trackdyn.measure.contacts import TOUCHING
from trackdyn.rig.rig import Rig
from trackdyn.sweeps.engine import DONE
from trackdyn_replication.paper.claims import MET, judge, judge_all, load_claims, load_sentences
from trackdyn_replication.paper.evidence import LEAST_RADII, Evidence
from trackdyn_replication.paper.published import EVENTS_WITH_RING, EVENTS_WITHOUT_RING
from trackdyn_replication.paper.scorecard import RADIUS, sentence_verdicts

# decided by kinematics and by the wheels, whose places no draw changes
SET_BY_WHEELS = ("C07", "C08")
JAMMED = "jammed"  # state of a row that ran and whose chain does not lie on the ring


def evidence(config: PlausibleConfig, row_scenes: list[list], values: Values, rig: Rig) -> Evidence:
    """Return the values of a start as evidence for claims; too few radii of a speed make no ring study."""
    metrics, events = [], []
    radii = Counter(rpm for rpm, ring, _ in row_scenes if ring is not None)
    for rpm, ring, detailed in row_scenes:
        row = values[scene_name(rpm, ring)]
        columns = {"rpm": rpm, "ring_radius_m": np.nan if ring is None else ring, **row}
        runs = [f"ring/{rpm:g}rpm_{ring}"] * (radii[rpm] >= LEAST_RADII)
        runs += [f"{rpm:g}rpm"] * (detailed and ring is not None)
        if rpm == config.speed_rpm and ring in (None, config.ring_radius_m):
            runs.append(f"meshing/{'no_ring' if ring is None else 'ring'}")
            for name, time in row.items():
                if name.startswith("event "):
                    event = name.removeprefix("event ")
                    scatter, area = row.get(f"scatter {event}"), row.get(f"area {event}")
                    events.append({"run": runs[-1], "event": event, "median_s": time, "sd_s": scatter, "area": area})
        metrics += [{"run": run, **columns} for run in runs]
    table = pd.DataFrame(events).astype({"median_s": float, "sd_s": float})
    return Evidence(pd.DataFrame(metrics), table, rig, config.speed_rpm)


class Judge:
    """Verdicts on rows by those claims of a file (``config/claims.yaml``) that a draw can decide."""

    def __init__(self, config: PlausibleConfig, path: Path | str):
        self.config, self.sentences = config, load_sentences(path)
        claims = [claim for claim in load_claims(path) if claim.sentence or claim.numbers]
        self.claims = [claim for claim in claims if claim.name not in SET_BY_WHEELS]

    def tracks(self, drawn: Sequence[DrawnRig], rows: Iterable[dict]) -> pd.DataFrame:
        """Return a row per drawn rig: ``draw, state, reason``, values, readings of equal pitch (m), and verdicts."""
        table = []
        for track, row in zip(drawn, rows, strict=True):
            outcome = {"state": row["state"], "reason": row["reason"] or track.reason}
            verdicts = self.rig(row, track.rig)
            if row["state"] == DONE and not verdicts:
                outcome = {"state": JAMMED, "reason": "the ring of the paper carries nothing"}
            readings = track.rig.equal_pitch_radii if track.rig is not None else {}
            equal = {f"equal_pitch {name}": radius for name, radius in readings.items()}
            table.append({"draw": track.draw, **outcome, **track.values, **equal, **verdicts})
        return pd.DataFrame(table)

    def rig(self, row: Mapping, rig: Rig | None) -> dict[str, float]:
        """Return whether a rig is engaged as printed, the ring to choose, and 1 or 0 for every sentence and claim.

        NaN where its starts differ. A row that is not done decides nothing, nor does one whose chain jams.
        """
        if rig is None or row["state"] != DONE:
            return {}
        starts = [self._start(values, rig) for values in row["values"]["starts"]]
        if not all(starts):
            return {}
        first = starts[0].items()
        return {name: value if all(value == other[name] for other in starts) else np.nan for name, value in first}

    def _start(self, values: Values, rig: Rig) -> dict[str, float]:
        """Judge one start; empty for a chain that jams: the ring of the paper carries no load at a speed."""
        at_radius = [values[scene_name(rpm, self.config.ring_radius_m)] for rpm in self.config.radii_m]
        if min(scene["ring_share_pct"] for scene in at_radius) < TOUCHING:
            return {}
        shown_by = evidence(self.config, scenes(self.config), values, rig)
        card = judge_all(self.claims, shown_by)
        whole = sentence_verdicts(card, self.sentences)
        of_radius = next(claim for claim in self.claims if claim.name == RADIUS)
        radius = next((value.value for value in judge(of_radius, shown_by).values), np.nan)
        judged = {"engaged": float(is_engaged(self.config, values, rig)), "radius": radius}
        names = [*whole["number"].astype(str), *(card["id"] + card["part"])]
        # where no force acts a claim cannot be judged, and is not shown
        return judged | dict(zip(names, [float(v == MET) for v in (*whole["verdict"], *card["verdict"])], strict=True))


def is_engaged(config: PlausibleConfig, values: Values, rig: Rig) -> bool:
    """Return whether connectors are in mesh as long as the paper prints, without a ring and with its own."""
    without, ring = (values[scene_name(config.speed_rpm, radius)] for radius in (None, config.ring_radius_m))
    begin, ended = EVENTS_WITHOUT_RING["first contact of the right arc"], config.engaged.time_s
    for event, at in (("right gone", "right contact gone"), ("out", "out of engagement")):
        time = without[f"event {event}"]
        if time is None or not abs(time - (EVENTS_WITHOUT_RING[at] - begin)) <= ended:
            return False
    turn = 60 * rig.sprocket.transmission_ratio / config.speed_rpm
    share = 100 * (EVENTS_WITH_RING["ring left"] - EVENTS_WITH_RING["ring first touched"]) / turn
    return abs(ring["ring_share_pct"] - share) <= config.engaged.share_pct
