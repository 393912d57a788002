"""The command ``trackdyn choose-ring``."""

from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands.options import file_option, number
from trackdyn.errors import InputError, shown


def choose_ring(
    study: Annotated[Path, typer.Argument(help="Study of an ensemble: study.csv (.csv, .parquet).")],
    criterion: Annotated[str, typer.Option(help="rule, teeth, sliding or force.")] = "teeth",
    rpm: Annotated[float | None, number("--rpm", "Motor speed, rev/min; the slowest of the study by default.")] = None,
    out: Annotated[Path | None, file_option("--out", "Table to write: a row a radius", ".csv", ".parquet")] = None,
    figure: Annotated[Path | None, file_option("--figure", "Figure to write, with an .svg beside it", ".png")] = None,
) -> None:
    """The ring's radius to choose where the rig is not known: chance that it is the best one over an ensemble
    of rigs.
    """
    from laboratory.inference.ensemble.ring_choice import CRITERIA, choice_table, read_study, recommendation
    from trackdyn.files import refuse_unwritable
    from trackdyn.sweeps.table import write_table

    if criterion not in CRITERIA:
        raise InputError(f"--criterion = {shown(criterion)}: choose {', '.join(CRITERIA)}")
    for path in filter(None, (out, figure)):
        refuse_unwritable(path)
    rows = read_study(study)
    speed = float(rows["rpm"].min()) if rpm is None else rpm
    table = choice_table(rows, speed)
    if out is not None:
        write_table(table, out)
    if figure is not None:
        from laboratory.report.figures.ensemble import choice_figure
        from trackdyn.plots.style import save

        save(choice_figure(table, speed), figure)
    for row in table.itertuples():
        typer.echo(
            f"{row.ring_radius_m:.4f} m  right arc free in {row.p_right_free:4.0%}  best in "
            f"{getattr(row, f'p_best_{criterion}'):4.0%}  "
            f"left share {row.left_share_pct:5.1f} %  sliding on teeth {row.sliding_teeth_j_km / 1e3:6.1f} kJ/km"
        )
    typer.echo(f"{speed:g} rpm: {recommendation(table, criterion)}")
