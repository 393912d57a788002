"""The ``trackdyn`` command."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from trackdyn.errors import InputError, TrackdynError

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Simulate a double-pin track drive and compare it with a sensor.",
)


def _ring(text: str) -> float | None:
    if text == "none":
        return None
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--ring-radius = {text!r} is not accepted: a radius in m or the word none would do") from None


@app.command()
def simulate(
    out: Annotated[Path, typer.Argument(help="Recording to write (.npz).")],
    rig: Annotated[Path, typer.Option(help="Parameters of the rig.")] = Path("config/rig.yaml"),
    rpm: Annotated[float, typer.Option(help="Motor speed, rev/min.")] = 115.0,
    ring_radius: Annotated[str, typer.Option(help="Radius of the rubber ring in m, or none.")] = "0.308",
    duration: Annotated[float, typer.Option(help="Recorded time, s.")] = 20.0,
    lead_in: Annotated[float, typer.Option(help="Time at constant speed before the record, s.")] = 5.0,
    step: Annotated[float, typer.Option(help="Time step, s.")] = 1e-4,
    frame_interval: Annotated[float, typer.Option(help="Time between recorded configurations, s; 0: none.")] = 0.05,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar and no summary.")] = False,
) -> None:
    """Run one scene and write its recording."""
    from trackdyn.measure.metrics import run_metrics
    from trackdyn.parameters.rig import load_rig
    from trackdyn.scene import Scene
    from trackdyn.simulate import simulate as run

    if out.suffix != ".npz":
        raise InputError(f"OUT = {out} is not accepted: a name that ends in .npz would do")
    scene = Scene(
        load_rig(rig),
        motor_rpm=rpm,
        ring_radius=_ring(ring_radius),
        duration=duration,
        lead_in=lead_in,
        step=step,
        frame_interval=frame_interval,
    )
    recording = run(scene, progress=not quiet)
    recording.save(out)
    if not quiet:
        for name, value in run_metrics(out.stem, recording).items():
            typer.echo(f"{name:>22}  {value:.6g}" if isinstance(value, float) else f"{name:>22}  {value}")


@app.command()
def compare(
    recording: Annotated[Path, typer.Argument(help="Recording made by `trackdyn simulate` (.npz).")],
    sensor: Annotated[Path, typer.Argument(help="Sensor CSV with the columns t_s, ax_g, ay_g, az_g.")],
) -> None:
    """Compare the simulated y acceleration with a sensor's: RMS, SD and main line."""
    from trackdyn.measure.compare import compare_with_sensor
    from trackdyn.measure.sensor_csv import read_sensor_csv
    from trackdyn.recording import load_recording

    loaded = load_recording(recording)
    rig = loaded.meta["rig"]["sensor"]
    table = compare_with_sensor(loaded, read_sensor_csv(sensor, rate_hz=rig["rate"], range_g=rig["range"]))
    typer.echo(table.to_string(index=False, float_format=lambda v: f"{v:.4f}"))


def main() -> None:
    """Entry point: a user's mistake ends in one sentence and exit code 1."""
    try:
        app()
    except TrackdynError as error:
        print(f"trackdyn: {error}", file=sys.stderr)
        sys.exit(1)
    except OSError as error:
        print(f"trackdyn: {error.filename}: {error.strerror}; give a path that can be written", file=sys.stderr)
        sys.exit(1)
