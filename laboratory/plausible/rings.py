"""The ring to choose on sampled tracks, by the force of a tooth and by contact durations: what it gains and costs."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd

from laboratory.plausible.draws import DrawnRig, scenes
from laboratory.plausible.rows import Values, scene_name
from laboratory.plausible.settings import PlausibleConfig
from laboratory.plausible.verdicts import JAMMED, is_jammed
from trackdyn.measure.ring_rule import OTHER_FORCES, DurationRule, RingRule, with_tooth_forces
from trackdyn.rig.rig import Rig
from trackdyn.sweeps.engine import DONE

CHOSEN, NONE, DIFFER = "chosen", "none", "starts differ"  # states of a rule on a track that ran
DURATIONS = "durations"  # name of the rule of the paper's durations; others are named by their share
HEAD = ["draw", "rule", "state", "radius_m", "tooth_ratio", "tension_ratio", "mobilised_friction"]


def ring_table(config: PlausibleConfig, drawn: Sequence[DrawnRig], rows: Iterable[Mapping]) -> pd.DataFrame:
    """Return what each rule recommends on each track.

    Parameters
    ----------
    config : PlausibleConfig
    drawn : sequence of DrawnRig
    rows : iterable of dict
        Of each of them, as `draws.run_rigs` gives it.

    Returns
    -------
    pandas.DataFrame
        A row per draw and rule: ``draw``; ``rule``, the share of `RingRule` (0.3, 0.5, 0.7) or ``durations``;
        ``state``, that of a row that did not run, ``jammed``, ``starts differ``, ``none`` or ``chosen``; and of the
        ring that is chosen ``radius_m``, ``tooth_ratio`` and ``tension_ratio`` (1; the force of a tooth and the tension
        of the strand over those without a ring, the largest of the speeds) and ``mobilised_friction`` (1; mean over the
        speeds), of the first start. Then the readings of equal pitch (``equal_pitch <reading>``, m).
    """
    table = []
    for track, row in zip(drawn, rows, strict=True):
        equal = track.rig.equal_pitch_radii if track.rig is not None else {}
        readings = {f"equal_pitch {name}": radius for name, radius in equal.items()}
        for name, of_rule in _choices(config, row, track.rig).items():
            table.append({"draw": track.draw, "rule": name, **of_rule, **readings})
    frame = pd.DataFrame(table)
    return frame.reindex(columns=[*HEAD, *(name for name in frame if name not in HEAD)])


def _choices(config: PlausibleConfig, row: Mapping, rig: Rig | None) -> dict[str, dict]:
    """Return what each rule recommends on one track."""
    teeth = rig.sprocket.teeth if rig is not None else 1
    rules = {f"{share:g}": RingRule(share) for share in sorted({RingRule().tooth_force, *OTHER_FORCES})}
    rules |= {DURATIONS: DurationRule(teeth)}
    if rig is None or row["state"] != DONE:
        return {name: {"state": row["state"]} for name in rules}
    starts = row["values"]["starts"]
    if any(is_jammed(config, values) for values in starts):
        return {name: {"state": JAMMED} for name in rules}
    studies = [with_tooth_forces(_study(config, values)) for values in starts]
    return {name: _chosen(rule, studies) for name, rule in rules.items()}


def _chosen(rule: RingRule | DurationRule, studies: list[pd.DataFrame]) -> dict:
    """Return the ring that a rule recommends from every start, with what it gains and costs from the first one."""
    radii = [rule.radius(study) for study in studies]
    if len({-1.0 if np.isnan(radius) else radius for radius in radii}) > 1:
        return {"state": DIFFER}
    if np.isnan(radii[0]):
        return {"state": NONE}
    rows = studies[0][studies[0]["ring_radius_m"] == radii[0]]
    worst = rows[["tooth_ratio", "tension_ratio"]].max().to_dict()
    return {"state": CHOSEN, "radius_m": radii[0], **worst, "mobilised_friction": rows["mobilised_friction"].mean()}


def _study(config: PlausibleConfig, values: Values) -> pd.DataFrame:
    """Return the ring study of a start: a row per ring, and none, at every speed that is run without a ring."""
    all_scenes = scenes(config)
    speeds = [rpm for rpm, ring, _ in all_scenes if ring is None]
    return pd.DataFrame([
        {"rpm": rpm, "ring_radius_m": np.nan if ring is None else ring, **values[scene_name(rpm, ring)]}
        for rpm, ring, _ in all_scenes if rpm in speeds
    ])  # fmt: skip
