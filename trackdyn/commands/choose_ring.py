"""The command ``trackdyn choose-ring``."""

from pathlib import Path
from typing import Annotated

import typer


def choose_ring(
    study: Annotated[Path, typer.Argument(help="Study of an ensemble: study.csv (.csv, .parquet).")],
    criterion: Annotated[str, typer.Option(help="rule, teeth, sliding or force.")] = "teeth",
    rpm: Annotated[
        float | None, typer.Option(help="Motor speed, rev/min; the slowest of the study by default.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Table to write: a row a radius (.csv, .parquet).")] = None,
    figure: Annotated[Path | None, typer.Option(help="Figure to write (.png, and .svg beside it).")] = None,
) -> None:
    """The ring's radius to choose where the rig is not known: chance that it is the best one over an ensemble
    of rigs.
    """
    import pandas as pd

    from trackdyn.errors import InputError
    from trackdyn.files import refuse_unwritable
    from trackdyn.inference.ensemble.ring_choice import CRITERIA, STUDY_COLUMNS, choice_table, recommendation
    from trackdyn.parameters.validation import shown
    from trackdyn.sweeps.table import read_table, refuse_ending, write_table

    if criterion not in CRITERIA:
        raise InputError(f"--criterion = {shown(criterion)} is not accepted: {', '.join(CRITERIA)} would do")
    if figure is not None and figure.suffix != ".png":
        raise InputError(f"--figure = {shown(str(figure))} is not accepted: a name that ends in .png would do")
    if out is not None:
        refuse_ending(out, "--out")
    for path in filter(None, (out, figure)):
        refuse_unwritable(path)
    rows = read_table(study)
    for name in STUDY_COLUMNS:
        if name not in rows.columns:
            raise InputError(f"{study}: has no column {name}; a table study.csv of an ensemble would do")
        numbers = pd.to_numeric(rows[name].replace("", None), errors="coerce")
        if (wrong := rows[name].notna() & (rows[name] != "") & numbers.isna()).any():
            raise InputError(
                f"{study}: {name} = {shown(rows.loc[wrong, name].iloc[0])} is not accepted: a number would do"
            )
        rows[name] = numbers
    speed = float(rows["rpm"].min()) if rpm is None else rpm
    table = choice_table(rows, speed)
    if out is not None:
        write_table(table, out)
    if figure is not None:
        from trackdyn.report.figures.ensemble import choice_figure
        from trackdyn.report.style import save

        save(choice_figure(table, speed), figure)
    for row in table.itertuples():
        typer.echo(
            f"{row.ring_radius_m:.4f} m  right arc free in {row.p_right_free:4.0%}  best in "
            f"{getattr(row, f'p_best_{criterion}'):4.0%}  "
            f"left share {row.left_share_pct:5.1f} %  sliding on teeth {row.sliding_teeth_j_km / 1e3:6.1f} kJ/km"
        )
    typer.echo(f"{speed:g} rpm: {recommendation(table, criterion)}")
