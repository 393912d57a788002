"""The picture of the rules in docs/running.md is of the present default run."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
DRAW = "from snakemake.cli import main; main(['--rulegraph', 'dot', '--nolock'])"


def test_the_picture_has_the_rules_of_the_default_run():
    graph = subprocess.run(
        [sys.executable, "-c", DRAW], cwd=ROOT, capture_output=True, text=True, check=True, timeout=300
    ).stdout
    rules = re.findall(r'label = "(\w+)"', graph)
    picture = (ROOT / "docs/pictures/rules.svg").read_text(encoding="utf-8")
    assert len(rules) > 20 and sorted(re.findall(r"<text [^>]*>(\w+)</text>", picture)) == sorted(rules)
