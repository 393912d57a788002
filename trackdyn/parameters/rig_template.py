"""A rig file to edit, written after a shipped rig."""

import textwrap

from trackdyn.errors import InputError, shown
from trackdyn.parameters.rig import load_rig
from trackdyn.parameters.rig_file import PLAIN_WHEEL, read_rig, rig_path, shipped_rigs

HEAD = """\
about: "a rig of my own"
like: {like} # everything that this file does not say
# A value is written with its unit; the source of a section says where its values come from, kind what they are:
# printed, derived, assumed (if nothing is said) or fitted. What is behind # is as in the rig above: take the sign
# away, with the section's name and its source, to change it.
wheels: # in any order and number; the chain runs clockwise around them, the sprocket at its own place: x = y = 0.
  # A vehicle with such a track drives towards +x: with the other wheels at x < 0 the sprocket is in front, else behind
  source: "assumed"
{wheels}
  # a wheel may stand on a trailing arm or a slider with a spring, held where it stands once the loop is tensioned:
  #   arm: {{x: 0.3 m, y: 0.1 m, mass: 50.0 kg, stiffness: 2.0e4 N m/rad, damping: 500.0 N m s/rad, travel: 15.0 deg}}
  #   slider: {{direction: 180.0 deg, mass: 50.0 kg, stiffness: 1.0e5 N/m, damping: 500.0 N s/m, travel: 0.05 m}}
tension: # the wheel that is shifted until the strand onto the sprocket has the pre-tension, along the direction from
  # the x axis, counterclockwise. Then it is kept: locked (if nothing is said), retensioned, sprung (on mass, stiffness,
  # damping), forced
  source: "assumed"
{tension}
# drive: a motor's line instead of a speed that is kept exactly, as the sprocket sees it
# drive: {{source: assumed, kind: motor, inertia: 5.0 kg m2, slope: 500.0 N m s/rad, torque: 2000.0 N m}}
"""


def rig_text(like: str) -> str:
    """A rig file that begins with all of a shipped rig (else `InputError`); most of it stands in comments."""
    if like not in shipped_rigs():
        raise InputError(f"--like = {shown(like)} is not a shipped rig; choose {', '.join(shipped_rigs())}")
    rig, entries = load_rig(like), read_rig(rig_path(like))
    plain = [*PLAIN_WHEEL.values(), *({**entry, "value": 0.0} for entry in PLAIN_WHEEL.values())]
    ignored = rig.without_effect

    def short(entry: dict) -> str:
        value, unit = entry["value"], entry["unit"]
        if unit in ("name", "1"):
            return f"{value}"
        return f"{float(value)!r} {unit}"

    def flow(section: dict, wheel: str = "") -> str:
        unread = [name.partition(".")[2] for name in ignored if wheel and name.startswith(f"{wheel}.")]
        items = ((key, item) for key, item in section.items() if item not in plain and key not in unread)
        return (
            "{" + ", ".join(f"{key}: {flow(item) if 'value' not in item else short(item)}" for key, item in items) + "}"
        )

    def comments(name: str, section: dict) -> list[str]:
        rows = [f"# {name}:", "#   source: ..."]
        for key, item in section.items():
            source = textwrap.shorten(str(item["source"]).removeprefix(f"{item['kind']}: "), 90, placeholder=" ...")
            rows.append(f"#   {key}: {short(item)}  # {item['kind']}: {source}")
        return rows

    wheels = {name: entries[name] if name in entries else entries["wheels"][name] for name in rig.rollers}
    tension = [
        f"  {key}: {short(item)}"
        for key, item in entries["tension"].items()
        if not isinstance(item["value"], (list, tuple)) and f"tension.{key}" not in ignored
    ]
    named = "\n".join(f"  {name}: {flow(section, name)}" for name, section in wheels.items())
    rows = [HEAD.format(like=like, wheels=named, tension="\n".join(tension))]
    for name, section in entries.items():
        if name in ("wheels", "tension", "surfaces", *rig.rollers) or "value" in section:
            continue
        plain_values = {key: item for key, item in section.items() if not isinstance(item["value"], (list, tuple))}
        rows += [*comments(name, plain_values), ""]
    return "\n".join(rows)
