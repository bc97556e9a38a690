"""Large databases for tests and measurements, with plausible content that depends on the number of runs alone.

`python -m tests.large FILE --runs 100000 --points 20` makes 100,000 runs with 10 million points of learning curves.
"""

import argparse
import random
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from itertools import islice, product
from typing import Any

from sqlalchemy import insert, text

from zoobench import registry
from zoobench.db.models import AttemptRecord, FinalRecord, ProvenanceRecord, RunRecord, SpecRecord
from zoobench.db.rows import RunState
from zoobench.db.specs import spec_columns
from zoobench.db.store import Store
from zoobench.registry import Kind
from zoobench.report.learning_curves import COLUMNS
from zoobench.spec import Budget, Ref, RunSpec, canonical_json

SEEDS = 5
_ENVS = ("ground", "ice", "desert", "wetland", "clay", "snow", "shallow-water", "ocean")
_TASKS = ("movement-speed", "turning", "final-position", "velocity-tracking", "waypoint-following")
_DESIGNS = ("caterpillar", "baby-seal", "fish", "panda", "orca", "shark", "clownfish", "tuna", "voxel[base=fish]",
            "particle[base=panda]")  # fmt: skip
_CONTROLLERS = ("sine-basis", "sine-feedback")
_METHODS = ("diffphysics", "diffphysics[lr=0.05]", "cmaes", "evolution", "random")
_SETTINGS = tuple(product(("draft", "standard"), (60_000.0, 126_000.0, 540_000.0)))[:5]
_COUNTS = ("backward_substeps", "diverged_evaluations", "episodes", "forward_substeps", "iterations", "repeated_frames")
_READINGS = (("actuation_energy", "J"), ("cost_of_transport", "1"), ("distance", "m"), ("distance_travelled", "m"),
             ("heading_error", "rad"), ("mean_speed", "m/s"))  # fmt: skip
_EVERY = 7.0  # a run starts so many seconds after the one before it [s]
_BEGIN = 1_790_000_000.0  # [s] since the epoch
_AT_ONCE = 5_000


def specs() -> Iterator[RunSpec]:
    """The runs of large databases: 20,000 cells of five seeds."""
    axes = (
        [registry.resolve(kind, Ref.parse(name)) for name in names]
        for kind, names in (
            (Kind.ENV, _ENVS),
            (Kind.TASK, _TASKS),
            (Kind.DESIGN, _DESIGNS),
            (Kind.CONTROLLER, _CONTROLLERS),
            (Kind.METHOD, _METHODS),
        )
    )
    cells = [tuple(cell) for cell in product(*axes)]
    for fidelity, amount in _SETTINGS:
        level = registry.resolve(Kind.FIDELITY, Ref(fidelity))
        for cell, seed in product(cells, range(SEEDS)):
            yield RunSpec(*cell, seed=seed, budget=Budget("substeps", amount), fidelity=level, frames=100)


def make(location: str, runs: int, points: int) -> None:
    """Fill a new database with this many runs, each with `points` iterations of five curves.

    Of a hundred runs one has failed, one diverged, one is queued and one was done in a second attempt.
    """
    numbered = enumerate(islice(specs(), runs), start=1)
    with Store(location) as store:
        with store._database.write() as session:
            documents = [{"hash": _provenance_hash(number), "document": _provenance(number)} for number in range(4)]
            session.execute(insert(ProvenanceRecord), documents)
        while some := list(islice(numbered, _AT_ONCE)):
            tables: dict[Any, list[dict[str, Any]]] = {}
            for number, spec in some:
                for table, rows in _rows(number, spec).items():
                    tables.setdefault(table, []).extend(rows)
            with store._database.write() as session:
                for table, rows in tables.items():
                    session.execute(insert(table), rows)
        with store._database.write() as session:
            session.execute(text(_CURVES), {"points": points})


_CURVES = f"""
INSERT INTO metrics (run_id, name, step, attempt, value, kind)
WITH RECURSIVE steps(step) AS (SELECT 1 UNION ALL SELECT step + 1 FROM steps WHERE step < :points),
names(name, pace) AS (VALUES {", ".join(f"('{name}', {pace})" for name, pace in zip(COLUMNS, (2e3, 1e3, 8, 0.5, 1e-3), strict=True))})
SELECT runs.id, names.name, steps.step, runs.attempt, names.pace * steps.step, 'finite'
FROM runs, names, steps WHERE runs.state = 'done' ORDER BY runs.id, names.name, steps.step
"""  # noqa: E501


def _rows(number: int, spec: RunSpec) -> dict[Any, list[dict[str, Any]]]:
    """The rows of a run by their tables."""
    chance = random.Random(number)
    outcomes = {17: (RunState.FAILED,), 34: (RunState.DIVERGED,), 51: (), 68: (RunState.LOST, RunState.DONE)}
    attempts = outcomes.get(number % 100, (RunState.DONE,))
    state = attempts[-1] if attempts else RunState.QUEUED
    seconds = chance.uniform(20.0, 60.0)
    key, begin = spec.key(), _BEGIN + _EVERY * number
    ends = [begin + seconds * place for place in range(len(attempts) + 1)]
    run = {
        "id": number, "spec_key": key, "state": state, "attempt": len(attempts), "strikes": 0, "created_at": _BEGIN,
        "fraction": float(state == RunState.DONE), "started_at": begin if attempts else None,
        "finished_at": ends[-1] if attempts else None,
    }  # fmt: skip
    made = [
        {
            "run_id": number, "number": place, "outcome": outcome, "owner": "host:1:0.00", "host": "host",
            "provenance_hash": _provenance_hash(number % 4), "started_at": ends[place - 1], "ended_at": ends[place],
            "wall_seconds": ends[place] - ends[place - 1], "resumed": place > 1,
            "progressed": outcome in (RunState.DONE, RunState.LOST),
        }
        for place, outcome in enumerate(attempts, start=1)
    ]  # fmt: skip
    finals = []
    if state == RunState.DONE:
        values = [(name, float(chance.randrange(1, 60_000)), "") for name in _COUNTS]
        values += [(name, chance.gauss(1.0, 0.1), unit) for name, unit in _READINGS]
        level = 0.01 * (1 + number // SEEDS % len(_METHODS))
        values += [
            ("score", chance.gauss(level, 0.002), "m/s"), ("idle_score", 1e-9, "m/s"), ("random_score", 2e-3, "m/s"),
        ]  # fmt: skip
        finals = [
            {"run_id": number, "name": name, "value": value, "kind": "finite", "unit": unit}
            for name, value, unit in values
        ]
    found = {SpecRecord: [spec_columns(key, spec)], RunRecord: [run], AttemptRecord: made, FinalRecord: finals}
    return {table: rows for table, rows in found.items() if rows}


def _provenance(number: int) -> str:
    return canonical_json(
        {
            "code": {"commit": f"{number:040}", "dirty": False, "files": f"{number:064}"},
            "cpu": {"cores": 4, "model": "Example 9000", "threads": 8},
            "gpus": [],
            "memory": 8 * 2**30,
            "packages": {"numpy": "2.4.6", "zoobench": "0.1.0"},
            "python": "3.11.7",
        }
    )


@cache
def _provenance_hash(number: int) -> str:
    return sha256(_provenance(number).encode()).hexdigest()


def main() -> None:
    """Read the command line and make the database."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file")
    parser.add_argument("--runs", type=int, default=100_000)
    parser.add_argument("--points", type=int, default=20)
    given = parser.parse_args()
    make(given.file, given.runs, given.points)


if __name__ == "__main__":
    main()
