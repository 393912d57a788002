from pathlib import Path

from _script import logged

from trackdyn import load_rig
from trackdyn.parameters.validation import read_yaml, validated
from trackdyn.study.fit import FitConfig, measure_candidates
from trackdyn.study.settings import Known

with logged(snakemake):
    config = validated(FitConfig, read_yaml(snakemake.input.fit), snakemake.input.fit)
    rig, params = load_rig(snakemake.input.rig), snakemake.params
    table = measure_candidates(rig, config, params.radius, params.step, Known(**params.known))
    Path(snakemake.output[0]).write_text(table.to_csv(index=False, lineterminator="\n"), encoding="utf-8")
    print(table[["candidate", "passages", "failed"]].to_string(index=False))
