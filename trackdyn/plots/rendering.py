"""Rendering of pages: rounded numbers, and a template with its data."""

import base64
import gzip
import json
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from trackdyn.measure.columns import cell, groups, heading, words

HERE = Path(__file__).parent
CONFIGURATION = 2e-4  # the moving picture shows places and angles to this, m and rad


def short(values, digits: int = 4) -> list[float]:
    """Round numbers to a few significant digits."""
    return [float(f"{value:.{digits}g}") for value in np.asarray(values).tolist()]


def differences(columns: np.ndarray) -> dict:
    """Encode columns over time in integers of ``CONFIGURATION``: a start and second differences, for a small file."""
    steps = np.rint(columns / CONFIGURATION).astype(int)
    bends = np.diff(steps, 2, axis=0, prepend=np.repeat(steps[:1], 2, axis=0))
    return {"start": steps[0].tolist(), "frame": bends.T.ravel().tolist()}


def environment(folder: Path = HERE) -> Environment:
    """Return an environment of the templates of a folder and of this one; its global ``style`` is that of all pages."""
    spaces = {"trim_blocks": True, "lstrip_blocks": True}
    loader = FileSystemLoader([folder, HERE])
    templates = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, **spaces)
    templates.filters |= {"cell": cell, "groups": groups, "heading": heading, "words": words}
    templates.globals["style"] = (HERE / "page.css").read_text(encoding="utf-8")
    return templates


def render(template: str, scripts: tuple[str, ...], data: dict, folder: Path = HERE, **content) -> str:
    """Render a page as HTML: template, scripts and data; ``data["files"]`` are texts for download."""
    files = [next(path for path in (folder / f"{name}.js", HERE / f"{name}.js") if path.is_file()) for name in scripts]
    content["script"] = "\n".join(file.read_text(encoding="utf-8") for file in files)
    content["embedded"] = packed(json.dumps(data, allow_nan=False, separators=(",", ":")))
    return environment(folder).get_template(template).render(data=data, files=data["files"], **content)


def packed(text: str) -> str:
    """Return the base64 of a compressed text, reproducibly."""
    return base64.b64encode(gzip.compress(text.encode("utf-8"), mtime=0)).decode("ascii")
