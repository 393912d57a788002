"""The study of accuracy against cost scene by scene, for jobs that run side by side."""

from trackdyn.study.accuracy.statistics import scene_name
from trackdyn.study.settings import SceneKey, StateErrors, StatisticErrors, TradeForm


def measured_scenes(form: TradeForm) -> dict[str, StateErrors | StatisticErrors]:
    """What is asked of each scene that is measured, by its name: its state errors, or those of its statistics."""
    found = {f"state_{_file(name)}": form.state.model_copy(update={"scenes": [name]}) for name in form.state.scenes}
    return found | {
        f"statistics_{_file(scene_name(*key))}": form.statistics.model_copy(update={"scenes": [key]})
        for key in form.statistics.scenes
    }


def promised_scenes(form: TradeForm) -> dict[str, SceneKey]:
    """Scenes kept apart, on which the planner is judged, by their names."""
    return {_file(scene_name(*key)): key for key in form.kept_apart}


def _file(name: str) -> str:
    return name.replace(" ", "_")
