from trackdyn.sweeps.job import logged

from trackdyn import Scene, load_rig, simulate
from trackdyn.files import write_text
from trackdyn.sources import source_hash

with logged(snakemake):
    fields = {"duration": 0.01, "lead_in": 0.0, "ramp": 0.01, "integrator": snakemake.params.integrator}
    fields["step"] = 1e-5  # any step compiles the same kernels; one of the method may be refused for this rig
    if fields["integrator"] == "rk4":  # it has no tensioner on its spring
        fields["tension"] = "locked"
    simulate(Scene(load_rig(snakemake.params.rig), 115.0, **fields))
    write_text(snakemake.output[0], source_hash() + "\n")
