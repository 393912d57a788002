"""How the measures of the fit move when one fitted parameter moves, when equal pitch is read otherwise, and when the
chain runs the other way.
"""

import pandas as pd
from scipy.optimize import brentq

from trackdyn.errors import TrackdynError
from laboratory.inference.fit import FitConfig, case_summary, measured
from laboratory.inference.unknowns import Unknowns
from trackdyn.measure.meshing import mean_events, smoothed_maxima
from trackdyn.measure.stopping import StopRule, run_steady, steady_fields
from trackdyn.parameters.groove import equal_pitch_radius
from trackdyn.parameters.rig import Rig
from trackdyn.scene.scene import Scene
from trackdyn.simulation.loop import Loop

AS_IT_IS = "as it is"


def changes(rig: Rig, config: FitConfig, factor: float = 1.2) -> dict[str, tuple[float, float]]:
    """Value of every fitted parameter, and the one that its sensitivity is taken with.

    A parameter stepped by ``log`` is multiplied by ``factor``, a linear one moved by a tenth of its range.
    """
    present = Unknowns(config.parameters, rig).of_rig(rig)
    found = {}
    for parameter in config.parameters:
        base, ends = present[parameter.label], parameter.intervals
        moved = base * factor if parameter.scale == "log" else base + 0.1 * (ends[-1][1] - ends[0][0])
        found[parameter.label] = base, moved
    return found


def equal_pitches(rig: Rig, printed: float = 0.308) -> dict[str, tuple[float, float]]:
    """Polygonal and arc radius (m) of the fitted equal pitch and of the two readings of "equal pitch at ``printed``".

    Polygonal: pins on a circle, links touching the ring at their middle. Arc: the centre line of the
    links bent to a circle of the same length; the polygonal radius that gives it is found here.
    """

    def arc(polygonal: float) -> float:
        candidate = rig.changed(sprocket__equal_pitch_radius=polygonal)
        c, teeth = candidate.chain, rig.sprocket.teeth
        return equal_pitch_radius(teeth, c.link_length, candidate.connector_length, c.link_thickness)["arc"]

    for_arc = float(brentq(lambda r: arc(r) - printed, printed - 0.01, printed, xtol=1e-7))
    readings = {"fitted": rig.sprocket.equal_pitch_radius, "arc length": for_arc, "polygonal": printed}
    return {name: (value, arc(value)) for name, value in readings.items()}


def candidates(rig: Rig, config: FitConfig) -> dict[str, Rig]:
    """The rig as it is, with every fitted parameter changed alone, and with each other reading of its equal pitch."""
    unknowns = Unknowns(config.parameters, rig)
    present = unknowns.of_rig(rig)
    rigs = {AS_IT_IS: rig}
    for name, (_, moved) in changes(rig, config).items():
        rigs[name] = rig.changed(**unknowns.changes(present | {name: moved})[0])
    readings = {name: value for name, (value, _) in equal_pitches(rig).items() if name != "fitted"}
    return rigs | {name: rig.changed(sprocket__equal_pitch_radius=value) for name, value in readings.items()}


def measure_candidates(rig: Rig, config: FitConfig, radius: float | None, step: float, rule: StopRule) -> pd.DataFrame:
    """Meshing summary of every candidate in one case of the fit, run until it has converged.

    Columns ``candidate, ring_radius_m, failed`` (why there is none) and those of `fit.case_summary`.
    """
    rows = []
    for name, candidate in candidates(rig, config).items():
        row = {"candidate": name, "ring_radius_m": radius, "failed": ""}
        try:
            fields = steady_fields(candidate, config.speed_rpm, rule)
            recording, _ = run_steady(Loop(Scene(candidate, config.speed_rpm, radius, step=step, **fields)), rule)
            rows.append(row | case_summary(recording))
        except TrackdynError as error:
            rows.append(row | {"failed": str(error)})
    return pd.DataFrame(rows)


def summaries_of(table: pd.DataFrame) -> dict[str, dict]:
    """Rows of `measure_candidates` of all cases as ``candidate -> radius -> summary or None``."""
    found: dict[str, dict] = {}
    for row in table.to_dict("records"):
        radius = None if pd.isna(row["ring_radius_m"]) else row["ring_radius_m"]
        failed = isinstance(row["failed"], str) and row["failed"]
        found.setdefault(row["candidate"], {})[radius] = None if failed else row
    return found


def sensitivity(rig: Rig, config: FitConfig, summaries: dict[str, dict]) -> pd.DataFrame:
    """Change of every target's measure when one fitted parameter changes (`changes`), the others held.

    Returns
    -------
    DataFrame
        ``parameter, base_value, changed_value, claim, ring_radius_m, measure, base, changed, change,
        change_in_tolerances``.
    """
    rows = []
    for name, (value, moved) in changes(rig, config).items():
        for t in config.targets:
            base, changed = measured(t, summaries[AS_IT_IS]), measured(t, summaries[name])
            seen = {"base": base, "changed": changed, "change": changed - base}
            about = {"parameter": name, "base_value": value, "changed_value": moved} | t.key
            rows.append(about | seen | {"change_in_tolerances": (changed - base) / t.tolerance})
    return pd.DataFrame(rows)


def equal_pitch_readings(rig: Rig, summaries: dict[str, dict]) -> pd.DataFrame:
    """Both readings of the printed equal pitch (`equal_pitches`) put into the rig, beside the fitted value.

    Returns
    -------
    DataFrame
        ``reading, polygonal_m, arc_m`` and, for each case of the fit, the shares of left and right arc.
    """
    rows = []
    for reading, (polygonal, arc) in equal_pitches(rig).items():
        row = {"reading": reading, "polygonal_m": polygonal, "arc_m": arc}
        for radius, summary in summaries[AS_IT_IS if reading == "fitted" else reading].items():
            name = "none" if radius is None else f"{radius:g}"
            for side in ("left", "right"):
                row[f"{side}_share_pct_{name}"] = summary[f"{side}_share_pct"] if summary else float("nan")
        rows.append(row)
    return pd.DataFrame(rows)


def run_directions(rig: Rig, config: FitConfig, step: float, rule: StopRule) -> pd.DataFrame:
    """Events of C16 and C17 for the chain descending and climbing on the sprocket.

    The paper does not say which way its chain runs. The mirrored rig (idler and road wheel on the other
    side of the sprocket) runs the other way; belt kinematics give it the same dominant peak.

    Returns
    -------
    DataFrame
        ``chain, ring, event, mean_s, sd_s`` for both readings of a maximum.
    """
    mirrored = rig.changed(
        idler__x=2 * rig.sprocket.x - rig.idler.x,
        road_wheel__x=2 * rig.sprocket.x - rig.road_wheel.x,
        tension__direction=180.0 - rig.tension.direction,
    )
    tables = []
    for candidate in (rig, mirrored):
        # clockwise, so the sprocket's outer side descends if the other wheels stand to its left
        descends = candidate.road_wheel.x < candidate.sprocket.x
        for radius in (None, rig.sprocket.ring_radius):
            pitches = tuple(range(1, rig.chain.pitches + 1))
            fields = steady_fields(candidate, config.speed_rpm, rule)
            recording, _ = run_steady(
                Loop(Scene(candidate, config.speed_rpm, radius, step=step, pitches=pitches, **fields)), rule
            )
            events = pd.concat([mean_events(recording), smoothed_maxima(recording)])
            events.insert(0, "ring", "none" if radius is None else f"{radius:g} m")
            events.insert(0, "chain", "descends" if descends else "climbs")
            tables.append(events)
    return pd.concat(tables, ignore_index=True)
