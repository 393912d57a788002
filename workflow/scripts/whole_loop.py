from _script import logged

from trackdyn import load_rig
from trackdyn.files import write_csv
from replication.study.settings import WholeLoopForm
from replication.study.whole_loop import compare_answers

with logged(snakemake):
    rig, params = load_rig(snakemake.input.rig), snakemake.params
    table = compare_answers(rig, WholeLoopForm(**params.form), params.steps)
    write_csv(snakemake.output[0], table)
    print(
        f"{table['within'].mean():.1%} within; seconds, short over long, median "
        f"{(table['short_s'] / table['long_s']).median():.3f}"
    )
