"""Write memory and time of every rule into the SLURM profile, from the benchmarks of a run: `python profiles/measured.py results`."""

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
RULE = re.compile(r"^\s*(?:rule (\w+):|use rule \w+ as (\w+) with:)", re.MULTILINE)
BENCHMARK = re.compile(r'^\s+benchmark: f"\{R\}/benchmarks/(.+)"', re.MULTILINE)


def patterns() -> dict[str, str]:
    """Rule and a regular expression of its benchmark files."""
    found = {}
    for path in sorted((ROOT / "workflow" / "rules").glob("*.smk")):
        text = path.read_text(encoding="utf-8")
        rules = [*RULE.finditer(text)]
        for rule, after in zip_longest(rules, rules[1:]):
            if match := BENCHMARK.search(text[rule.end() : after.start() if after else len(text)]):
                found[rule[1] or rule[2]] = re.sub(r"\{\{\w+\}\}", ".+", match[1])
    return found


def measured(results: Path) -> dict[str, tuple[float, float]]:
    """Largest memory (MB) and time (s) of every rule that has benchmarks."""
    files = {str(file.relative_to(results / "benchmarks")): file for file in (results / "benchmarks").rglob("*.tsv")}
    found = {}
    for rule, pattern in patterns().items():
        if mine := [file for name, file in files.items() if re.fullmatch(pattern, name)]:
            rows = pd.concat(pd.read_csv(file, sep="\t", na_values="-") for file in mine)
            found[rule] = float(rows.max_rss.max()), float(rows.s.max())
    return found


def asked(found: dict[str, tuple[float, float]]) -> str:
    """The profile's section."""
    least = min(memory for memory, _ in found.values())
    lines = ["set-resources:"]
    for rule, (memory, seconds) in sorted(found.items()):
        mem_mb = ceil(ROOM * (memory + SNAKEMAKES * least) / 100) * 100
        runtime = STALLS + ceil(SLOWER * seconds / 60)
        lines += [f"  {rule}:", f"    mem_mb: {mem_mb} * attempt", f"    runtime: {runtime} * attempt"]
    return "\n".join(lines) + "\n"


def main(results: Path) -> None:
    """Rewrite the profile's last section."""
    if not (found := measured(results)):
        sys.exit(f"{results}: holds no benchmarks; the folder of a whole run would do")
    head, _, _ = PROFILE.read_text(encoding="utf-8").partition(MARK)
    PROFILE.write_text(head + MARK + asked(found), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python profiles/measured.py FOLDER, that of a run's results")
    main(Path(sys.argv[1]))
