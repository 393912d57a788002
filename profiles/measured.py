"""Memory and time of every rule for the SLURM profile, from what a run took: `python profiles/measured.py results`.

Rules that take all the cores of a machine get as many as most nodes have.
"""

import re
import sys
from itertools import zip_longest
from math import ceil
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).parents[1]
PROFILE = ROOT / "profiles" / "slurm" / "config.yaml"
MARK = "# What follows is measured: python profiles/measured.py results\n"
# A job's own two Snakemakes take as much as the least rule, each; nodes and libraries differ by less than a third.
SNAKEMAKES, ROOM = 2, 1.3
# A node of a cluster may be several times slower than the one that measured, and a file system may stall.
SLOWER, STALLS = 5, 5  # times, min
NODE = 4  # cores of a rule that takes all there are
RULE = re.compile(r"^\s*(?:rule (\w+):|use rule (\w+) as (\w+) with:)", re.MULTILINE)
LOG = re.compile(r'^\s+log: f"\{R\}/logs/(.+)\.log"', re.MULTILINE)
THREADS = re.compile(r"^\s+threads: (\d+)", re.MULTILINE)


def blocks(folder: Path = ROOT / "workflow" / "rules") -> dict[str, str]:
    """Rule and its text, behind which stands that of the rule that it takes after."""
    found: dict[str, str] = {}
    for path in sorted(folder.glob("*.smk")):
        text = path.read_text(encoding="utf-8")
        rules = [*RULE.finditer(text)]
        for rule, after in zip_longest(rules, rules[1:]):
            own = text[rule.end() : after.start() if after else len(text)]
            found[rule[1] or rule[3]] = own + (found[rule[2]] if rule[2] else "")
    return found


def patterns() -> dict[str, str]:
    """Rule and a regular expression of its benchmark files."""
    found = {rule: LOG.search(text) for rule, text in blocks().items()}
    names = {rule: match[1].replace("{{short}}", "(short/)?") for rule, match in found.items() if match}
    return {rule: re.sub(r"\{\{\w+\}\}", ".+", name) + ".tsv" for rule, name in names.items()}


def greedy() -> list[str]:
    """Rules that ask for more cores than a node has."""
    found = {rule: THREADS.search(text) for rule, text in blocks().items()}
    return sorted(rule for rule, match in found.items() if match and int(match[1]) > NODE)


def measured(results: Path) -> dict[str, tuple[float, float]]:
    """Largest memory (MB) and time (s) of every rule that left them in a run's ``benchmarks``."""
    files = {str(file.relative_to(results / "benchmarks")): file for file in (results / "benchmarks").rglob("*.tsv")}
    found = {}
    for rule, pattern in patterns().items():
        if mine := [file for name, file in files.items() if re.fullmatch(pattern, name)]:
            rows = pd.concat(pd.read_csv(file, sep="\t") for file in mine)
            found[rule] = float(rows.max_rss.max()), float(rows.s.max())
    return found


def asked(found: dict[str, tuple[float, float]]) -> str:
    """The profile's sections."""
    least = min(memory for memory, _ in found.values())
    lines = ["set-threads:", *(f"  {rule}: {NODE}" for rule in greedy()), "set-resources:"]
    for rule, (memory, seconds) in sorted(found.items()):
        mem_mb = ceil(ROOM * (memory + SNAKEMAKES * least) / 100) * 100
        runtime = STALLS + ceil(SLOWER * seconds / 60)
        lines += [f"  {rule}:", f"    mem_mb: {mem_mb} * attempt", f"    runtime: {runtime} * attempt"]
    return "\n".join(lines) + "\n"


def main(results: Path) -> None:
    """Rewrite the profile's last sections."""
    if not (found := measured(results)):
        sys.exit(f"{results}: holds no benchmarks; the folder of a whole run would do")
    head, _, _ = PROFILE.read_text(encoding="utf-8").partition(MARK)
    PROFILE.write_text(head + MARK + asked(found), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python profiles/measured.py FOLDER, that of a run's results")
    main(Path(sys.argv[1]))
