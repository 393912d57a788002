"""JSON schemas of the laboratory's YAML files: ``python -m laboratory.schemas`` writes them into ``config/schemas``."""

from laboratory.inference.assumptions import AssumptionsConfig
from laboratory.inference.ensemble.settings import EnsembleConfig
from laboratory.inference.fit import FitConfig
from laboratory.inference.identification.calibration import CalibrationConfig
from laboratory.studies.departures import Departures
from replication.pipeline.schemas import write

MODELS = {
    "fit": FitConfig, "departures": Departures, "calibration": CalibrationConfig, "ensemble": EnsembleConfig,
    "assumptions": AssumptionsConfig,
}  # fmt: skip

if __name__ == "__main__":
    write(MODELS)
