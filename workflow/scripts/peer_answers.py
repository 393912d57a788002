from _script import logged

from trackdyn import load_rig
from trackdyn.paper.contents import caption
from trackdyn.peers.answers import compare_answers, outcome
from trackdyn.report.tables import headed, write_table
from trackdyn.study.settings import PeerAnswers

with logged(snakemake):
    asked = PeerAnswers(**snakemake.params.asked)
    table = compare_answers(load_rig(snakemake.input.rig), asked)
    text = f"{caption('peer_answers')}\n\n{outcome(table, asked.tolerance)}"
    write_table(table, snakemake.output.csv, text, shown=headed(table, "peer_answers"))
