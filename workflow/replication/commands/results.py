"""The commands of the replication: ``trackdyn verify`` and ``trackdyn article``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands.options import Overwrite, check_output, file_argument
from trackdyn.errors import InputError


def verify(
    results: Annotated[Path, typer.Argument(help="Results of a run, such as results.")],
    against: Annotated[
        Path | None, typer.Option(help="Manifest, or folder, of another run; the manifest in RESULTS by default.")
    ] = None,
    exact: Annotated[bool, typer.Option("--exact", help="Byte for byte, as runs on one kind of machine are.")] = False,
) -> None:
    """Compare the results and inputs of a run with a manifest: which figure or table differs, and by how much."""
    from replication.certify.comparison import EQUAL, compare_inputs, compare_manifests, failed, findings_summary
    from replication.certify.manifest import NAME, describe, load_manifest

    reference = results / NAME if against is None else against
    expected = describe(reference, complete=True) if reference.is_dir() else load_manifest(reference)
    findings = compare_inputs(expected, results)
    findings += compare_manifests(describe(results, complete=reference.is_dir()), expected)
    for finding in findings:
        if finding.status != EQUAL:
            typer.echo(
                f"{finding.status:>8}  {finding.name}  {finding.shows and f'({finding.shows}) '}{finding.text}".rstrip()
            )
    typer.echo(findings_summary(findings))
    if bad := failed(findings, exact):
        raise InputError(f"{results}: {len(bad)} of {len(findings)} files are not those of {reference}")


def article(
    out: Annotated[Path, file_argument("Rig file to write", ".yaml", ".yml")],
    tables: Annotated[Path, typer.Option(help="Cells of the article.")] = Path("config/rigs/paper/tables.yaml"),
    rig: Annotated[str, typer.Option(help="Rig that they complete, a file or a name.")] = "config/rigs/paper.yaml",
    overwrite: Overwrite = False,
) -> None:
    """Write a rig with what a reader of the article has filled in (docs/running.md)."""
    from replication.paper.printed_rig import write_printed_rig

    check_output(out, overwrite, rig)
    for sentence in write_printed_rig(out, tables, rig):
        typer.echo(f"{tables}: {sentence}", err=True)
    typer.echo(f"{out}: name it as rig in config/config.yaml, and run snakemake -j2")
