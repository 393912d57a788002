from _script import logged

from trackdyn import load_rig
from trackdyn.parameters.validation import read_yaml, validated
from trackdyn.replacing import write_csv
from trackdyn.steady import Known
from trackdyn.study.fit import FitConfig, measure_candidates

with logged(snakemake):
    config = validated(FitConfig, read_yaml(snakemake.input.fit), snakemake.input.fit)
    rig, params = load_rig(snakemake.input.rig), snakemake.params
    table = measure_candidates(rig, config, params.radius, params.step, Known(**params.known))
    write_csv(snakemake.output[0], table)
    print(table[["candidate", "passages", "failed"]].to_string(index=False))
