from _script import logged

from trackdyn import load_rig
from trackdyn.files import write_csv
from laboratory.report.figures.traction import traction_figure
from trackdyn.plots.style import save
from laboratory.studies.traction import traction_scan

with logged(snakemake):
    rig, form = load_rig(snakemake.input.rig), snakemake.params.form
    table = traction_scan(rig, form["slopes_s_per_m"], form["radii_m"], form["speed_rpm"])
    write_csv(snakemake.output.csv, table)
    own, wheels = (part.friction_static / part.transition_velocity for part in (rig.ring_contact, rig.wheel_contact))
    save(traction_figure(table, own, wheels), snakemake.output.figure[0])
