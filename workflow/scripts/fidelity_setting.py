from pathlib import Path

from _script import logged

from trackdyn import load_rig
from trackdyn.study.accuracy.ladder import measure_setting
from trackdyn.study.settings import Known

with logged(snakemake):
    params = snakemake.params
    rig, setting = load_rig(snakemake.input.rig), snakemake.wildcards.setting
    rows = measure_setting(rig, setting, params.speeds, params.radii, Known(**params.known))
    Path(snakemake.output[0]).write_text(rows.to_csv(index=False, lineterminator="\n"), encoding="utf-8")
