"""JSON schemas of all YAML files, for editors: ``python -m laboratory.schemas`` writes them into ``config/schemas``.

What is checked when a file is read is more: values that must fit each other, tolerances, names of files.
"""

import json
from pathlib import Path

from laboratory.plausible.settings import PlausibleConfig
from replication.pipeline.schemas import MODELS, schema
from trackdyn.inputs.files import write_text

FOLDER = Path(__file__).parents[1] / "config" / "schemas"
EVERY = MODELS | {"plausible": PlausibleConfig}


if __name__ == "__main__":
    for name, model in EVERY.items():
        text = json.dumps(schema(name, model), indent=1, ensure_ascii=False)
        write_text(FOLDER / f"{name}.schema.json", f"{text}\n")
