from trackdyn.sweeps.job import logged
from replication.paper.contents import caption
from replication.peers.comparison import compare, table2_outcome
from replication.report.figures.peer import displacement_figure, model_figure
from replication.report.tables import write_table
from trackdyn import load_rig
from trackdyn.files import write_csv
from trackdyn.plots.style import save

with logged(snakemake):
    rig = load_rig(snakemake.input.rig)
    result = compare(rig, **snakemake.params.options)
    write_csv(snakemake.output.curves, result.curves)
    write_csv(snakemake.output.summary, result.summary)
    outcome = table2_outcome(result, snakemake.params.options["accuracy_pct"])
    write_table(result.table, snakemake.output.table, f"{caption('table2')}\n\n{outcome}")
    save(model_figure(rig, result.frame, result.shift, result.missing), snakemake.output.model[0])
    save(displacement_figure(result.curves, result.summary, result.missing), snakemake.output.displacement[0])
    print(result.summary.to_string(index=False))
