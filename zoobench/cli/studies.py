"""Rows of studies, stored one by one as they are done."""

from collections.abc import Callable, Iterable, Iterator
from itertools import tee
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from zoobench.db.rows import StudyRow

R = TypeVar("R")


def save_each(db: str, study: str, results: Iterable[R], row_of: "Callable[[R], StudyRow]") -> Iterator[R]:
    """Yield the results of a study, each after its row is in the database.

    Raises:
        StorageError: the database cannot be written; earlier rows stay in it.
    """
    from zoobench.db.store import Store
    from zoobench.harness import provenance

    first, second = tee(results)
    with Store(db) as store:
        saved = store.save_study(study, map(row_of, first), provenance=provenance.gather())
        for _, result in zip(saved, second, strict=False):  # in this order, so that the study is finished
            yield result
