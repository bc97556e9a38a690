"""Databases with known content for the tests of reports and commands, made through the store alone."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from zoobench.db.owner import Owner
from zoobench.db.rows import Batch, Claim, Ending, FinalRow, RunState
from zoobench.db.store import Store
from zoobench.spec import Budget, Ref, RunSpec

PROVENANCE: dict[str, Any] = {
    "code": {"commit": "0123456789abcdef", "dirty": True, "files": "feedfacefeedface"},
    "packages": {"zoobench": "0.1.0", "taichi": "1.7.4", "torch": None},
    "python": "3.11.7",
    "cpu": {"model": "Example 9000", "cores": 4, "threads": 8},
    "gpus": [],
    "memory": 8 * 2**30,
}


def make_spec(
    *,
    method: str = "diffphysics-v2[lr=0.1]",
    seed: int = 0,
    env: str = "desert-v1",
    fidelity: str = "draft-v1",
    budget: str = "1000 substeps",
    design: str = "caterpillar-v1",
    controller: str = "sine-basis-v1",
) -> RunSpec:
    """A spec by words, which nothing needs to know."""
    return RunSpec(
        env=Ref.parse(env),
        task=Ref.parse("turning-v1"),
        design=Ref.parse(design),
        controller=Ref.parse(controller),
        method=Ref.parse(method),
        seed=seed,
        budget=Budget.parse(budget),
        fidelity=Ref.parse(fidelity),
        frames=10,
    )


def made_once(content: Callable[[Store], object]) -> Callable[[Path], Path]:
    """What writes a database of this content to a path; it is made once in a process, and then copied."""

    @cache
    def contents() -> bytes:
        with TemporaryDirectory() as folder:
            path = Path(folder) / "runs.db"
            with Store(path) as store:
                content(store)
            return path.read_bytes()

    def write(path: Path) -> Path:
        path.write_bytes(contents())
        return path

    return write


def add_done(
    store: Store, spec: RunSpec, score: float, *, unit: str = "m/s", references: dict[str, float] | None = None
) -> int:
    """A run that ended well with this score and these reference scores, having spent 1000 substeps; its id."""
    finals = (
        FinalRow("score", score, unit),
        *(FinalRow(name, value, unit) for name, value in (references or {}).items()),
        FinalRow("distance", 2.0 * score, "m"),
        FinalRow("forward_substeps", 600.0),
        FinalRow("backward_substeps", 400.0),
    )
    return add_ended(store, spec, Ending(RunState.DONE, finals=finals))


def add_ended(store: Store, spec: RunSpec, ending: Ending) -> int:
    """A run whose one attempt ended so, having printed one line; its id."""
    claim = claim_new(store, spec)
    batch = Batch()
    batch.log("a line of the child")
    store.finish(claim, ending, batch)
    return claim.run_id


def claim_new(store: Store, spec: RunSpec) -> Claim:
    """A run in progress, held by this process."""
    claim = store.claim(Owner.current(), provenance=PROVENANCE, ids=store.enqueue([spec]).new)
    assert claim is not None
    return claim


def fill(path: Path) -> Path:
    """A bit of everything.

    On the desert diffphysics (runs 1, 3, 5) is far above random (2, 4, 6). On ice diffphysics has two equal scores
    (7, 8) and a diverged run (9), random a failed run (10), one in progress (11) and a queued one (12). Run 13 is a
    smoke run with the score 77.
    """
    contents, claim = _filled()
    path.write_bytes(contents)
    with Store(path) as store:
        store.commit(claim, Batch(fraction=0.25, score=0.05))  # its lease begins anew
    return path


@cache
def _filled() -> tuple[bytes, Claim]:
    """The file, made once in a process, and the claim on the run in progress."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "runs.db"
        with Store(path) as store:
            claim = _add_everything(store)
        return path.read_bytes(), claim


def _add_everything(store: Store) -> Claim:
    for seed in range(3):
        add_done(store, make_spec(seed=seed), 1.0 + 0.001 * seed)
        add_done(store, make_spec(method="random-v1", seed=seed), 0.1 + 0.001 * seed)
    for seed in range(2):
        add_done(store, make_spec(env="ice-v1", seed=seed), 0.5)
    add_ended(store, make_spec(env="ice-v1", seed=2), Ending(RunState.DIVERGED, "det F is -1."))
    trace = 'Traceback\n  File "x.py"\nValueError: boom'
    add_ended(
        store,
        make_spec(env="ice-v1", method="random-v1", seed=0),
        Ending(RunState.FAILED, "ValueError: boom", traceback=trace),
    )
    claim = claim_new(store, make_spec(env="ice-v1", method="random-v1", seed=1))
    store.commit(claim, Batch(fraction=0.25, score=0.05))
    store.enqueue([make_spec(env="ice-v1", method="random-v1", seed=2)])
    add_done(store, make_spec(fidelity="smoke-v1"), 77.0)
    return claim


def add_curve(
    store: Store,
    spec: RunSpec,
    scores: list[float | None],
    *,
    cost: float = 100.0,
    unit: str = "m/s",
    references: dict[str, float] | None = None,
) -> int:
    """A run that ended well after an iteration for each best score so far, None for none yet; its id.

    An iteration costs `cost` substeps, a third of them forward, 8 episodes and half a second.
    """
    claim = claim_new(store, spec)
    batch = Batch()
    for step, score in enumerate(scores, 1):
        spent = {"substeps": cost, "forward_substeps": cost / 3, "episodes": 8.0, "seconds": 0.5}
        point = {name: step * value for name, value in spent.items()} | ({} if score is None else {"score": score})
        batch.metrics |= {(name, step): value for name, value in point.items()}
    best = next(score for score in reversed(scores) if score is not None)
    simulated = cost * len(scores)
    finals = [FinalRow("score", best, unit), FinalRow("episodes", 8.0 * len(scores))]
    finals += [FinalRow("forward_substeps", simulated / 3), FinalRow("backward_substeps", 2 * simulated / 3)]
    finals += [FinalRow(name, value, unit) for name, value in (references or {}).items()]
    store.finish(claim, Ending(RunState.DONE, finals=tuple(finals)), batch)
    return claim.run_id
