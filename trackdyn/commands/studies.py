"""Commands of many runs: ``trackdyn ring`` and ``sweep``."""

import re
import shlex
from math import isnan, nan
from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import options
from trackdyn.commands.own_files import noting
from trackdyn.inputs.errors import InputError, shown
from trackdyn.version import __version__

CAPTIONS = {  # of the pictures on the page
    "force": "Largest force of a tooth and of a link on the ring in a passage: with every ring, and without one",
    "fig24": "Contact durations of the arcs of a connector with the teeth, and of a link with the ring",
    "fig23_a": "Normal forces on a connector and a link, root mean square over the run",
    "sliding": "Friction work on the teeth and on the ring in a turn of the sprocket",
}
PICTURE_FILES = [f"{name}.{ending}" for name in (*CAPTIONS, "fig23_b") for ending in ("png", "svg")]


def _parse_wear(text: str | float) -> float:
    accepted = "must be a length from 0 on with its unit, such as 2mm"
    return options.parse_quantity("--wear", text, {"mm": 1e-3, "m": 1.0}, accepted)


_LOADS = "Loads on the chain, N or kN, such as 0,3kN; the rig's, usually none."
_RADII = "Radii, m: low:high:count or a,b,c; eleven of the rig by default."
_STEPS = "Time step, s; of several, such as 1e-4,5e-5, the first that runs is used."
_FORCE = "Allowed force of a tooth over that without a ring."
_WEAR = "Wear that the ring must allow, such as 2mm."
_STORE = "Folder of stored rows; the results' name with .rows by default."


def ring(
    rig: options.RigArgument,
    rpm: Annotated[str, typer.Option("--rpm", metavar="SPEEDS", help="Motor speeds, rev/min, such as 115,210.")],
    out: Annotated[Path, typer.Option("--out", metavar="FOLDER", help="Folder for the results.")] = Path("ring"),
    load: Annotated[str | None, typer.Option(metavar="FORCES", help=_LOADS)] = None,
    radii: Annotated[str | None, typer.Option(metavar="RADII", help=_RADII)] = None,
    step: Annotated[str | None, typer.Option(metavar="STEPS", help=_STEPS)] = None,
    tooth_force: Annotated[float, options.share("--tooth-force", "0.5 or 50%", _FORCE, whole=True)] = 0.5,
    wear: Annotated[float, options.parsed("--wear", _parse_wear, "LENGTH", _WEAR)] = 0.0,
    jobs: options.Jobs = None,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Recommend a ring for all speeds and loads.

    Every radius, and no ring, is run at every speed and load. The recommended ring is the smallest with which the
    largest force of a tooth is at most half of that without a ring. The gaps around it are refined. The same command
    resumes a study that was stopped. The folder has ring.html, ring.csv, the figures force, fig23_a, fig23_b, fig24 and
    sliding (.png, .svg), and the stored rows.

    Example: `trackdyn ring my_rig.yaml --rpm 115,210` tries eleven radii at two speeds and recommends one for both.
    """
    from trackdyn.measure.ring_rule import DurationRule, RingRule, advice, compared, held_for
    from trackdyn.rig.rig import foreign_groove, load_rig
    from trackdyn.rig.rig_file import rig_path
    from trackdyn.scene.rings import study_radii
    from trackdyn.sweeps.engine import DONE
    from trackdyn.sweeps.ring import other_grips, ring_study

    loaded = load_rig(rig)
    judge, durations = RingRule(tooth_force, wear), DurationRule(loaded.sprocket.teeth)
    speeds, steps = _numbers(rpm, "--rpm"), [] if step is None else _numbers(step, "--step")
    rings = study_radii(loaded) if radii is None else sorted(set(_numbers(radii, "--radii")))
    loads = [loaded.load] if load is None else sorted({options.parse_load(text) for text in load.split(",")})
    # the default radii follow the rig when it is edited
    inputs = rig_path(rig), (sorted(set(speeds)),), (rings, *(["default"] if radii is None else [])), (steps,)
    inputs += () if load is None else ((loads,),)
    outputs = [out / name for name in ("ring.csv", "ring.html", *PICTURE_FILES)]
    for path in outputs:
        options.check_output(path, overwrite, *inputs)
    study = ring_study(loaded, speeds, rings, jobs, out / "rows", not quiet, steps, judge, loads)
    lost = study[study["state"] != DONE]
    if len(lost) == len(study):
        raise InputError(f"no scene completed; the reason of the first one: {lost['reason'].iloc[0]}")
    _check_meshing(study)
    notes = [*filter(None, [foreign_groove(loaded, rig)]), *_notes(study, loaded, lost)]
    chosen, grips = judge.radius(study), None
    if chosen == chosen:
        grips = other_grips(loaded, study, chosen, jobs, out / "rows", not quiet, steps)
    sentences, validity = advice(study, judge, durations, grips), held_for(study, judge, loaded)
    rows = _comparison_rows(compared(study, judge, durations))
    about = {"title": Path(rig).stem, "validity": validity, "advice": sentences, "notes": notes, "compared": rows}
    with noting(inputs, *outputs):
        _write_study(out, study, loaded, judge, rig_name=rig, **about)
    if not quiet:
        lines = validity, *(f"note: {note}" for note in notes), *sentences, f"look at {out / 'ring.html'}"
        typer.echo("\n".join(lines))


def _write_study(out: Path, study, rig, rule, rig_name: str, **content) -> None:
    """Write the table of a study, its pictures and its page."""
    from trackdyn.inputs.files import write_csv
    from trackdyn.measure.ring_rule import windows
    from trackdyn.plots.ring_study import CHOSEN, figures, force_figure, sliding_figure, write_page
    from trackdyn.plots.style import save

    write_csv(out / "ring.csv", study, float_format="%.9g")
    marks = {f"equal pitch, {name}": radius for name, radius in rig.equal_pitch_radii.items()}
    if (chosen := rule.radius(study)) == chosen:
        marks[CHOSEN] = chosen
    force = force_figure(study, rule.tooth_force, chosen, windows(rule.kept(study)))
    drawn = {"force": force, **figures(study, marks), "sliding": sliding_figure(study, marks)}
    for name, figure in drawn.items():
        save(figure, out / f"{name}.png")
    run = ""
    if chosen == chosen:
        file, page = shlex.quote(str(out / "run.npz")), shlex.quote(str(out / "run.html"))
        scene_options = f"--rig {shlex.quote(str(rig_name))} --rpm {study['rpm'].min():g} --ring-radius {chosen:.5g}"
        scene_options += f" --load {study['load_n'].max():g}" if study["load_n"].max() != rig.load else ""
        run = f"trackdyn simulate {file} {scene_options} && trackdyn show {file} --out {page}"
    radii = ", ".join(f"{radius:.5g} m ({name})" for name, radius in rig.equal_pitch_radii.items())
    origin = f"Rig {rig_name}; trackdyn {__version__}; radius of equal pitch by each reading: {radii}."
    pictures = {out / f"{name}.svg": caption for name, caption in CAPTIONS.items()}
    write_page(out / "ring.html", pictures, csv="ring.csv", rule=str(rule), origin=origin, run=run, **content)


def _check_meshing(study) -> None:
    """Refuse (`InputError`) speeds at which no connector touches a tooth without a ring."""
    from trackdyn.sweeps.engine import DONE

    bare = study["ring_radius_m"].isna() & (study["state"] == DONE)
    if len(idle := study.loc[bare & ~(study["tooth_peak_n"] > 0), "rpm"]):
        reason = "without a ring no connector touches a tooth at this speed, the chain does not mesh; leave it out"
        raise InputError(f"--rpm = {idle.iloc[0]:g}: {reason}")


def _numbers(text: str, option: str) -> list[float]:
    """Parse the numbers of ``a,b,c``, or of ``low:high:count``, both ends included."""
    import numpy as np

    accepted = f"must be finite numbers, such as {'115,210' if option == '--rpm' else '0.303,0.308 or 0.303:0.313:11'}"
    numbers = [options.parse_number(option, number, accepted) for number in re.split("[,:]", text)]
    if ":" not in text:
        return numbers
    if text.count(":") != 2 or "," in text or not (numbers[0] < numbers[1] and numbers[2] in range(2, 1001)):
        raise InputError(f"{option} = {shown(text)}: must be low:high:count with 2 to 1000 numbers")
    return np.linspace(*numbers[:2], int(numbers[2])).tolist()


def _notes(study, rig, lost) -> list[str]:
    """Return sentences on runs without a result, or with an uncertain one."""
    from trackdyn.scene.scene import StopRule

    rule, notes = StopRule(), []
    if len(lost):
        first = lost.iloc[0]
        ring = "no ring" if isnan(radius := first["ring_radius_m"]) else f"{radius:.5g} m"
        runs = f"{len(lost)} of {len(study)} runs have no result, the first at {first['rpm']:g} rpm, {ring}"
        runs += f", a load of {first['load_n']:g} N" if first["load_n"] else ""
        notes.append(f"{runs}: {first['reason']}")
    if short := int((~study["contacts_converged"].fillna(True).astype(bool)).sum()):
        limits = f"{rule.share_pct:g} points of a turn and forces to {100 * rule.force:g} %"
        notes.append(f"{short} runs ended before contact durations converged to {limits}")
    if rough := int((study["resolved"] == "no").sum()):
        finer = f"use a smaller one, such as --step {study['step_s'].min() / 2:.3g}"
        notes.append(f"the step does not resolve the contacts of {rough} runs; {finer}")
    if rig.ring_radius is None:
        notes.append("this rig has no ring: a ring with the stiffness and friction of ring_contact is assumed")
    return notes


def _comparison_rows(rings) -> list[dict]:
    """Return rows of the page on the rings of the advice: forces, work, tension, power and contact durations."""
    from trackdyn.measure.columns import significant
    from trackdyn.measure.ring_rule import WORK_COLUMNS
    from trackdyn.model.arrays import SIDES

    forces = ("tooth_ratio", "tooth_peak_n", "tooth_rms_n", "ring_peak_n", "ring_rms_n")
    columns = (*forces, *WORK_COLUMNS, "tension_ratio", "motor_power_w", *(f"{side}_share_pct" for side in SIDES))
    of_load = ("load_n",) if rings["load_n"].any() else ()
    return [
        {"rpm": f"{row['rpm']:g}"}
        | {name: f"{row[name]:g}" for name in of_load}
        | {"ring": row["ring"], "ring_radius_m": significant(row["ring_radius_m"], 5)}
        | {name: significant(row.get(name, nan)) for name in columns}
        for row in rings.to_dict("records")
    ]


def sweep(
    design: Annotated[Path, typer.Argument(metavar="DESIGN", help="Design: a row per scene (.csv).")],
    out: Annotated[Path, options.file_option("--out", "Results to write: a row per scene", ".csv")],
    rig: options.RigName = options.DEFAULT_RIG,
    jobs: options.Jobs = None,
    store: Annotated[Path | None, typer.Option(metavar="FOLDER", help=_STORE)] = None,
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
) -> None:
    """Run a design of many scenes.

    An interrupted sweep is resumed by the same command.

    Example: `trackdyn sweep design.csv --out results.csv` runs each row of a table; columns are fields of a scene.
    """
    from trackdyn.rig.rig_file import rig_path
    from trackdyn.sweeps.engine import DONE, FAILED
    from trackdyn.sweeps.sweep import states_summary
    from trackdyn.sweeps.sweep import sweep as run

    inputs = design, rig_path(rig)
    options.check_output(out, overwrite, *inputs)
    with noting(inputs, out):
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
    if failed := [number for number, state in enumerate(results["state"], 1) if state == FAILED]:
        first = results.iloc[failed[0] - 1]
        named = f"row {failed[0]}" + (f" ({first['name']})" if "name" in results else "")
        failures = f"{len(failed)} rows failed for reasons that may pass, the first of them {named}: {first['reason']}"
        raise InputError(f"{out}: {failures}; the same command tries them again")
