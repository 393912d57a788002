"""JSON schemas of the laboratory's YAML files: ``python -m laboratory.schemas`` writes them into ``config/schemas``."""

from laboratory.inference.answer.settings import AnswerConfig
from laboratory.inference.identification.calibration import CalibrationConfig
from laboratory.settings import Laboratory
from replication.pipeline.schemas import write_schemas

MODELS = {
    "calibration": CalibrationConfig, "answer": AnswerConfig,
    "laboratory": Laboratory,
}  # fmt: skip

if __name__ == "__main__":
    write_schemas(MODELS)
