"""JSON schemas of the YAML files, for editors: ``python -m replication.pipeline.schemas`` writes them into
``config/schemas``.

What is checked when a file is read is more: values that must fit each other, tolerances, names of files.
"""

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from replication.paper.claims import Claims
from replication.pipeline.config import Config
from replication.study.settings import Studies
from trackdyn.files import write_text
from trackdyn.parameters.paper_tables import PaperTables
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.rig_file import CELLS
from trackdyn.sensor.sensor_mapping import SensorMapping

FOLDER = Path(__file__).parents[3] / "config" / "schemas"
MODELS: dict[str, type[BaseModel]] = {
    "rig": Rig, "config": Config, "studies": Studies, "mapping": SensorMapping, "claims": Claims,
    "paper_tables": PaperTables,
}  # fmt: skip


def schema(name: str, model: type[BaseModel]) -> dict[str, Any]:
    """The schema of a kind of file; a configuration states only what differs from ``config/config.yaml``."""
    found = model.model_json_schema()
    if name == "rig":
        found["properties"][CELLS] = {"description": "The file of the article's cells.", "type": "string"}
    if name == "config":
        found = _without_required(found)
    shared: dict[str, Any] = {}
    found = _shared(found, shared)
    if shared:
        found["$defs"] |= shared
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **found}


def _shared(part: Any, shared: dict[str, Any]) -> Any:
    """A schema in which every kind of parameter, with a unit and bounds of its own, stands once among ``$defs``."""
    if isinstance(part, list):
        return [_shared(value, shared) for value in part]
    if not isinstance(part, dict):
        return part
    entry = {key: value for key, value in part.items() if key not in ("title", "default")}
    if "const" not in part.get("properties", {}).get("unit", {}):
        return {key: _shared(value, shared) for key, value in part.items()}
    name = next((name for name, other in shared.items() if other == entry), f"Parameter{len(shared) + 1}")
    shared[name] = entry
    return {"$ref": f"#/$defs/{name}", **{key: part[key] for key in ("title", "default") if key in part}}


def _without_required(part: Any) -> Any:
    """A schema in which nothing must be there."""
    if isinstance(part, dict):
        return {
            key: _without_required(value)
            for key, value in part.items()
            if key != "required" or not isinstance(value, list)
        }
    return [_without_required(value) for value in part] if isinstance(part, list) else part


def write_schemas(models: dict[str, type[BaseModel]], folder: Path = FOLDER) -> None:
    """Write the schemas of kinds of files."""
    for name, model in models.items():
        text = json.dumps(schema(name, model), indent=1, ensure_ascii=False)
        write_text(folder / f"{name}.schema.json", f"{text}\n")


if __name__ == "__main__":
    write_schemas(MODELS)
