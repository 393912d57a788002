"""Draws the structure of the packages from their imports into CONTRIBUTING.md: `python docs/structure.py`."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("trackdyn", "workflow/trackdyn_replication", "laboratory")
PACKAGES = {Path(folder).name: ROOT / folder for folder in FOLDERS}
# rooms beneath all, whose imports are no arrows
GROUND = {"trackdyn." + name for name in ("by_reference", "errors", "extras", "files", "jit", "sources", "version")}
BEGIN, END = "<!-- structure -->", "<!-- end of structure -->"


def room_of(module: str) -> str | None:
    """Package and room of a module, such as ``trackdyn.scene``; None for other packages and ground."""
    package, _, rest = module.partition(".")
    if package not in PACKAGES or not rest:
        return None
    name = f"{package}.{rest.partition('.')[0]}"
    return None if name in GROUND else name


def arrows() -> dict[str, set[str]]:
    """Rooms and the rooms that they import."""
    imported: dict[str, set[str]] = {}
    for package, folder in PACKAGES.items():
        for file in folder.rglob("*.py"):
            here = room_of(".".join((package, *file.relative_to(folder).with_suffix("").parts)))
            if here is None or here.endswith(("__init__", "__main__")):
                continue
            for node in ast.walk(ast.parse(file.read_bytes())):
                if isinstance(node, ast.ImportFrom) and node.module:
                    there = room_of(node.module)
                    imported.setdefault(here, set()).update({there} - {None, here})
    return imported


def reached(imported: dict[str, set[str]], room: str) -> set[str]:
    """Rooms below a room, itself left out."""
    below: set[str] = set()
    rest = list(imported.get(room, ()))
    while rest:
        room_below = rest.pop()
        if room_below not in below:
            below.add(room_below)
            rest += imported.get(room_below, ())
    return below


def picture() -> str:
    """The rooms as a Mermaid graph: an arrow to each room that is not reached by way of another one."""
    imported = arrows()
    lines = ["```mermaid", "graph BT"]
    for package in PACKAGES:
        lines.append(f"  subgraph {package}")
        lines += [
            f"    {room}[{room.partition('.')[2]}]" for room in sorted(imported) if room.startswith(f"{package}.")
        ]
        lines.append("  end")
    for room in sorted(imported):
        direct = {
            below
            for below in imported[room]
            if not any(below in reached(imported, other) for other in imported[room] - {below})
        }
        lines += [f"  {below} --> {room}" for below in sorted(direct)]
    return "\n".join([*lines, "```"])


if __name__ == "__main__":
    page = ROOT / "CONTRIBUTING.md"
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{picture()}\n{END}{rest.split(END)[1]}", encoding="utf-8")
