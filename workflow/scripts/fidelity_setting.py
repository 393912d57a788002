from _script import logged

from trackdyn import load_rig
from trackdyn.files import write_csv
from trackdyn.measure.stopping import StopRule
from replication.study.accuracy.ladder import measure_setting

with logged(snakemake):
    params = snakemake.params
    rig, setting = load_rig(snakemake.input.rig), snakemake.wildcards.setting
    rows = measure_setting(rig, setting, params.speeds, params.radii, StopRule(**params.known))
    write_csv(snakemake.output[0], rows)
