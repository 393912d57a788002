"""Console output of commands: lines of a name and a text."""

import typer


def line(name: str, text: str) -> None:
    """Print a line with its name on the left."""
    typer.echo(f"{name:>22}  {text}")


def warn(text: str) -> None:
    """Print a warning on standard error."""
    typer.echo(f"trackdyn: warning: {text}", err=True)


def remarks(recording, *sentences: str) -> None:
    """Warn with ``sentences``, empty ones left out, and with those on the numbers of a run."""
    from trackdyn.measure.metrics import remarks

    for text in filter(None, (*sentences, *remarks(recording))):
        warn(text)


def rig_report(report) -> None:
    """Print the loop of a rig and its steps (`rig_check.RigReport`)."""
    from trackdyn.scene.scene import Scene
    from trackdyn.scene.step import round_step
    from trackdyn.simulation.rig_check import TRIAL_S
    from trackdyn.simulation.settling import tension_summary
    from trackdyn.simulation.step_check import RECOMMENDED

    rig, tried = report.rig, report.tried_steps_s
    chain = f"{rig.chain.kind.replace('_', '-')}, {rig.sprocket.teeth} teeth"
    line("loop", f"{rig.chain.pitches} pitches of {1e3 * rig.pitch:.4g} mm, {report.length_m:.4g} m; {chain}")
    radii = (f"{radius:.4f} m ({definition})" for definition, radius in rig.equal_pitch_radii.items())
    line("equal pitch", f"a ring of {', '.join(radii)}")
    for name, wrap in report.wrap_deg.items():
        line(f"wrap of {name}", f"{wrap:.4g} deg")
    travel = f"{1e3 * rig.tension.travel:.3g} mm, {rig.tension.kept}"
    laid = "" if report.layout else " before settling"
    line("tensioner", f"{rig.tension.wheel} shifted by {1e3 * report.tensioner_shift_m:.3g} mm of {travel}{laid}")
    ignored = f"; no effect: {', '.join(rig.without_effect)}" if rig.without_effect else ""
    line("laws", f"drag is {rig.drag}, bushing.law {rig.bushing.law}, tension.kept {rig.tension.kept}{ignored}")
    if report.layout:
        line("settled tension", tension_summary(Scene(rig, 0.0), report.layout))
    if report.step_s > 0:
        text = f"--step {report.step_s:.7g}: tried, half of it changes RMS and mean peak by {RECOMMENDED:.0%} at most"
    elif tried:
        text = f"half of every step tried changes RMS and mean peak by more than {RECOMMENDED:.0%} over {TRIAL_S:g} s: "
        text += f"the motion scatters, the smallest step was {min(tried):.3g} s"
    elif report.layout:
        text = "no step was tried: none ran a second of this speed within some seconds of computing"
    else:
        text = f"--step {round_step(report.largest_step_s, 1.0 / rig.rate):.7g}: not tried"
    line("step", f"{text}; at most {report.largest_step_s:.2g} s at {report.rpm:g} rev/min")


def decisions(scene) -> None:
    """Print the settings that a scene left open, each with its reason, and the step."""
    from trackdyn.scene.choices import ASKED

    for name, decision in scene.fidelity.items():
        if decision.reason != ASKED:
            line(name, f"{decision.setting}: {decision.reason}")
    line("step", f"{scene.time_step:.7g} s")


def tension(scene, recording, quiet: bool) -> None:
    """Print the tension of the loop and a step that follows it; warn if the rig's own ring has another tension."""
    from trackdyn.simulation.settling import tension_summary

    if not recording.layout.settled_tension_n > 0:
        return
    summary, step = tension_summary(scene, recording.layout), recording.meta["scene"]["step"]
    if ":" in summary and scene.ring_radius == scene.rig.ring_radius:
        warn(f"tension: {summary}")
    if not quiet:
        line("tension", summary)
        if step != scene.time_step:
            line("step", f"{step:.7g} s, which this tension needs")


def load(recording) -> None:
    """Print the load of a recording, and how fast the wheel turns that it brakes."""
    from trackdyn.rig.layout import wheel_names
    from trackdyn.simulation.brake import slip

    scene = recording.scene
    if scene.load:
        wheel = wheel_names(scene.rig)[scene.braked_wheel[0]]
        share = slip(scene, recording.wheel_rate)
        line("load", f"{scene.load:g} N by a brake on the {wheel}, which turns at {1 - share:.1%} of the chain's speed")


def measures(recording, rows: list[dict]) -> None:
    """Print the measures of a recording (`metrics.shown_measures`), and those that need a longer one."""
    from trackdyn.measure.columns import HALF_WIDTH, plain, with_error
    from trackdyn.measure.metrics import needed_lengths, unknown_step_errors

    for row in rows:
        number, sensor = plain(with_error(row["value"], row["half_width"])), row.get("sensor")
        line(f"{number} {row['unit']}", f"{row['measure']}{f' ({sensor})' if sensor else ''}")
    if any(row["half_width"] for row in rows):
        line("+-", HALF_WIDTH)
    if unknown := ", ".join(row["measure"] for row in rows if row["name"] in unknown_step_errors()):
        line("no +-", f"{unknown}: the error of the step is not known until the study `default_step` has run")
    for name, seconds in needed_lengths(recording).items():
        line("left out", f"{name} need a record of {seconds:.3g} s or more")


def plan(plan) -> None:
    """Print the chosen setting (`planner.Plan`), its expected cost, and the others that were tried."""
    for trial in plan.tried:
        message = f"rejected: {trial.refused}"
        if not trial.refused:
            errors = ", ".join(f"{name} {error.bias + error.bias_error:.2g}" for name, error in trial.error.items())
            message = f"error of {errors}; {trial.cpu_s / trial.seconds:.2g} CPU s per second"
        line("chosen" if trial is plan.chosen else "tried", f"{trial.name}: {message}")
    ends = ", ".join(f"{name} to {margin:.2g}" for name, margin in plan.chosen.margins(plan.tolerances).items())
    line("stops", f"when the 95 % intervals are within {ends}; expected after {plan.duration:.3g} s at speed")
    more = f"{plan.cpu_s:.2g} CPU s more" if plan.cpu_s else "no more: the record is long enough"
    line("expected cost", f"{plan.trial_cpu_s:.2g} CPU s so far, {more}")


def answer(answer) -> None:
    """Print the measures of a run that ends by their tolerances (`planner.StopResult`)."""
    from trackdyn.measure.catalogue import NAMED
    from trackdyn.measure.columns import HALF_WIDTH, plain, with_error

    for name, estimate in answer.measures.items():
        message, column = "converged" if answer.reached[name] else "tolerance not reached", NAMED[name].column
        unit = "% of a turn" if column.kind == "turns" else column.unit.removeprefix("1")
        line(name, f"{plain(with_error(estimate.value, estimate.half_width))} {unit}  {message}")
    line("+-", HALF_WIDTH)
    line("left out, recorded (s)", f"{answer.transient:.3g}, {len(answer.recording.time) / answer.recording.rate:.4g}")
