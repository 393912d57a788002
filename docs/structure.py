"""Draws the structure of the three packages from their imports into CONTRIBUTING.md: `python docs/structure.py`."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
PLACES = ("trackdyn", "workflow/replication", "laboratory")
PACKAGES = {Path(place).name: ROOT / place for place in PLACES}
# what a room may import without an arrow: it stands beneath all
GROUND = {"trackdyn." + name for name in ("errors", "extras", "files", "jit", "sources", "version")}
BEGIN, END = "<!-- structure -->", "<!-- end of structure -->"


def room_of(module: str) -> str | None:
    """Package and room of a module, such as ``trackdyn.scene``; None for what is not ours or ground."""
    package, _, rest = module.partition(".")
    if package not in PACKAGES or not rest:
        return None
    name = f"{package}.{rest.partition('.')[0]}"
    return None if name in GROUND else name


def arrows() -> dict[str, set[str]]:
    """Rooms and the rooms that they import."""
    found: dict[str, set[str]] = {}
    for package, folder in PACKAGES.items():
        for file in folder.rglob("*.py"):
            here = room_of(".".join((package, *file.relative_to(folder).with_suffix("").parts)))
            if here is None or here.endswith(("__init__", "__main__")):
                continue
            for node in ast.walk(ast.parse(file.read_bytes())):
                if isinstance(node, ast.ImportFrom) and node.module:
                    there = room_of(node.module)
                    found.setdefault(here, set()).update({there} - {None, here})
    return found


def reached(found: dict[str, set[str]], room: str) -> set[str]:
    """Rooms below a room, itself left out."""
    below: set[str] = set()
    rest = list(found.get(room, ()))
    while rest:
        room_below = rest.pop()
        if room_below not in below:
            below.add(room_below)
            rest += found.get(room_below, ())
    return below


def picture() -> str:
    """The rooms as a Mermaid graph: an arrow to each room that is not reached by way of another one."""
    found = arrows()
    lines = ["```mermaid", "graph BT"]
    for package in PACKAGES:
        lines.append(f"  subgraph {package}")
        lines += [f"    {room}[{room.partition('.')[2]}]" for room in sorted(found) if room.startswith(f"{package}.")]
        lines.append("  end")
    for room in sorted(found):
        direct = {
            below for below in found[room] if not any(below in reached(found, other) for other in found[room] - {below})
        }
        lines += [f"  {below} --> {room}" for below in sorted(direct)]
    return "\n".join([*lines, "```"])


if __name__ == "__main__":
    page = ROOT / "CONTRIBUTING.md"
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{picture()}\n{END}{rest.split(END)[1]}", encoding="utf-8")
