import json

from _script import logged

from trackdyn.replacing import write_text
from trackdyn.study.accuracy.planner import load_trade, plan

with logged(snakemake):
    trade, asked = load_trade(snakemake.input.data), snakemake.params.asked
    fields = {}
    for rpm in snakemake.params.speeds:
        chosen = plan(trade, asked["tolerance"], asked["measure"], rpm, snakemake.params.radius)
        print(f"{rpm:g} rpm: {chosen}")
        fields[f"{rpm:g}rpm"] = chosen.fields
        fields[f"coarse/{rpm:g}rpm"] = chosen.fields | {"tooth_contact": "three_surfaces"}
    write_text(snakemake.output[0], json.dumps(fields, indent=1) + "\n")
