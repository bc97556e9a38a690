"""A leaderboard of known content, as a database and a suite would give it."""

from pathlib import Path

from tests.report.content import fill, make_spec
from zoobench.db.store import Store
from zoobench.report.leaderboard import Leaderboard, gather
from zoobench.spec import RunSpec

CMAES = "cmaes-v1[sigma=0.1]"
METHODS = ("diffphysics-v2[lr=0.1]", "random-v1", CMAES)


def asked() -> list[tuple[RunSpec, str | None]]:
    """Three environments, three methods, three seeds; one that is impossible and one smoke run.

    `fill` has runs on desert and ice with the first two methods.
    """
    specs = [
        make_spec(env=env, method=method, seed=seed)
        for env in ("desert-v1", "ice-v1", "snow-v1")
        for method in METHODS
        for seed in range(3)
    ]
    impossible = make_spec(method="neat-v1")
    return [*((spec, None) for spec in specs), (impossible, "needs a space"), (make_spec(fidelity="smoke-v1"), None)]


def board(folder: Path) -> Leaderboard:
    """What a database in this folder knows of it."""
    path = folder / "board.db"
    with Store(path if path.exists() else fill(path), create=False) as store:
        return gather(store, "mine", "mine.yaml", "a test of pages", asked())


def unknown(*place: object) -> None:
    """The orders that are known of a fidelity: none."""
