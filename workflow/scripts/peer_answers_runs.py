from trackdyn.sweeps.job import logged

from replication.peers.answers import compare_answers
from replication.study.settings import PeerAnswers
from trackdyn import load_rig
from trackdyn.files import write_csv

with logged(snakemake):
    write_csv(
        snakemake.output[0], compare_answers(load_rig(snakemake.input.rig), PeerAnswers(**snakemake.params.requested))
    )
