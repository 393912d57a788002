"""Write the measured parts of the pages on the laboratory from the results of its studies."""

from laboratory.report.plausible import answer_text
from trackdyn_replication.paper.finding import TABLE as GRIP
from trackdyn_replication.paper.tracks import FOLDER, RINGS
from trackdyn_replication.report.filled import main

PLAUSIBLE = ("sentences", "draws", "mobilised", "values", "near")
OF_THE_RIG = ("sentences.csv", "parameters.csv", "printed_numbers.csv")
TABLES = (
    GRIP, RINGS, *(f"{FOLDER}/plausible_{name}.csv" for name in PLAUSIBLE), *OF_THE_RIG,
    *(f"{FOLDER}/{name}.csv" for name in ("grips_numbers", "grips_sentences")),
)  # fmt: skip
PAGES = (("docs/answer.md", TABLES, answer_text),)

if __name__ == "__main__":
    main(PAGES, FOLDER)
