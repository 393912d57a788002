"""JSON schemas of the replication's YAML files, for editors."""

from typing import Any

from pydantic import BaseModel

from replication.paper.claims import Claims
from replication.pipeline.config import Config
from replication.study.settings import Studies
from trackdyn.rig.rig import Rig
from trackdyn.rig.rig_file import MEMBERS
from trackdyn.sensor.sensor_mapping import SensorMapping

MODELS: dict[str, type[BaseModel]] = {
    "rig": Rig, "config": Config, "studies": Studies, "mapping": SensorMapping, "claims": Claims,
}  # fmt: skip


def schema(name: str, model: type[BaseModel]) -> dict[str, Any]:
    """The schema of a kind of file; a configuration states only what differs from ``config/config.yaml``."""
    content = model.model_json_schema()
    if name == "rig":  # words of the file, which the rig does not hold
        groups = {name: content["properties"][group]["additionalProperties"] for name, group in MEMBERS.items()}
        content["properties"] |= {"about": {"type": "string"}} | groups
    if name == "config":
        content = _without_required(content)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **content}


def _without_required(content: Any) -> Any:
    """A schema in which nothing must be there."""
    if isinstance(content, dict):
        return {
            key: _without_required(value)
            for key, value in content.items()
            if key != "required" or not isinstance(value, list)
        }
    return [_without_required(value) for value in content] if isinstance(content, list) else content
