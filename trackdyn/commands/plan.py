"""The command ``trackdyn plan``, and what ``trackdyn simulate --tolerance`` says before it runs."""

from typing import Annotated

import typer

from trackdyn.commands.options import (
    DEFAULT_RIG,
    MEASURE,
    Choose,
    LongestRun,
    RigName,
    RingRadius,
    SpeedOption,
    StepOption,
    Tolerance,
    chosen_fields,
    ring_fields,
)


def plan(
    tolerance: Tolerance,
    measure: Annotated[list[str] | None, MEASURE] = None,
    rig: RigName = DEFAULT_RIG,
    rpm: SpeedOption = 115.0,
    ring_radius: RingRadius = None,
    preset: Annotated[str | None, typer.Option("--preset", help="Keep the method and step of a preset.")] = None,
    step: StepOption = None,
    choose: Choose = None,
    longest: LongestRun = 60.0,
) -> None:
    """What `simulate --tolerance` will run: the cheapest method and step that keep it, found while it records."""
    from trackdyn.parameters.rig import load_rig
    from trackdyn.scene.scene import Scene

    fields = ring_fields(ring_radius) | ({} if step is None else {"step": step}) | chosen_fields(choose or [])
    scene = Scene(load_rig(rig), motor_rpm=rpm, preset=preset, **fields)
    say(planned(scene, dict.fromkeys(measure or ["rms"], tolerance), longest, preset, fields))


def planned(scene, tolerances: dict[str, float], longest: float, preset: str | None, fields: dict):
    """The plan for a scene; what its options state stays as it is."""
    from trackdyn.measure.planner import plan as choose_setting

    return choose_setting(scene, tolerances, longest, preset is None and not {"step", "integrator"} & fields.keys())


def say(plan) -> None:
    """What runs, what it is expected to cost, and what else was tried."""
    for one in plan.tried:
        mark = "chosen" if one is plan.chosen else "tried"
        message = f"rejected: {one.refused}"
        if not one.refused:
            errors = ", ".join(f"{name} {of.bias + of.doubt:.2g}" for name, of in one.error.items())
            message = f"error of {errors}; {one.cpu_s / one.seconds:.2g} CPU s a second"
        typer.echo(f"{mark:>22}  {one.setting.name}: {message}")
    ends = ", ".join(f"{name} to {tolerance:.2g}" for name, tolerance in plan.left.items())
    typer.echo(f"{'stops':>22}  when the 95 % intervals keep {ends}; expected after {plan.duration:.3g} s at speed")
    more = f"{plan.cpu_s:.2g} CPU s more" if plan.cpu_s else "no more: the record is long enough"
    typer.echo(f"{'expected cost':>22}  {plan.trial_cpu_s:.2g} CPU s so far, {more}")
