from trackdyn.sweeps.job import logged

import json

from replication.peers.comparison import compare_codes
from trackdyn import load_rig
from trackdyn.files import write_csv, write_text

with logged(snakemake):
    out = snakemake.output
    result = compare_codes(load_rig(snakemake.input.rig), **snakemake.params.options)
    for path, table in ((out.curves, result.curves), (out.summary, result.summary), (out.costs, result.costs)):
        write_csv(path, table)
    model = {"frame": result.frame.tolist(), "shift": result.shift, "missing": result.missing}
    write_text(out.model, json.dumps(model))
    print(result.summary.to_string(index=False))
