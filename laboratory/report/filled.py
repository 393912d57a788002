"""Writes the measured parts of the pages on the laboratory from the results of its studies."""

import sys

from laboratory.report.plausible import answer_text
from replication.report.filled import write_pages
from trackdyn.errors import InputError

PLAUSIBLE = ("sentences", "claims", "draws", "values")
PAGES = (("docs/answer.md", tuple(f"plausible_{name}.csv" for name in PLAUSIBLE), answer_text),)

if __name__ == "__main__":
    try:
        write_pages(sys.argv[1:], PAGES)
    except InputError as error:
        sys.exit(f"trackdyn: {error}")
