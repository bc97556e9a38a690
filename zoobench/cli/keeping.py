"""Studies from the command line: every result is stored as soon as it is there."""

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from zoobench.db.rows import StudyRow

R = TypeVar("R")


def kept(db: str, study: str, results: Iterable[R], stored: "Callable[[R], StudyRow]") -> Iterator[R]:
    """Hand the results on, each after it is stored; `stored` says as what.

    Raises:
        StorageError: the database refuses; what came before is kept.
    """
    from zoobench.db.store import Store
    from zoobench.harness import provenance

    done: list[R] = []

    def rows() -> "Iterator[StudyRow]":
        for result in results:
            done.append(result)
            yield stored(result)

    with Store(db) as store:
        for _ in store.save_study(study, rows(), provenance=provenance.gather()):
            yield done[-1]
