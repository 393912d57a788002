import json

from trackdyn.sweeps.job import logged
from replication.study.accuracy.planner import load_trade, plan
from trackdyn import load_rig
from trackdyn.files import write_text

with logged(snakemake):
    trade, rig, asked = load_trade(snakemake.input.data), load_rig(snakemake.input.rig), snakemake.params.asked
    fields = {}
    for rpm in snakemake.params.speeds:
        chosen = plan(trade, asked["tolerance"], asked["measure"], rpm, snakemake.params.radius)
        print(f"{rpm:g} rpm: {chosen}")
        # never shorter than what figures and spectra are made of
        longer = {"duration": max(snakemake.params.least_s, chosen.one_link(rig, rpm))}
        fields[f"{rpm:g}rpm"] = chosen.fields | longer
        fields[f"coarse/{rpm:g}rpm"] = chosen.fields | longer | {"tooth_contact": "three_surfaces"}
    write_text(snakemake.output[0], json.dumps(fields, indent=1) + "\n")
