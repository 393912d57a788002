"""The measured block of the page on wear, from the lives alone."""

import pandas as pd

from trackdyn.measure.contacts import TOUCHING

LIFE = ["rig", "rpm", "tension", "first_radius_m"]
BAND = 0.15  # of the RMS force of the left arc, as C24 has it


def wear_text(lives: pd.DataFrame) -> str:
    """Lives as a table: kilometres, the largest radii at which the right arc touches and at which the RMS force of the
    left arc is out of its band about that of the new ring.
    """
    rows = []
    for life, table in lives.groupby(LIFE, sort=False):
        leaves = (table["left_rms_n"] / table["left_rms_n"].iloc[0] - 1.0).abs() > BAND
        row = dict(zip(LIFE[1:3], life[1:3], strict=True)) | {"first radius (mm)": f"{1e3 * life[3]:g}"}
        row |= {"life (km)": f"{table['distance_km'].iloc[-1]:.0f}"}
        for words, there in (
            ("right arc touches", table["right_share_pct"] >= TOUCHING), ("left force leaves 15 %", leaves),
        ):  # fmt: skip
            row[f"{words} (mm)"] = f"{1e3 * table.loc[there, 'ring_radius_m'].max():.2f}".replace("nan", "–")
        rows.append(row)
    return pd.DataFrame(rows).to_markdown(index=False, disable_numparse=True)
