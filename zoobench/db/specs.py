"""Settings of runs from the columns of their table, many at a time.

The columns of `specs` are there to be searched, and its `document` is what a run's settings are. To read a document
takes ten times as long as to read columns, and those say the same unless a text was too long for them. Whether they do
is seen by the key, which is a hash of the document: what does not fit it is read from the document.
"""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, case, func, or_

from zoobench.db.models import SpecRecord
from zoobench.db.rows import storable
from zoobench.errors import StorageError, UsageError
from zoobench.spec import AXES, Budget, Ref, RunSpec, canonical_json, plain

LONGEST_NAME = 200  # of the columns that are there to be searched; the document has it whole

CellColumns = tuple[Any, ...]
"""The values of `CELL_COLUMNS`."""

CELL_COLUMNS = tuple(getattr(SpecRecord, name) for name in (*AXES, "frames", "budget_kind", "budget_amount"))
"""What the runs of a cell share."""


def long_document() -> ColumnElement[str | None]:
    """The document of a spec with a text that its column may not hold whole, else NULL."""
    is_long = or_(*(func.length(getattr(SpecRecord, axis)) >= LONGEST_NAME for axis in AXES))
    return case((is_long, SpecRecord.document), else_=None)


class _Cell(NamedTuple):
    """The settings that the runs of a cell share, and the canonical text of their documents around the seed."""

    spec: RunSpec
    head: str
    tail: str


class SpecReader:
    """Settings of runs; those of one cell share their references.

    `document` gives the document of a key, where the columns are not enough.
    """

    def __init__(self, document: Callable[[str], str]) -> None:
        self._document = document
        self._cells: dict[CellColumns, _Cell | None] = {}
        self._refs: dict[str, tuple[Ref, str]] = {}
        self._from_documents: dict[RunSpec, RunSpec] = {}

    def __call__(self, key: str, seed: int, columns: CellColumns, long: str | None = None) -> RunSpec:
        """The settings of a run by its key, its seed, the `CELL_COLUMNS` and `long_document`."""
        return replace(self.cell(key, seed, columns, long), seed=seed)

    def cell(self, key: str, seed: int, columns: CellColumns, long: str | None = None) -> RunSpec:
        """The same with the seed 0: one object for all runs of a cell."""
        if long is None:
            if columns not in self._cells:
                self._cells[columns] = self._read(columns)
            cell = self._cells[columns]
            if cell is not None and hashlib.sha256(f"{cell.head}{seed}{cell.tail}".encode()).hexdigest() == key:
                return cell.spec
        read = replace(spec_from(key, self._document(key) if long is None else long), seed=0)
        return self._from_documents.setdefault(read, read)

    def _read(self, columns: CellColumns) -> _Cell | None:
        """The cell as its columns give it; None if they cannot be read."""
        *names, frames, kind, amount = columns
        try:
            known = {axis: self._ref(name) for axis, name in zip(AXES, names, strict=True)}
            env, task, design, controller, method, fidelity = (ref for ref, _ in known.values())
            spec = RunSpec(env, task, design, controller, method, 0, Budget(kind, amount), fidelity, frames)
            amount_text = canonical_json(float(amount))
        except (UsageError, ValueError):  # a text with a comma in a parameter, or a number that JSON cannot hold
            return None
        # the keys of a canonical document are sorted
        texts = {axis: f'"{axis}":{text}' for axis, (_, text) in known.items()}
        axes = ",".join((texts["controller"], texts["design"], texts["env"], texts["fidelity"]))
        head = f'{{"budget":{{"amount":{amount_text},"kind":"{kind}"}},{axes},"frames":{frames},{texts["method"]},'
        return _Cell(spec, f'{head}"schema":{spec.schema},"seed":', f",{texts['task']}}}")

    def _ref(self, name: str) -> tuple[Ref, str]:
        """The component that a column holds, with its canonical text."""
        if name not in self._refs:
            ref = Ref.parse(name)
            self._refs[name] = (ref, canonical_json(plain(ref)))
        return self._refs[name]


def column_text(ref: Ref) -> str:
    """A component as the columns hold it."""
    return str(storable(str(ref)))[:LONGEST_NAME]


def parsed(text: str) -> Ref | None:
    """The component that a column holds; None if it does not hold it whole, or it cannot be read."""
    try:
        return Ref.parse(text) if len(text) < LONGEST_NAME else None
    except UsageError:  # a comma within a parameter
        return None


def spec_from(key: str, document: str) -> RunSpec:
    """The settings of the run with this key, as its document states them.

    Raises:
        StorageError: they are not those that were stored.
    """
    if hashlib.sha256(document.encode(errors="replace")).hexdigest() != key:
        raise StorageError(
            f"The settings of the run {key[:12]} are damaged: their sha256 is not its key. `zoobench doctor --full` "
            "lists all that is damaged. Restore the database from a copy, or name another with --db."
        )
    data: Mapping[str, Any] = json.loads(document)
    return RunSpec.from_dict(data)
