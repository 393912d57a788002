from _script import logged

from trackdyn import load_rig
from trackdyn.files import write_csv
from trackdyn.report.figures.trade import scaling_figure
from trackdyn.report.style import save
from trackdyn.study.accuracy.scaling import scaling

# new processes import this file: only the first one runs the study
if __name__ == "__main__":
    with logged(snakemake):
        times = scaling(load_rig(snakemake.input.rig), snakemake.params.runs, snakemake.params.seconds)
        write_csv(snakemake.output.csv, times)
        save(scaling_figure(times), snakemake.output.figure[0])
