from trackdyn.sweeps.job import logged

from pathlib import Path

from replication.paper.contents import missing_items
from replication.report.page.builder import PageInputs, write_page

with logged(snakemake):
    params = snakemake.params
    inputs = PageInputs(
        results=Path(params.results),
        rig=Path(snakemake.input.rig),
        sensors=dict(zip(params.runs, map(Path, snakemake.input.sensors), strict=True)),
        synthetic=params.synthetic,
        studies=tuple(params.studies),
        layers=tuple(params.layers),
        files=tuple(map(Path, [*snakemake.input.config, snakemake.input.settings, *snakemake.input.article])),
    )
    write_page(inputs, snakemake.output[0])
    for item in missing_items(params.results):
        print(f"missing: {item.label}, {item.title} (rule {item.rule})")
