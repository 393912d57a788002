import json
from pathlib import Path

from _script import logged

from trackdyn.study.accuracy.planner import load_trade, plan

with logged(snakemake):
    trade, asked = load_trade(snakemake.input.data), snakemake.params.asked
    fields = {}
    for rpm in snakemake.params.speeds:
        chosen = plan(trade, asked["tolerance"], asked["measure"], rpm, snakemake.params.radius)
        print(f"{rpm:g} rpm: {chosen}")
        fields[f"{rpm:g}rpm"] = chosen.fields
        fields[f"coarse/{rpm:g}rpm"] = chosen.fields | {"tooth_contact": "three_surfaces"}
    Path(snakemake.output[0]).write_text(json.dumps(fields, indent=1) + "\n", encoding="utf-8")
