"""JSON schemas of the laboratory's YAML files: ``python -m laboratory.schemas`` writes them into ``config/schemas``."""

from laboratory.inference.ensemble.settings import EnsembleConfig
from laboratory.inference.fit import FitConfig
from laboratory.inference.identification.calibration import CalibrationConfig
from laboratory.settings import Laboratory
from laboratory.studies.departures import Departures
from replication.pipeline.schemas import write_schemas

MODELS = {
    "fit": FitConfig, "departures": Departures, "calibration": CalibrationConfig, "ensemble": EnsembleConfig,
    "laboratory": Laboratory,
}  # fmt: skip

if __name__ == "__main__":
    write_schemas(MODELS)
