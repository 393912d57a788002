"""The command that the replication adds to ``trackdyn``: ``verify``."""

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from trackdyn.inputs.errors import InputError


def verify(
    results: Annotated[Path, typer.Argument(metavar="RESULTS", help="Results of a run, such as results.")],
    against: Annotated[
        Path | None,
        typer.Option(metavar="PATH", help="Manifest, or folder, of another run; the manifest in RESULTS by default."),
    ] = None,
    exact: Annotated[bool, typer.Option("--exact", help="Compare bytes, for runs on one kind of machine.")] = False,
) -> None:
    """Compare the results and inputs of a run with a manifest.

    It names the files that differ, and by how much.

    Example: `trackdyn verify results --against other/results` compares two runs of the pipeline, file by file.
    """
    from trackdyn_replication import certify

    reference = results / certify.NAME if against is None else against
    if reference.is_dir():
        findings = certify.compare_files(results, certify.describe(reference))
    else:
        manifest = certify.load_manifest(reference)
        findings = certify.compare_inputs(results, manifest.inputs)
        findings += certify.compare_files(results, manifest.files)
        others = {finding.name: finding for finding in certify.compare_runs(results, manifest.runs)}
        findings = [others.get(finding.name, finding) for finding in findings]
    for finding in findings:
        if finding.status != certify.EQUAL:
            typer.echo(f"{finding.status:>8}  {finding.name}  {finding.text}".rstrip())
    counts = Counter(finding.status for finding in findings)
    typer.echo(", ".join(f"{counts[status]} {words}" for status, words in certify.WORDS.items() if counts[status]))
    if bad := sum(counts[status] for status in (certify.WRONG_EXACTLY if exact else certify.WRONG)):
        raise InputError(f"{results}: {bad} of {len(findings)} files are not those of {reference}")


COMMANDS = (verify,)
