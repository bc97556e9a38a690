"""The runs that a selection chooses, found by the indexed columns of their settings."""

from contextlib import suppress
from dataclasses import dataclass, field

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from zoobench.db.models import SpecRecord
from zoobench.db.specs import LONGEST_NAME, column_text, parsed, spec_from
from zoobench.errors import StorageError
from zoobench.spec import AXES, Ref, RunSelection, RunSpec

PLACE = "in the database"


@dataclass(frozen=True)
class Choice:
    """A choice of runs: conditions that narrow a statement on `specs`, and references where those are too weak.

    Attributes:
        exact: the references of axes with a text that is longer than its column.
    """

    conditions: tuple[ColumnElement[bool], ...] = ()
    exact: dict[str, set[Ref]] = field(default_factory=dict)

    def holds(self, spec: RunSpec) -> bool:
        """Whether a run that fits the conditions is chosen."""
        return all(getattr(spec, axis) in refs for axis, refs in self.exact.items())


def choose(session: Session, selection: RunSelection) -> Choice:
    """The choice that a selection makes among the runs of a database.

    Raises:
        UnknownNameError: a name or glob that fits no run; suggests the nearest.
        UsageError: a version or parameters that no run has.
    """
    conditions, exact = [], {}
    for axis in AXES:
        if not getattr(selection, axis) or not (known := _refs(session, axis)):
            continue
        wanted = selection.wanted(axis, known, PLACE)
        texts = {column_text(ref) for ref in wanted}
        conditions.append(getattr(SpecRecord, axis).in_(sorted(texts)))
        if any(len(text) >= LONGEST_NAME for text in texts):
            exact[axis] = wanted
    return Choice(tuple(conditions), exact)


def refuse_nothing(session: Session, selection: RunSelection) -> None:
    """Say that no run is all that a selection asks for, unless it asks for nothing or there is no run at all.

    Raises:
        UsageError: it does.
    """
    if selection.options() and session.scalar(select(SpecRecord.key).limit(1)) is not None:
        raise selection.nothing_left(PLACE)


def _refs(session: Session, axis: str) -> set[Ref]:
    """Every component of an axis that some run has."""
    column = getattr(SpecRecord, axis)
    found: set[Ref] = set()
    for text in session.scalars(select(column).distinct()):
        if (ref := parsed(text)) is not None:
            found.add(ref)
        else:
            documents = session.execute(select(SpecRecord.key, SpecRecord.document).where(column == text))
            for key, document in documents:
                with suppress(StorageError):  # a damaged run is left out, and told of where runs are read
                    found.add(getattr(spec_from(key, document), axis))
    return found
