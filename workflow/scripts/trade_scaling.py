from pathlib import Path

from _script import logged

from trackdyn import load_rig
from trackdyn.study.accuracy.trade import scaling

# new processes import this file: only the first one runs the study
if __name__ == "__main__":
    with logged(snakemake):
        table = scaling(load_rig(snakemake.input.rig), snakemake.params.runs, snakemake.params.seconds)
        Path(snakemake.output[0]).write_text(table.to_csv(index=False, lineterminator="\n"), encoding="utf-8")
