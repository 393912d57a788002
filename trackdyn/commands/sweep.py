"""The commands ``trackdyn sweep`` and ``trackdyn design``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import options
from trackdyn.errors import InputError, shown


def sweep(
    design: Annotated[Path, typer.Argument(help="Design: a row a scene (.csv, .parquet).")],
    out: Annotated[Path, options.file_option("--out", "Results to write: a row a result", ".csv", ".parquet")],
    rig: options.RigName = options.DEFAULT_RIG,
    jobs: options.Jobs = None,
    store: Annotated[
        Path | None,
        typer.Option(help="Folder in which rows are kept as they come; the results' name with .rows by default."),
    ] = None,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Run a design of many scenes; what a killed run had computed is not computed again.

    Results that a sweep has written are replaced where the store still holds their rows; any other file needs
    --overwrite.
    """
    from trackdyn.sweeps.store import DONE, FAILED
    from trackdyn.sweeps.sweep import refuse_foreign, states_summary
    from trackdyn.sweeps.sweep import sweep as run

    if not overwrite:
        refuse_foreign(out, store)
    results = run(design, out, rig, jobs, store, progress=not quiet)
    rest = results.loc[results["state"] != DONE, "reason"]
    if not quiet:
        typer.echo(f"{states_summary(results)}; written to {out}")
        for reason, count in rest.value_counts().head(5).items():
            typer.echo(f"{count:>7}  {reason}")
    elif 0 < len(rest) < len(results):
        typer.echo(f"trackdyn: warning: {out}: {states_summary(results)}; the first reason: {rest.iloc[0]}", err=True)
    if len(rest) == len(results):
        raise InputError(f"{out}: no row completed; the reason of the first one: {rest.iloc[0]}")
    if failed := int((results["state"] == FAILED).sum()):
        raise InputError(
            f"{out}: {failed} rows failed for reasons that may pass and stand there; the same command tries them again"
        )


def design(
    out: Annotated[Path, options.file_argument("Design to write", ".csv", ".parquet")],
    vary: Annotated[
        list[str],
        typer.Option(
            help="Column and what it takes: name=low:high, name=low:high:count for a grid, name=a,b,c. Repeatable."
        ),
    ],
    method: Annotated[str, typer.Option(help="grid, sobol or latin.")] = "sobol",
    rows: Annotated[int | None, typer.Option(help="Rows of a Sobol or Latin design.")] = None,
    seed: Annotated[int, typer.Option(help="The same seed gives the same design.")] = 0,
    fix: Annotated[
        list[str] | None, typer.Option("--set", help="Column with one value, such as duration=20. Repeatable.")
    ] = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Make a design: a grid, a Sobol sequence or a Latin hypercube over columns of a sweep."""
    from trackdyn.sweeps.design import make_design, parse_levels
    from trackdyn.sweeps.request import refuse_columns
    from trackdyn.sweeps.table import write_table

    varied, fixed = {}, {}
    for pair in vary:
        name, takes = parse_levels(pair)
        if name in varied:
            raise InputError(f"--vary {name} is given twice; keep one of them")
        varied[name] = takes
    for pair in fix or []:
        name, _, value = pair.partition("=")
        if not name or not value or name in fixed:
            raise InputError(f"--set = {shown(pair)}: expected name=value, each name once")
        fixed[name] = value
    table = make_design(varied, method, rows, seed, fixed)
    refuse_columns(table, "design")
    options.check_output(out, overwrite)
    write_table(table, out)
