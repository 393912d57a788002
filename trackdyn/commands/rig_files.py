"""Commands of rigs: ``trackdyn check``, ``trackdyn new`` and ``trackdyn rigs``."""

import textwrap
from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import console, options
from trackdyn.commands.own_files import noting
from trackdyn.inputs.errors import InputError, TrackdynError, shown

_PICTURE = "Picture to write, by default a .png named like the rig"
_SETTLE = "Tension the loop and let it come to rest."


def rigs() -> None:
    """List the rigs of the package.

    Example: `trackdyn rigs` prints the name of each, its pitches, teeth and wheels, and a description.
    """
    from trackdyn.inputs.yaml_file import read_yaml
    from trackdyn.rig.rig_file import DEFAULT, read_rig, shipped_rigs

    for name, path in shipped_rigs().items():
        rig = read_rig(name)  # not `load_rig`: a list needs no numerical library
        chain, teeth = rig["chain"], rig["sprocket"]["teeth"]["value"]
        kind = chain["kind"]["value"].replace("_", "-") if "kind" in chain else "double-pin"
        counts = f"{chain['pitches']['value']} pitches ({kind}), {teeth} teeth, {1 + len(rig['wheels'])} wheels"
        used = ", the default" if name == DEFAULT else ""
        typer.echo(f"{name:>22}  {counts}{used}\n{'':>22}  {read_yaml(path)['about']}")


def new(
    out: Annotated[Path, options.file_argument("File to write", ".yaml", ".yml")],
    like: Annotated[str, typer.Option(metavar="RIG", help="Included rig to start from (trackdyn rigs).")] = "bench",
    overwrite: options.Overwrite = False,
) -> None:
    """Write a rig file to edit.

    It has the wheels and the tension of an included rig, and all other parameters as comments.

    Example: `trackdyn new my_rig.yaml --like bench` starts a track of your own from the wheels of a bench.
    """
    from trackdyn.inputs.files import write_text

    text = rig_text(like)
    options.check_output(out, overwrite)
    with noting([], out):
        write_text(out, text)
    typer.echo(f"{out}: edit it, then  trackdyn check {out}  and  trackdyn simulate run.npz --rig {out}")


def check(
    rig: options.RigArgument,
    out: Annotated[Path | None, options.file_option("--out", _PICTURE, ".png", ".svg")] = None,
    rpm: options.SpeedOption = 115.0,
    settle: Annotated[bool, typer.Option("--settle/--no-settle", help=_SETTLE)] = True,
    overwrite: options.Overwrite = False,
) -> None:
    """Draw the loop of a rig, and list unusual values.

    Wrap angles of the wheels and the step that the rig allows are printed, too.

    Example: `trackdyn check my_rig.yaml --rpm 150` lays the track of that file, lets it settle, and writes my_rig.png.
    """
    from trackdyn.plots.drawing import draw_rig
    from trackdyn.plots.style import SCREEN_DPI, save
    from trackdyn.rig.rig import foreign_groove, load_rig, outside_ranges
    from trackdyn.rig.rig_file import rig_path
    from trackdyn.simulation.rig_check import check as report_of

    loaded = load_rig(rig)
    out = out or Path(f"{Path(rig).stem}.png")
    options.check_output(out, overwrite, rig_path(rig))
    if settle:
        typer.echo("settling; kernels that are not compiled yet take about 10 s more", err=True)
    try:
        checks = report_of(loaded, rpm, settle)
    except TrackdynError as error:
        raise type(error)(f"{rig}: {error}") from None
    unusual = [*outside_ranges(rig), *filter(None, [foreign_groove(loaded, rig)]), *checks.unusual]
    figure = draw_rig(loaded, checks.frame, checks.wheels)
    with noting([rig_path(rig)], out):
        save(figure, out, out.suffix.removeprefix("."), dpi=SCREEN_DPI)
    console.rig_report(checks)
    for text in unusual or ["nothing"]:
        console.line("unusual", options.as_options(text))
    console.line("picture", str(out))


def rig_text(like: str) -> str:
    """Return the text of a rig file that begins with an included rig (else `InputError`), mostly as comments."""
    from trackdyn.rig.rig import load_rig
    from trackdyn.rig.rig_file import GROUPS, SHIPPED, read_rig, shipped_rigs

    if like not in shipped_rigs():
        raise InputError(f"--like = {shown(like)} is not an included rig; choose {', '.join(shipped_rigs())}")
    ignored, entries = load_rig(like).without_effect, read_rig(like)

    def short(entry: dict) -> str:
        return str(entry["value"]) if entry["unit"] in ("name", "1") else f"{float(entry['value'])!r} {entry['unit']}"

    def read(section: dict, name: str) -> dict:
        """Return the entries of a section that are no table and have an effect."""
        plain = {key: item for key, item in section.items() if not isinstance(item.get("value"), (list, tuple))}
        return {key: item for key, item in plain.items() if f"{name}.{key}" not in ignored}

    def flow(section: dict) -> str:
        items = (f"{key}: {short(item) if 'value' in item else flow(item)}" for key, item in section.items())
        return "{" + ", ".join(items) + "}"

    def comment(key: str, item: dict) -> str:
        source = str(item["source"]).removeprefix(f"{item['kind']}: ").partition("; range")[0]
        source = textwrap.shorten(source, 70, placeholder=" ...")
        limits = f"; range {item['low']:g} to {item['high']:g}" if item.keys() >= {"low", "high"} else ""
        return f"#   {key}: {short(item)}  # {item['kind']}: {source}{limits}"

    wheels = [f"  {name}: {flow(read(section, name))}" for name, section in entries["wheels"].items()]
    tension = [f"  {key}: {short(item)}" for key, item in read(entries["tension"], "tension").items()]
    head = (SHIPPED / "template.txt").read_text(encoding="utf-8")
    rows = [head.format(like=like, wheels="\n".join(wheels), tension="\n".join(tension))]
    for name, section in (entries | entries["sensors"]).items():
        if name not in ("tension", "surfaces", *GROUPS) and "value" not in section:
            rows += [f"# {name}:", "#   source: ...", *(comment(*pair) for pair in read(section, "").items()), ""]
    return "\n".join(rows)
