"""Commands about rigs: which ones ship, a new file, and what a file amounts to."""

import textwrap
from pathlib import Path
from typing import Annotated

import typer

from trackdyn.errors import InputError, TrackdynError
from trackdyn.parameters.validation import read_yaml, shown


def rigs() -> None:
    """List the rigs of the package."""
    from trackdyn.parameters.rig import load_rig
    from trackdyn.parameters.rig_file import DEFAULT, shipped_rigs

    for name, path in shipped_rigs().items():
        rig = load_rig(path)
        about = read_yaml(path).get("about", ABOUT.get(name, ""))
        what = (
            f"{rig.chain.pitches} pitches ({rig.chain.kind.replace('_', '-')}), {rig.sprocket.teeth} "
            f"teeth, {1 + len(rig.rollers)} wheels"
        )
        typer.echo(f"{name:>22}  {what}{', used where none is named' if name == DEFAULT else ''}\n{'':>22}  {about}")


# the paper's two rigs are the pipeline's files, which say in their own words what they are
ABOUT = {
    "paper": (
        "the rig of the paper: 35 links and connectors on a sprocket with a rubber ring, an idler and a road wheel"
    ),
    "printed_equal_pitch": "a second rig of the paper with the equal pitch as printed, docs/second-rig.md",
}


def new(
    out: Annotated[Path, typer.Argument(help="File to write (.yaml).")],
    like: Annotated[str, typer.Option(help="Shipped rig that it begins with (trackdyn rigs).")] = "bench",
) -> None:
    """Write a rig file to edit: the wheels and the tension of a shipped rig, and all else as comments."""
    from trackdyn.files import refuse_unwritable, write_text
    from trackdyn.parameters.rig import load_rig
    from trackdyn.parameters.rig_file import read_rig, rig_path, shipped_rigs

    if out.suffix not in (".yaml", ".yml"):
        raise InputError(f"OUT = {shown(str(out))} is not accepted: a name that ends in .yaml would do")
    if out.exists():
        raise InputError(f"{out} exists; another name would do")
    if like not in shipped_rigs():
        raise InputError(f"--like = {shown(like)} is not a shipped rig; {', '.join(shipped_rigs())} would do")
    refuse_unwritable(out)
    write_text(out, rig_text(like, load_rig(like), read_rig(rig_path(like))))
    typer.echo(f"{out}: edit it, then  trackdyn check {out}  and  trackdyn simulate run.npz --rig {out}")


def rig_text(like: str, rig, entries: dict) -> str:
    """A rig file that begins with all of a shipped rig: wheels and tension to edit, the rest as comments."""

    def short(entry: dict) -> str:
        value, unit = entry["value"], entry["unit"]
        if unit in ("name", "1"):
            return f"{value}"
        return f"{float(value)!r} {unit}"

    def flow(part: dict) -> str:
        items = ((key, item) for key, item in part.items() if item not in PLAIN)
        return (
            "{" + ", ".join(f"{key}: {flow(item) if 'value' not in item else short(item)}" for key, item in items) + "}"
        )

    def comments(name: str, part: dict) -> list[str]:
        rows = [f"# {name}:", "#   source: ..."]
        for key, item in part.items():
            source = textwrap.shorten(str(item["source"]).removeprefix(f"{item['kind']}: "), 90, placeholder=" ...")
            rows.append(f"#   {key}: {short(item)}  # {item['kind']}: {source}")
        return rows

    from trackdyn.parameters.rig_file import PLAIN_WHEEL

    PLAIN = [*PLAIN_WHEEL.values(), *({**entry, "value": 0.0} for entry in PLAIN_WHEEL.values())]
    wheels = {name: entries[name] if name in entries else entries["wheels"][name] for name in rig.rollers}
    rows = [
        'about: "a rig of my own"',
        f"like: {like} # everything that this file does not say",
        "# A value is written with its unit; the source of a section says where its values come "
        "from, kind what they are:",
        "# printed, derived, assumed (if nothing is said) or fitted. What is behind # is as in the "
        "rig above: take the sign",
        "# away, with the section's name and its source, to change it.",
        "wheels: # in any order and number; the chain runs clockwise around them, the sprocket at "
        "its own place: x = y = 0.",
        "  # A vehicle with such a track drives towards +x: with the other wheels at x < 0 the "
        "sprocket is in front, at x > 0 behind",
        '  source: "assumed"',
        *(f"  {name}: {flow(part)}" for name, part in wheels.items()),
        "  # a wheel may stand on a trailing arm or a slider with a spring, held where it stands "
        "once the loop is tensioned:",
        "  #   arm: {x: 0.3 m, y: 0.1 m, mass: 50.0 kg, stiffness: 2.0e4 N m/rad, damping: 500.0 N m "
        "s/rad, travel: 15.0 deg}",
        "  #   slider: {direction: 180.0 deg, mass: 50.0 kg, stiffness: 1.0e5 N/m, damping: 500.0 N "
        "s/m, travel: 0.05 m}",
        "tension: # the wheel that is shifted until the strand onto the sprocket has the "
        "pre-tension, along the direction from the x axis,",
        "  # counterclockwise. Then it is kept: locked (if nothing is said), retensioned, sprung (on "
        "mass, stiffness, damping), forced",
        '  source: "assumed"',
        *(
            f"  {key}: {short(item)}"
            for key, item in entries["tension"].items()
            if not isinstance(item["value"], (list, tuple))
        ),
        "# drive: a motor's line in place of a speed that is kept exactly, as the sprocket sees it",
        "# drive: {source: assumed, kind: motor, inertia: 5.0 kg m2, slope: 500.0 N m s/rad, torque: 2000.0 N m}",
        "",
    ]
    for name, part in entries.items():
        if name in ("wheels", "tension", "surfaces", *rig.rollers) or "value" in part:
            continue
        rows += [
            *comments(name, {key: item for key, item in part.items() if not isinstance(item["value"], (list, tuple))}),
            "",
        ]
    return "\n".join(rows)


def check(
    rig: Annotated[str, typer.Argument(help="Rig: a file, or the name of a shipped one.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Picture to write (.png, with an .svg beside it); by default named like the rig."),
    ] = None,
    rpm: Annotated[float, typer.Option(help="Motor speed for which steps are judged, rev/min.")] = 115.0,
    settle: Annotated[
        bool, typer.Option("--settle/--no-settle", help="Tension the loop and let it come to rest.")
    ] = True,
) -> None:
    """Lay a rig's loop, draw it, and say how the chain wraps, which step it allows and what is unusual."""
    from trackdyn.files import refuse_unwritable
    from trackdyn.parameters.rig import load_rig
    from trackdyn.report.figures.rig_layout import draw_rig
    from trackdyn.report.style import save
    from trackdyn.simulation.rig_check import checked

    loaded = load_rig(rig)
    out = out or Path(f"{Path(rig).stem}.png")
    if out.suffix != ".png":
        raise InputError(f"--out = {shown(str(out))} is not accepted: a name that ends in .png would do")
    refuse_unwritable(out)
    if settle:
        typer.echo("settling; kernels that are not compiled yet take a minute or two more", err=True)
    try:
        found = checked(loaded, rpm, settle)
    except TrackdynError as error:
        raise type(error)(f"{rig}: {error}") from None
    save(draw_rig(loaded, found.frame, found.wheels), out)
    for text in found.lines():
        typer.echo(text)
    typer.echo(f"{'picture':>22}  {out}")
