"""Rows judged by the claims of the paper, sentence by sentence."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd

from laboratory.plausible.draws import DrawnRig, scenes
from laboratory.plausible.rows import scene_name
from laboratory.plausible.settings import PlausibleConfig
from replication.paper.claims import SHOWN, Claim, judge_all
from replication.paper.evidence import LEAST_RADII, Evidence
from replication.paper.scorecard import RADIUS, sentence_verdicts
from trackdyn.rig.rig import Rig
from trackdyn.sweeps.engine import DONE


def evidence(config: PlausibleConfig, row_scenes: list[list], values: Mapping[str, dict], rig: Rig) -> Evidence:
    """Return the row of a rig as what claims are judged by; a speed at too few radii belongs to no ring study.

    ``row_scenes`` are speed (rev/min), ring radius (m) and whether sensors are read, ``values`` the row by scene.
    """
    metrics, events = [], []
    radii = Counter(rpm for rpm, ring, _ in row_scenes if ring is not None)
    for rpm, ring, sensed in row_scenes:
        row = values[scene_name(rpm, ring)]
        columns = {"rpm": rpm, "ring_radius_m": np.nan if ring is None else ring, **row}
        runs = [f"ring/{rpm:g}rpm_{ring}"] * (radii[rpm] >= LEAST_RADII) + [f"{rpm:g}rpm"] * sensed
        if rpm == config.speed_rpm and ring in (None, config.ring_radius_m):
            runs.append(f"meshing/{'no_ring' if ring is None else 'ring'}")
            times = {key.removeprefix("event "): time for key, time in row.items() if key.startswith("event ")}
            events += [
                {"run": runs[-1], "event": event, "median_s": time, "sd_s": np.nan, "area": row.get(f"area {event}")}
                for event, time in times.items()
            ]
        metrics += [{"run": run, **columns} for run in runs]
    return Evidence(pd.DataFrame(metrics), pd.DataFrame(events), rig, config.speed_rpm, config.ring_radius_m)


def judge_rows(
    config: PlausibleConfig,
    drawn: Sequence[DrawnRig],
    rows: Iterable[dict],
    claims: list[Claim],
    sentences: Mapping[int, str],
) -> pd.DataFrame:
    """Judge the rows of drawn rigs.

    Returns
    -------
    DataFrame
        A row a drawn rig: ``draw, ring, equal_pitch, state, reason``, the values that were drawn, the radius to choose
        at each speed (``radius_115`` and so on, m), and ``1`` or ``0`` for every sentence (by number) and every claim
        that is judged; empty where none is.
    """
    table = []
    for track, row in zip(drawn, rows, strict=True):
        outcome = {"state": row["state"], "reason": row["reason"] or track.reason}
        verdicts = judge_rig(config, row, track.rig, claims, sentences)
        table.append({"draw": track.draw, **track.scenario._asdict(), **outcome, **track.values, **verdicts})
    return pd.DataFrame(table)


def judge_rig(
    config: PlausibleConfig, row: Mapping, rig: Rig | None, claims: list[Claim], sentences: Mapping[int, str]
) -> dict[str, float]:
    """Radius to choose at each speed, and 1 or 0 for every sentence and claim that the row of a rig decides.

    A row that is not done decides none.
    """
    if rig is None or row["state"] != DONE:
        return {}
    card, numbers = judge_all(claims, evidence(config, scenes(config), row["values"], rig))
    whole = sentence_verdicts(card, sentences)
    radii = numbers[numbers["id"] + numbers["part"] == RADIUS]
    judged = {f"radius_{rpm:g}": value for rpm, value in zip(radii["rpm"], radii["value"], strict=True)}
    for name, verdict in [
        *zip(whole["number"].astype(str), whole["verdict"], strict=True),
        *zip(card["id"] + card["part"], card["verdict"], strict=True),
    ]:
        judged[name] = float(verdict == SHOWN)  # where no force acts a claim cannot be judged, and is not shown
    return judged
