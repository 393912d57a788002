from trackdyn.sweeps.job import logged

from replication.study.accuracy.ladder import measure_setting
from trackdyn import load_rig
from trackdyn.files import write_csv
from trackdyn.scene.stop_rule import StopRule

with logged(snakemake):
    params = snakemake.params
    rig, setting = load_rig(snakemake.input.rig), snakemake.wildcards.setting
    rows = measure_setting(rig, setting, params.speeds, params.radii, StopRule(**params.known))
    write_csv(snakemake.output[0], rows)
