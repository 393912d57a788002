from trackdyn.sweeps.job import logged
from replication.paper.contents import caption
from replication.peers.answers import compare_answers, outcome
from replication.report.tables import headed, write_table
from replication.study.settings import PeerAnswers
from trackdyn import load_rig

with logged(snakemake):
    asked = PeerAnswers(**snakemake.params.asked)
    table = compare_answers(load_rig(snakemake.input.rig), asked)
    text = f"{caption('peer_answers')}\n\n{outcome(table, asked.tolerance)}"
    write_table(table, snakemake.output.csv, text, shown=headed(table, "peer_answers"))
