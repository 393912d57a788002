from _script import logged

from trackdyn import load_rig
from trackdyn.files import write_csv
from laboratory.inference.fit import FitConfig
from laboratory.inference.sensitivity import measure_candidates
from trackdyn.measure.stopping import StopRule
from trackdyn.parameters.validation import validated
from trackdyn.parameters.yaml_file import read_yaml

with logged(snakemake):
    config = validated(FitConfig, read_yaml(snakemake.input.fit), snakemake.input.fit)
    rig, params = load_rig(snakemake.input.rig), snakemake.params
    table = measure_candidates(rig, config, params.radius, params.step, StopRule(**params.known))
    write_csv(snakemake.output[0], table)
    print(table[["candidate", "passages", "failed"]].to_string(index=False))
