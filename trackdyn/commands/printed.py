"""Lines that commands print of runs: a name and what is said of it."""

import typer


def line(name: str, text: str) -> None:
    """Print a line with its name at the left."""
    typer.echo(f"{name:>22}  {text}")


def warn(text: str) -> None:
    """Print a warning on standard error."""
    typer.echo(f"trackdyn: warning: {text}", err=True)


def remarks(recording, *sentences: str) -> None:
    """Warn with some sentences, empty ones left out, and with those that belong to the numbers of a run."""
    from trackdyn.measure.metrics import remarks

    for text in filter(None, (*sentences, *remarks(recording))):
        warn(text)


def decisions(scene) -> None:
    """Print the settings that a scene left open, each with its reason, then those that it states, on one line."""
    from trackdyn.scene.choices import ASKED

    for name, decision in scene.fidelity.items():
        if decision.reason != ASKED:
            line(name, f"{decision.setting}: {decision.reason}")
    requested = [f"{name} {choice.setting}" for name, choice in scene.fidelity.items() if choice.reason == ASKED]
    if requested:
        line(ASKED, ", ".join(requested))
    line("step", f"{scene.time_step:.7g} s")


def needs(scene, needed) -> None:
    """Print what a run of a scene needs (`recorder.Cost`), and what is run twice to judge the step."""
    from trackdyn.simulation.step_check import BRIEF, again

    line("needs", f"{needed}, more if kernels must be compiled")
    seconds, why = again(scene)
    if seconds:
        finer = "with half the step" if why == BRIEF else "with an explicit step"
        line("run again", f"{seconds:.3g} s {finer}, to judge it: {why}")


def tension(scene, recording, quiet: bool) -> None:
    """Print the tension of the loop and a step that follows it; warn where the scene's own ring misses it."""
    from trackdyn.simulation.settling import tension_words

    if not recording.layout.settled_tension_n > 0:
        return
    words, step = tension_words(scene, recording.layout), recording.meta["scene"]["step"]
    if ":" in words and scene.ring_radius == scene.rig.ring_radius:
        warn(f"tension: {words}")
    if not quiet:
        line("tension", words)
        if step != scene.time_step:
            line("step", f"{step:.7g} s, which this tension needs")


def measures(recording, rows: list[dict]) -> None:
    """Print the measures of a recording (`metrics.shown_measures`), and which it is too short for."""
    from trackdyn.measure.cells import plain, with_error
    from trackdyn.measure.metrics import needed_lengths

    for row in rows:
        number, sensor = plain(with_error(row["value"], row["error"])), row.get("sensor")
        line(f"{number} {row['unit']}", f"{row['measure']}{f' ({sensor})' if sensor else ''}")
    for name, seconds in needed_lengths(recording).items():
        line("left out", f"{name} need a record of {seconds:.3g} s or more")


def plan(plan) -> None:
    """Print the setting that runs (`planner.Plan`), its expected cost, and the others that were tried."""
    for trial in plan.tried:
        message = f"rejected: {trial.refused}"
        if not trial.refused:
            errors = ", ".join(f"{name} {error.bias + error.doubt:.2g}" for name, error in trial.error.items())
            message = f"error of {errors}; {trial.cpu_s / trial.seconds:.2g} CPU s per second"
        line("chosen" if trial is plan.chosen else "tried", f"{trial.name}: {message}")
    ends = ", ".join(f"{name} to {tolerance:.2g}" for name, tolerance in plan.left.items())
    line("stops", f"when the 95 % intervals keep {ends}; expected after {plan.duration:.3g} s at speed")
    more = f"{plan.cpu_s:.2g} CPU s more" if plan.cpu_s else "no more: the record is long enough"
    line("expected cost", f"{plan.trial_cpu_s:.2g} CPU s so far, {more}")


def answer(answer) -> None:
    """Print the measures of a run that ends by their tolerances (`planner.StopResult`)."""
    from trackdyn.measure.catalogue import NAMED
    from trackdyn.measure.cells import plain, with_error

    for name, estimate in answer.measures.items():
        message = "converged" if answer.reached[name] else "tolerance not reached"
        line(name, f"{plain(with_error(estimate.value, estimate.half_width))} {NAMED[name].said_unit}  {message}")
    recorded = len(answer.recording.time) / answer.recording.rate
    line("left out, recorded (s)", f"{answer.transient:.3g}, {recorded:.4g}")
