"""The command of the replication: ``trackdyn verify``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.errors import InputError


def verify(
    results: Annotated[Path, typer.Argument(help="Results of a run, such as results.")],
    against: Annotated[
        Path | None, typer.Option(help="Manifest, or folder, of another run; the manifest in RESULTS by default.")
    ] = None,
    exact: Annotated[bool, typer.Option("--exact", help="Byte for byte, as runs on one kind of machine are.")] = False,
) -> None:
    """Compare the results and inputs of a run with a manifest: which file differs, and by how much.

    Example: `trackdyn verify results --against other/results` compares two runs of the pipeline, file by file.
    """
    from replication.certify.comparison import EQUAL, compare_files, compare_inputs, failed, findings_summary
    from replication.certify.manifest import NAME, describe, load_manifest

    reference = results / NAME if against is None else against
    if reference.is_dir():
        findings = compare_files(results, describe(reference))
    else:
        manifest = load_manifest(reference)
        findings = compare_inputs(results, manifest.inputs) + compare_files(results, manifest.files)
    for finding in findings:
        if finding.status != EQUAL:
            typer.echo(f"{finding.status:>8}  {finding.name}  {finding.text}".rstrip())
    typer.echo(findings_summary(findings))
    if bad := failed(findings, exact):
        raise InputError(f"{results}: {len(bad)} of {len(findings)} files are not those of {reference}")
