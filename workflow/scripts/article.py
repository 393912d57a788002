from trackdyn.sweeps.job import logged

import json
from pathlib import Path

import pandas as pd

from replication.report.article import article_values, write_article

with logged(snakemake):
    given = snakemake.input
    tables = {name: pd.read_csv(path) for name, path in given.items() if str(path).endswith(".csv")}
    missing = json.loads(Path(given.model).read_text(encoding="utf-8"))["missing"]
    values = article_values(tables, missing, snakemake.params.accuracy_pct)
    pdf = Path(snakemake.output.pdf)
    write_article(values, Path(snakemake.output.values), Path(given.template), pdf.parent, pdf)
