"""The command ``trackdyn benchmark``."""

from pathlib import Path
from typing import Annotated

import typer


def score(
    answers: Annotated[Path, typer.Argument(help="CSV of the time series: docs/benchmark.md has its columns.")],
    problem: Annotated[str, typer.Option(help="free_chain, ring or teeth.")],
    contacts: Annotated[Path | None, typer.Option(help="CSV of the contacts on the teeth: arc, begin_s ...")] = None,
) -> None:
    """Error of an answer, quantity by quantity, beside the error bar of the reference."""
    from laboratory.benchmark.problems import read_problem
    from laboratory.benchmark.score import HEADLINE, read_answer, read_contacts
    from laboratory.benchmark.score import score as score_answer

    read_problem(problem)
    found = read_answer(answers, problem)
    table = read_contacts(contacts, problem) if contacts is not None else None
    rows = score_answer(found, table, problem)
    typer.echo(f"{'quantity':<24}{'kind':<11}{'answer':>13}{'reference':>13}{'error':>10}{'bar':>10}")
    for row in rows:
        value = "" if row.kind == "series" else f"{row.value:.6g}"
        reference = f"{row.reference:.6g}" if row.kind == "statistic" else ""
        bar = "" if row.kind == "invariant" else f"{row.bar:.1e}"
        within = "  within the bar" if row.error <= row.bar else ""
        typer.echo(f"{row.quantity:<24}{row.kind:<11}{value:>13}{reference:>13}{row.error:>10.2e}{bar:>10}{within}")
    errors = {row.quantity: row.error for row in rows}
    head = ", ".join(f"{errors[name]:.2e} in {name}" for name in HEADLINE[problem] if name in errors)
    typer.echo(f"\n{problem}: error {head}")


def problem(
    name: Annotated[str, typer.Argument(help="free_chain, ring or teeth.")],
    out: Annotated[Path, typer.Option(help="Folder to write its files to.")] = Path("."),
) -> None:
    """Write statement, initial state and reference of a problem into a folder."""
    from laboratory.benchmark.problems import FOLDER, read_problem
    from trackdyn.files import write_text

    read_problem(name)
    for path in sorted(FOLDER.glob(f"{name}[._]*")):
        write_text(out / path.name, path.read_text(encoding="utf-8"))
        typer.echo(str(out / path.name))


BENCHMARK = (score, problem)
