"""Searches of a question, each from its start to its end, and what their best rigs show."""

from pathlib import Path

import numpy as np
import pandas as pd

from laboratory.inference.answer.problem import AnswerProblem, answer_problem, rows_of_answer, shown
from laboratory.inference.answer.settings import AnswerConfig, question_unknowns
from laboratory.inference.search import Start, local_searches
from laboratory.inference.unknowns import Unknowns, buildable
from replication.paper.claims import REPRODUCED, Claim
from trackdyn.errors import TrackdynError
from trackdyn.sweeps.engine import results
from trackdyn.sweeps.store import DONE, key_of

DRAWS = 100  # of a start, until one can be built


def start(unknowns: Unknowns, seed: int, spread: float) -> list[float]:
    """The rig itself (seed 0), or a point around it that can be built; values outside a range come to its end."""
    own = np.array(
        [
            _within(one, value)
            for one, value in zip(unknowns.unknowns, unknowns.of_rig(unknowns.rig).values(), strict=True)
        ]
    )
    random = np.random.default_rng(seed)
    for _ in range(DRAWS):
        x = np.clip(random.normal(own, spread if seed else 0.0), 0.0, 1.0)
        if buildable(unknowns, x):
            return x.tolist()
    raise TrackdynError(f"seed {seed}: of {DRAWS} points around the rig none can be built; take a smaller spread")


def _within(unknown, value: float) -> float:
    """Position of a value, or of the end of the ranges that is nearest to it."""
    ends = [end for interval in unknown.intervals for end in interval]
    place = unknown.position(value)
    return unknown.position(min(ends, key=lambda end: abs(end - value))) if np.isnan(place) else place


def answer(config: AnswerConfig, claims: list[Claim], question: str, jobs: int, store: Path | str):
    """Run every search of a question.

    Returns
    -------
    ends : DataFrame
        A row a search, the least cost first: ``question, method, seed, evaluations, ended, first_cost, cost,
        first_shown, shown, of``, and the value of every unknown.
    costs : DataFrame
        ``question, method, seed, row, cost`` of every rig that came out.
    verdicts : DataFrame
        ``question, claim, verdict, distance`` of the best end.
    """
    asked, unknowns = config.questions[question], question_unknowns(config, question)
    targets = config.targets_of(question, claims)
    plain = _plain(config, question, unknowns, targets)
    problem = AnswerProblem(config, question, unknowns, targets)
    ends, costs = [], []
    for one in asked.searches:
        requested = {
            seed: (plain, Start(f"{one.method} {seed}", start(unknowns, seed, asked.spread), [True] * len(unknowns)))
            for seed in one.seeds
        }
        found = local_searches(
            answer_problem, requested, one.evaluations, jobs, store, method=one.method, radius=one.radius
        )
        for seed, end in found.items():
            key = {"question": question, "method": one.method, "seed": seed}
            costs += [key | {"row": k, "cost": cost} for k, cost in enumerate(end["costs"], 1)]
            counts = {
                name: _shown(problem, x, store)
                for name, x in (("first_shown", requested[seed][1].x), ("shown", end["x"]))
            }
            row = {name: end[name] for name in ("evaluations", "ended", "first_cost", "cost")}
            ends.append(key | row | counts | {"of": len(targets), "x": end["x"]})
    ends.sort(key=lambda end: end["cost"])
    best = judged_at(problem, ends[0]["x"], store)
    verdicts = [
        {"question": question, "claim": name, "verdict": verdict, "distance": float(np.abs(off).max(initial=0.0))}
        for name, (verdict, off) in best.items()
    ]
    table = [{k: v for k, v in end.items() if k != "x"} | unknowns.values(end["x"]) for end in ends]
    return pd.DataFrame(table), pd.DataFrame(costs), pd.DataFrame(verdicts)


def _plain(config: AnswerConfig, question: str, unknowns: Unknowns, targets: list[Claim]) -> dict:
    """What `answer_problem` is asked with, without how long is searched: a longer search has the rows of a shorter."""
    asked = config.questions[question]
    first = asked.model_copy(update={"searches": asked.searches[:1]})
    return {
        "config": config.model_copy(update={"questions": {question: first}}).model_dump(),
        "question": question, "unknowns": [one.model_dump() for one in unknowns.unknowns],
        "rig": unknowns.rig.model_dump(), "claims": [one.model_dump() for one in targets],
    }  # fmt: skip


def profiles(config: AnswerConfig, claims: list[Claim], end: pd.Series, jobs: int, store: Path | str) -> pd.DataFrame:
    """Assumptions held at values (`Profiles`), all else searched again from a rig, a row of the ends of `answer`.

    Returns
    -------
    DataFrame
        ``assumption, value, evaluations, ended, first_cost, cost, shown, of, lost`` (claims that are not shown).
    """
    asked, name = config.profiles, config.profiles.question
    targets, open_ones = config.targets_of(name, claims), question_unknowns(config, name)
    best = open_ones.rig.changed(**open_ones.changes({label: end[label] for label in open_ones.labels})[0])
    requested, problems = {}, {}
    for label, values in asked.values.items():
        free = [one for one in open_ones.unknowns if one.label != label]
        held = next(one for one in open_ones.unknowns if one.label == label)
        for value in values:
            alone = Unknowns([held], best)
            unknowns = Unknowns(free, best.changed(**alone.changes({label: value})[0]))
            begin = Start(f"{label} {value:g}", start(unknowns, 0, 0.0), [True] * len(free))
            requested[label, value] = _plain(config, name, unknowns, targets), begin
            problems[label, value] = AnswerProblem(config, name, unknowns, targets)
    how = {"method": "dfols", "radius": asked.radius}
    rows = []
    for (label, value), found in local_searches(
        answer_problem, requested, asked.evaluations, jobs, store, **how
    ).items():
        judged = judged_at(problems[label, value], found["x"], store)
        lost = ", ".join(claim for claim, (verdict, _) in judged.items() if verdict != REPRODUCED)
        row = {key: found[key] for key in ("evaluations", "ended", "first_cost", "cost")}
        counts = {"shown": shown(judged), "of": len(targets), "lost": lost}
        rows.append({"assumption": label, "value": value} | row | counts)
    return pd.DataFrame(rows)


def robustness(config: AnswerConfig, claims: list[Claim], end: pd.Series, jobs: int, store: Path | str) -> dict:
    """How many claims of one question (`Robustness`) a rig shows, and its neighbours with every free value moved.

    ``end`` is a row of the ends of `answer`. Neighbours that do not run show none.
    """
    asked, name = config.robustness, config.robustness.question
    unknowns = question_unknowns(config, end["question"])
    whole = config.questions[name].model_copy(update={"scene": config.questions[end["question"]].scene})
    config = config.model_copy(update={"questions": {name: whole}})
    problem = AnswerProblem(config, name, unknowns, config.targets_of(name, claims))
    random, tasks = np.random.default_rng(0), {}
    for k in range(asked.rigs + 1):
        factors = 1 + asked.share * random.uniform(-1, 1, len(unknowns)) * (k > 0)
        values = {label: end[label] * factor for label, factor in zip(unknowns.labels, factors, strict=True)}
        task = problem.task_of(unknowns.rig.changed(**unknowns.changes(values)[0]))
        tasks[key_of(task, problem.sources)] = task
    rows = results(rows_of_answer, tasks, jobs, store)
    found = [rows[key] for key in tasks]
    counts = [shown(problem.judged(row["values"])) if row["state"] == DONE else 0 for row in found]
    own, others = counts[0], np.array(counts[1:])
    return {
        "question": end["question"], "of": len(problem.claims), "shown": own, "rigs": len(others),
        "share_moved": asked.share, "median": float(np.median(others)), "least": int(others.min()),
        "share_at_least": float((others >= own).mean()),
    }  # fmt: skip


def judged_at(problem: AnswerProblem, x, store: Path | str):
    """Verdict and residuals of every claim at a point."""
    task = problem.task(np.asarray(x))
    key = key_of(task, problem.sources)
    row = results(rows_of_answer, {key: task}, 1, store)[key]
    if row["state"] != DONE:
        raise TrackdynError(f"the end of a search does not run: {row['reason']}")
    return problem.judged(row["values"])


def _shown(problem: AnswerProblem, x, store: Path | str) -> int:
    return shown(judged_at(problem, x, store))
