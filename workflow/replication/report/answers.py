"""The table of the cost of an equal answer in every code."""

from trackdyn.sweeps.snakemake_job import run_job

import numpy as np
import pandas as pd

from replication.paper.contents import caption
from replication.peers import OURS, PEER
from replication.report.tables import headed, write_captioned_table


def answers_outcome(table: pd.DataFrame, tolerance: float) -> str:
    """What came out, in a sentence below the caption."""
    chosen = table[table["chosen"] == "yes"].set_index("code")["cpu_s"]
    parts = [f"{code} takes {seconds:.3g} s of CPU time" for code, seconds in chosen.items()]
    missing = [code for code in table["code"].unique() if code not in chosen]
    parts += [f"{code} does not reach it with these settings or was not run" for code in missing]
    text = f"At an error of at most {100 * tolerance:g} %: {'; '.join(parts)}."
    if {"rms_m_s2", "difference_pct"} <= set(table):
        limits = (table["rms_m_s2"] / (1 + table["difference_pct"] / 100)).groupby(table["code"]).mean()
        if np.isfinite(limits.get(PEER, np.nan)):
            share = 100 * (limits[PEER] / limits[OURS] - 1)
            text += f" The RMS of {PEER} in the limit is {share:+.2g} % from ours."
    return text


def main(job) -> None:
    """Rule `peer_answers`."""
    table = pd.read_csv(job.input.runs)
    text = f"{caption('peer_answers')}\n\n{answers_outcome(table, job.params.tolerance)}"
    write_captioned_table(table, job.output.csv, text, shown=headed(table, "peer_answers"))


if __name__ == "__main__":
    run_job(main)
