"""Invented tables of the study of plausible tracks, in the form of docs/measured/plausible_*.csv; no track was run."""

import numpy as np
import pandas as pd

from laboratory.plausible.draws import EQUAL_PITCH
from laboratory.plausible.settings import load_plausible
from laboratory.plausible.shares import CREEP, separating_values, share_map, shares, with_creep
from replication.paper.claims import load_claims, load_sentences

CONFIG = load_plausible("config/plausible.yaml")
CLAIMS = "config/claims.yaml"
FRICTION = 0.3
BY_WHEELS = ("2", "3")  # sentences that no draw decides


def invented_tables(count: int = 200, seed: int = 1) -> dict[str, pd.DataFrame]:
    """Tables by name: sentence 19 goes with a low creep slope, 21 with equal pitch, the others are even."""
    random = np.random.default_rng(seed)
    statements = {str(number): words for number, words in load_sentences(CLAIMS).items()}
    claims = {claim.name: claim.claim for claim in load_claims(CLAIMS) if claim.sentence}
    creep, pitch = np.exp(random.uniform(np.log(0.2), np.log(80), count)), random.uniform(0.3015, 0.3085, count)
    columns = {
        "draw": range(count),
        "state": np.where(random.random(count) < 0.93, "done", "refused"),
        EQUAL_PITCH: pitch,
        "ring_contact.transition_velocity": FRICTION / creep,
        "equal_pitch polygonal": pitch,
        "equal_pitch arc": pitch + 0.0024,
        "equal_pitch pins": pitch + 0.0041,
        "equal_pitch chord": pitch + 0.0062,
        "engaged": (random.random(count) < 0.4).astype(float),
        "radius": random.choice([0.305, 0.307, 0.308, 0.309, 0.313, np.nan], count),
    }
    chances = {"19": np.where(creep < 2, 0.4, 0.02), "21": np.where(pitch < 0.304, 0.8, 0.1), "5": 0.0}
    for name in (name for name in [*statements, *claims] if name not in BY_WHEELS):
        columns[name] = (random.random(count) < chances.get(name, 0.5)).astype(float)
        columns[name][random.random(count) < 0.05] = np.nan
    draws = pd.DataFrame(columns)
    lost = draws["state"] != "done"
    draws.loc[lost, ["engaged", "radius", *(name for name in [*statements, *claims] if name in draws)]] = np.nan
    draws.insert(2, "reason", np.where(lost, "step 0.0001 s: contacts are not resolved", ""))
    known = with_creep(draws, FRICTION)
    near = pd.DataFrame({name: 1.0 for name in statements}, index=range(21))
    near[["2", "3"]] = np.nan
    near.loc[1:8, "19"] = 0.0
    near.loc[9, "22"] = np.nan
    head = {"rig": range(21), "shown": near.sum(axis=1).astype(int), "judged": near.notna().sum(axis=1)}
    tooth = {"draw": [1, 1], "ring_radius_m": [np.nan, 0.308], "rpm": 115.0, "change_pct": [4.0, -0.5]}
    return {
        "draws": draws,
        "sentences": shares(CONFIG, known, statements),
        "claims": shares(CONFIG, known, claims),
        "map": share_map(known, [name for name in statements if name in known]),
        "values": separating_values(known, statements, [CREEP, EQUAL_PITCH], CONFIG.seed),
        "tooth": pd.DataFrame(tooth),
        "near": pd.concat([pd.DataFrame(head), near], axis=1),
    }
