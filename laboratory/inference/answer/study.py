"""Searches of a question, each from its start to its end, and what their best rigs show."""

from trackdyn.sweeps.job import run_job

from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.inference.answer.problem import AnswerProblem, answer_problem, neighbours, rows_of_answer, shown
from laboratory.inference.answer.settings import AnswerConfig, load_answer, question_unknowns
from laboratory.inference.search import Start, local_searches
from laboratory.inference.unknowns import Unknowns, buildable
from replication.paper.claims import SHOWN, Claim, load_claims
from trackdyn.errors import TrackdynError
from trackdyn.sweeps.design import write_table
from trackdyn.sweeps.engine import DONE, check_completed, key_of, results

DRAWS = 100  # of a start, until one can be built
CANNOT = "cannot be built"


def start(unknowns: Unknowns, seed: int, spread: float) -> list[float]:
    """The rig itself (seed 0), or a point around it that can be built; values outside a range come to its end."""
    values = unknowns.of_rig(unknowns.rig)
    origin = np.array([unknown.position(unknown.inside(values[unknown.label])) for unknown in unknowns.unknowns])
    random = np.random.default_rng(seed)
    for _ in range(DRAWS):
        x = np.clip(random.normal(origin, spread if seed else 0.0), 0.0, 1.0)
        if buildable(unknowns, x):
            return x.tolist()
    raise TrackdynError(f"seed {seed}: of {DRAWS} points around the rig none can be built; take a smaller spread")


def answer(
    config: AnswerConfig, claims: list[Claim], question: str, jobs: int, store: Path | str
) -> tuple[pd.DataFrame, ...]:
    """Run every search of a question.

    Returns
    -------
    ends : DataFrame
        A row a search, the least cost first: ``question, rig, method, seed, evaluations, ended, first_cost, cost,
        first_shown, shown, of``, and the value of every unknown.
    costs : DataFrame
        ``question, rig, method, seed, row, cost``, a row a rig that ran.
    verdicts : DataFrame
        ``question, claim, verdict, distance`` of the best end.
    """
    searched, targets = config.questions[question], config.targets_of(question, claims)
    ends, costs = [], []
    for search in searched.searches:
        changed = config.with_question(question, rig=search.rig or searched.rig)
        unknowns = question_unknowns(changed, question)
        plain = _plain(changed, question, unknowns, targets)
        problem = AnswerProblem(changed, question, unknowns, targets)
        requested = {
            seed: (
                plain,
                Start(f"{search.method} {seed}", start(unknowns, seed, searched.spread), [True] * len(unknowns)),
            )
            for seed in search.seeds
        }
        searches = local_searches(
            answer_problem, requested, search.evaluations, jobs, store, method=search.method, radius=search.radius
        )
        for seed, end in searches.items():
            key = {"question": question, "rig": search.rig or searched.rig, "method": search.method, "seed": seed}
            costs += [key | {"row": k, "cost": cost} for k, cost in enumerate(end["costs"], 1)]
            points = {"first_shown": requested[seed][1].x, "shown": end["x"]}
            counts = {name: shown(judged_at(problem, x, store)) for name, x in points.items()}
            row = {name: end[name] for name in ("evaluations", "ended", "first_cost", "cost")}
            ends.append((key | row | counts | {"of": len(targets)} | unknowns.values(end["x"]), problem, end["x"]))
    ends.sort(key=lambda end: end[0]["cost"])
    best = judged_at(*ends[0][1:], store)
    verdicts = [
        {"question": question, "claim": name, "verdict": verdict, "distance": float(np.abs(off).max(initial=0.0))}
        for name, (verdict, off) in best.items()
    ]
    return pd.DataFrame([end[0] for end in ends]), pd.DataFrame(costs), pd.DataFrame(verdicts)


def _plain(config: AnswerConfig, question: str, unknowns: Unknowns, targets: list[Claim]) -> dict:
    """What `answer_problem` is asked with, without how long is searched: a longer search has the rows of a shorter."""
    searched = config.questions[question]
    first = searched.model_copy(update={"searches": searched.searches[:1]})
    alone = {"questions": {question: first}}
    for name in ("short", "profiles"):
        alone[name] = getattr(config, name).model_copy(update={"question": question})
    return {
        "config": config.model_copy(update=alone).model_dump(),
        "question": question, "unknowns": [unknown.model_dump() for unknown in unknowns.unknowns],
        "rig": unknowns.rig.model_dump(), "claims": [claim.model_dump() for claim in targets],
    }  # fmt: skip


def profiles(config: AnswerConfig, claims: list[Claim], end: pd.Series, jobs: int, store: Path | str) -> pd.DataFrame:
    """Assumptions held at values and laws (`Profiles`), all else searched again from a row of the ends of `answer`.

    Returns
    -------
    DataFrame
        ``assumption, value, evaluations, ended, first_cost, cost, shown, of, lost`` (claims that are not shown).
    """
    settings, name = config.profiles, config.profiles.question
    config = config.with_question(name, rig=end["rig"])
    targets, at = config.targets_of(name, claims), end.dropna().to_dict()
    cases = [(label, value, config, {label: value}) for label, values in settings.values.items() for value in values]
    cases += [(*choice, config.with_law(law), {}) for law in settings.laws for choice in law.scene.items()]
    problems, requested, rows = {}, {}, []
    how = {"store": store, "method": "dfols", "radius": settings.radius}
    for *key, asked, fixed in cases:
        try:
            problems[tuple(key)] = problem = _with_fixed(asked, targets, fixed, at)
            requested[tuple(key)] = _plain(asked, name, problem.unknowns, targets), _begin(problem, key)
        except TrackdynError:
            rows.append({"assumption": key[0], "value": key[1], "ended": CANNOT})
    for key, end_of_search in local_searches(answer_problem, requested, settings.evaluations, jobs, **how).items():
        rows.append(_profile_row(key, end_of_search, problems[key], store))
    columns = ["assumption", "value", "evaluations", "ended", "first_cost", "cost", "shown", "of", "lost"]
    return pd.DataFrame(rows, columns=columns)


def _with_fixed(config: AnswerConfig, targets: list[Claim], fixed: dict, at: dict) -> AnswerProblem:
    """The question of the profiles with unknowns held, around values ``at``; what only a law has is as in the rig."""
    every = question_unknowns(config, config.profiles.question)
    known = {label: value for label, value in at.items() if label in every.labels}
    rig = every.rig.changed(**every.changes(every.of_rig(every.rig) | known | fixed))
    free = [unknown for unknown in every.unknowns if unknown.label not in fixed]
    return AnswerProblem(config, config.profiles.question, Unknowns(free, rig), targets)


def _begin(problem: AnswerProblem, key) -> Start:
    unknowns = problem.unknowns
    return Start(" ".join(map(str, key)), start(unknowns, 0, 0.0), [True] * len(unknowns))


def _profile_row(key: tuple, minimum: dict, problem: AnswerProblem, store: Path | str) -> dict:
    row = {"assumption": key[0], "value": key[1]}
    try:
        judged = judged_at(problem, minimum["x"], store)
    except TrackdynError:  # not even where it begins
        return row | {"ended": "does not run"}
    missed = ", ".join(claim for claim, (verdict, _) in judged.items() if verdict != SHOWN)
    row |= {field: minimum[field] for field in ("evaluations", "ended", "first_cost", "cost")}
    return row | {"shown": shown(judged), "of": len(judged), "lost": missed}


def robustness(config: AnswerConfig, claims: list[Claim], end: pd.Series, jobs: int, store: Path | str) -> dict:
    """How many claims of one question (`Robustness`) a rig shows, and its neighbours with every free value moved.

    ``end`` is a row of the ends of `answer`. Neighbours that do not run show none; none belongs to the search.
    """
    settings, name = config.robustness, config.robustness.question
    config = config.with_question(end["question"], rig=end["rig"])
    unknowns, searched = question_unknowns(config, end["question"]), config.questions[end["question"]]
    config = config.with_question(name, scene=searched.scene)
    problem = AnswerProblem(config, name, unknowns, config.targets_of(name, claims))
    tasks: dict[str, dict] = {}
    keys = []  # of the rig itself, then of its neighbours; empty for one that cannot be built
    for factors in neighbours(settings.rigs, settings.share, len(unknowns)):
        key = ""
        with suppress(TrackdynError):
            task = problem.task_of(unknowns.near(end, factors))
            key = key_of(task, problem.sources)
            tasks[key] = task
        keys.append(key)
    rows = results(rows_of_answer, tasks, jobs, store)
    check_completed(rows.values(), "the same command goes on from there")
    counts = {key: shown(problem.judged(row["values"])) for key, row in rows.items() if row["state"] == DONE}
    at_rig, *others = (counts.get(key, 0) for key in keys)
    return {
        "question": end["question"], "rig": end["rig"], "of": len(problem.claims), "shown": at_rig, "rigs": len(others),
        "share_moved": settings.share, "median": float(np.median(others)), "least": min(others),
        "share_at_least": float(np.mean(np.array(others) >= at_rig)),
        "shown_by_90_pct": int(np.quantile(others, 0.1, method="lower")),
    }  # fmt: skip


def judged_at(problem: AnswerProblem, x, store: Path | str) -> dict[str, tuple[str, np.ndarray]]:
    """Verdict and residuals of every claim at a point."""
    task = problem.task(np.asarray(x))
    key = key_of(task, problem.sources)
    row = results(rows_of_answer, {key: task}, 1, store)[key]
    if row["state"] != DONE:
        raise TrackdynError(f"the end of a search does not run: {row['reason']}")
    return problem.judged(row["values"])


def main(job) -> None:
    """Rule `answer_near`."""
    config, claims = load_answer(job.input.config), load_claims(job.input.claims)
    ends, how = pd.read_csv(job.input.ends), (job.threads, job.params.store)
    best = ends.groupby("question", sort=False).head(1)
    near = [robustness(config, claims, end, *how) for _, end in best.iterrows()]
    write_table(pd.DataFrame(near), job.output.robustness)
    of = best[best["question"] == config.profiles.question].iloc[0]
    write_table(profiles(config, claims, of, *how), job.output.profiles)


if __name__ == "__main__":
    run_job(main)
