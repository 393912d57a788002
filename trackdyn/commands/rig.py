"""The commands about rigs: ``trackdyn check``, ``trackdyn new`` and ``trackdyn rigs``."""

import hashlib
import textwrap
from pathlib import Path
from typing import Annotated

import typer

from trackdyn.commands import options
from trackdyn.errors import InputError, TrackdynError, shown


def rigs() -> None:
    """List the rigs of the package.

    Example: `trackdyn rigs` prints the name of each, its pitches, teeth and wheels, and what it is.
    """
    from trackdyn.rig.rig_file import DEFAULT, read_rig, shipped_rigs
    from trackdyn.rig.yaml_file import read_yaml

    for name, path in shipped_rigs().items():
        rig = read_rig(name)  # not `load_rig`: a list needs no library that computes
        chain, teeth = rig["chain"], rig["sprocket"]["teeth"]["value"]
        kind = chain["kind"]["value"].replace("_", "-") if "kind" in chain else "double-pin"
        counts = f"{chain['pitches']['value']} pitches ({kind}), {teeth} teeth, {1 + len(rig['wheels'])} wheels"
        used = ", used where none is named" if name == DEFAULT else ""
        typer.echo(f"{name:>22}  {counts}{used}\n{'':>22}  {read_yaml(path)['about']}")


def new(
    out: Annotated[Path, options.file_argument("File to write", ".yaml", ".yml")],
    like: Annotated[
        str,
        typer.Option(
            metavar="RIG", autocompletion=options.included, help="Included rig that it begins with (trackdyn rigs)."
        ),
    ] = "bench",
    overwrite: options.Overwrite = False,
) -> None:
    """Write a rig file to edit: the wheels and the tension of an included rig, and all else as comments.

    Example: `trackdyn new my_rig.yaml --like bench` begins a track of your own with the wheels of a test bench.
    """
    from trackdyn.files import write_text

    text = rig_text(like)
    options.check_output(out, overwrite)
    write_text(out, text)
    typer.echo(f"{out}: edit it, then  trackdyn check {out}  and  trackdyn simulate run.npz --rig {out}")


def check(
    rig: options.RigArgument,
    out: Annotated[
        Path | None,
        options.file_option("--out", "Picture to write, by default a .png named like the rig", ".png", ".svg"),
    ] = None,
    rpm: options.SpeedOption = 115.0,
    settle: Annotated[
        bool, typer.Option("--settle/--no-settle", help="Tension the loop and let it come to rest.")
    ] = True,
    overwrite: options.Overwrite = False,
) -> None:
    """Lay a rig's loop, draw it, and say how the chain wraps, which step it allows and what is unusual.

    Example: `trackdyn check my_rig.yaml --rpm 150` lays the track of that file, lets it settle, and writes my_rig.png.
    """
    from trackdyn.plots.drawing import draw_rig
    from trackdyn.plots.style import SCREEN_DPI, marked, save
    from trackdyn.rig.rig import foreign_groove, load_rig, outside_ranges
    from trackdyn.simulation.rig_check import check_rig

    loaded = load_rig(rig)
    out = out or Path(f"{Path(rig).stem}.png")
    mark = f"trackdyn check {hashlib.sha256(str(rig).encode(errors='surrogateescape')).hexdigest()}"
    options.check_output(out, overwrite or marked(out, mark), rig)  # this rig's picture of before an edit is replaced
    if settle:
        typer.echo("settling; kernels that are not compiled yet take a minute or two more", err=True)
    try:
        checks = check_rig(loaded, rpm, settle)
    except TrackdynError as error:
        raise type(error)(f"{rig}: {error}") from None
    unusual = [*outside_ranges(rig), *filter(None, [foreign_groove(rig, loaded)]), *checks.unusual]
    figure = draw_rig(loaded, checks.frame, checks.wheels)
    save(figure, out, out.suffix.removeprefix("."), mark=mark, dpi=SCREEN_DPI)
    remarks = [("unusual", text) for text in unusual or ["nothing"]]
    for name, text in (*checks.values.items(), *remarks, ("picture", out)):
        typer.echo(f"{name:>22}  {text}")


def rig_text(like: str) -> str:
    """A rig file that begins with all of a shipped rig (else `InputError`); most of it stands in comments."""
    from trackdyn.rig.quantities import outside_range
    from trackdyn.rig.rig import load_rig
    from trackdyn.rig.rig_file import GROUPS, SHIPPED, read_rig, rig_path, shipped_rigs

    if like not in shipped_rigs():
        raise InputError(f"--like = {shown(like)} is not a shipped rig; choose {', '.join(shipped_rigs())}")
    rig, entries = load_rig(like), read_rig(rig_path(like))
    ignored = rig.without_effect

    def short(entry: dict) -> str:
        value, unit = entry["value"], entry["unit"]
        if unit in ("name", "1"):
            return f"{value}"
        return f"{float(value)!r} {unit}"

    def flow(section: dict, wheel: str = "") -> str:
        unread = [name.partition(".")[2] for name in ignored if wheel and name.startswith(f"{wheel}.")]
        items = ((key, item) for key, item in section.items() if key not in unread)
        return (
            "{" + ", ".join(f"{key}: {flow(item) if 'value' not in item else short(item)}" for key, item in items) + "}"
        )

    def comments(name: str, section: dict) -> list[str]:
        rows = [f"# {name}:", "#   source: ..."]
        for key, item in section.items():
            source = textwrap.shorten(str(item["source"]).removeprefix(f"{item['kind']}: "), 90, placeholder=" ...")
            side = outside_range(item)
            outside = f"; {side} its range, {item['low']:g} to {item['high']:g}" if side else ""
            rows.append(f"#   {key}: {short(item)}  # {item['kind']}: {source}{outside}")
        return rows

    tension = [
        f"  {key}: {short(item)}"
        for key, item in entries["tension"].items()
        if not isinstance(item["value"], (list, tuple)) and f"tension.{key}" not in ignored
    ]
    named = "\n".join(f"  {name}: {flow(section, name)}" for name, section in entries["wheels"].items())
    head = (SHIPPED / "template.txt").read_text(encoding="utf-8")
    rows = [head.format(like=like, wheels=named, tension="\n".join(tension))]
    for name, section in (entries | entries["sensors"]).items():
        if name in ("tension", "surfaces", *GROUPS) or "value" in section:
            continue
        plain_values = {key: item for key, item in section.items() if not isinstance(item["value"], (list, tuple))}
        rows += [*comments(name, plain_values), ""]
    return "\n".join(rows)
