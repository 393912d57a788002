"""JSON schemas of the YAML files, for editors: ``python -m trackdyn.pipeline.schemas`` writes them into
``config/schemas``.

What is checked when a file is read is more: values that must fit each other, tolerances, names of files.
"""

import json
from pathlib import Path
from typing import Any

from trackdyn.files import write_text
from trackdyn.inference.assumptions import AssumptionsConfig
from trackdyn.inference.ensemble.settings import EnsembleConfig
from trackdyn.inference.fit import FitConfig
from trackdyn.inference.identification.calibration import CalibrationConfig
from trackdyn.paper.claims import Claims
from trackdyn.parameters.paper_tables import PaperTables
from trackdyn.parameters.rig import Rig
from trackdyn.parameters.rig_file import CELLS
from trackdyn.pipeline.config import Config
from trackdyn.sensor.sensor_mapping import SensorMapping
from trackdyn.study.departures import Departures
from trackdyn.study.settings import Studies

FOLDER = Path(__file__).parents[2] / "config" / "schemas"
MODELS = {
    "rig": Rig, "config": Config, "studies": Studies, "mapping": SensorMapping, "fit": FitConfig, "claims": Claims,
    "departures": Departures, "calibration": CalibrationConfig, "ensemble": EnsembleConfig,
    "paper_tables": PaperTables, "assumptions": AssumptionsConfig,
}  # fmt: skip


def schema(name: str) -> dict[str, Any]:
    """The schema of a kind of file; a configuration states only what differs from ``config/config.yaml``."""
    found = MODELS[name].model_json_schema()
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


def text(name: str) -> str:
    """The schema as its file has it."""
    return json.dumps(schema(name), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    for name in MODELS:
        write_text(FOLDER / f"{name}.schema.json", text(name))
