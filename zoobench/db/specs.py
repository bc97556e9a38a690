"""Settings of runs from the columns of their table, many at a time.

The columns of `specs` are there to be searched, and its `document` defines a run's settings. To read a
document takes ten times as long as to read columns, and those say the same unless a text was too long for them. The
key, a hash of the document, shows whether they do: settings whose columns do not fit it are read from the document.
Where that does not fit either, the run is left out and the others are read.
"""

import hashlib
import json
import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from sqlalchemy import ColumnElement, case, func, or_

from zoobench.db.models import SpecRecord
from zoobench.db.rows import storable
from zoobench.errors import StorageError, UsageError
from zoobench.spec import AXES, Budget, Ref, RunSpec, canonical_json, plain

_LOG = logging.getLogger(__name__)

LONGEST_NAME = 200  # of the columns that are there to be searched; the document has it whole

CellColumns = tuple[Any, ...]
"""The values of `CELL_COLUMNS`."""

CELL_COLUMNS = tuple(getattr(SpecRecord, name) for name in (*AXES, "frames", "budget_kind", "budget_amount"))
"""The columns that the runs of a cell share."""


def long_document() -> ColumnElement[str | None]:
    """The document of a spec with a text that its column may not hold whole, else NULL."""
    is_long = or_(*(func.length(getattr(SpecRecord, axis)) >= LONGEST_NAME for axis in AXES))
    return case((is_long, SpecRecord.document), else_=None)


_REMEDY = "`zoobench doctor --repair` repairs what can be repaired; else restore the database from a copy."

_told: set[str] = set()
"""Keys of damaged runs that a word was said about."""


class _Cell(NamedTuple):
    """The settings that the runs of a cell share, and the canonical text of their documents around the seed."""

    spec: RunSpec
    head: str
    tail: str


class SpecReader:
    """Settings of runs; those of one cell share their references, and those that are damaged are None, with a word.

    `document` gives the document of a key, where the columns are not enough.
    """

    def __init__(self, document: Callable[[str], str]) -> None:
        self._document = document
        self._cells: dict[CellColumns, _Cell | None] = {}
        self._refs: dict[str, tuple[Ref, str]] = {}
        self._from_documents: dict[RunSpec, RunSpec] = {}

    def cell(self, key: str, seed: int, columns: CellColumns, long: str | None) -> RunSpec | None:
        """The settings of a run by its key, its seed, the `CELL_COLUMNS` and `long_document`.

        They have the seed 0: one object for all runs of a cell.
        """
        if long is None and (cell := self.columns_cell(key, seed, columns)) is not None:
            return cell
        try:
            read = replace(spec_from(key, self._document(key) if long is None else long), seed=0)
        except StorageError as error:
            if key not in _told:
                _told.add(key)
                _LOG.warning("%s The run is left out.", error)
            return None
        return self._from_documents.setdefault(read, read)

    def columns_cell(self, key: str, seed: int, columns: CellColumns) -> RunSpec | None:
        """The same by the columns alone; None if they are not those of the key."""
        if columns not in self._cells:
            self._cells[columns] = self._read(columns)
        cell = self._cells[columns]
        is_proved = cell is not None and digest_of(f"{cell.head}{seed}{cell.tail}") == key
        return cell.spec if cell is not None and is_proved else None

    def _read(self, columns: CellColumns) -> _Cell | None:
        """The cell as its columns give it; None if they cannot be read."""
        *names, frames, kind, amount = columns
        try:
            known = {axis: self._ref(name) for axis, name in zip(AXES, names, strict=True)}
            env, task, design, controller, method, fidelity = (ref for ref, _ in known.values())
            spec = RunSpec(env, task, design, controller, method, 0, Budget(kind, amount), fidelity, frames)
            amount_text = canonical_json(float(amount))
        except (UsageError, ValueError, TypeError):  # a comma in a parameter, or a number that JSON cannot hold
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
    if digest_of(document) != key:
        raise StorageError(f"The settings of the run {key[:12]} are damaged: their sha256 is not its key. {_REMEDY}")
    try:
        data: Mapping[str, Any] = json.loads(document)
        return RunSpec.from_dict(data)
    except (UsageError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise StorageError(
            f"The settings of the run {key[:12]} are none that zoobench wrote: {error}. {_REMEDY}"
        ) from None


def spec_of(row: Mapping[str, Any]) -> RunSpec:
    """The settings in a row of `specs`, by whichever of its document and its other columns has the sha256 of its key.

    Raises:
        StorageError: neither has.
    """
    try:
        return spec_from(row["key"], str(row["document"]))
    except StorageError:
        columns = tuple(row[column.key] for column in CELL_COLUMNS)
        if (cell := SpecReader(lambda _: "").columns_cell(row["key"], row["seed"], columns)) is None:
            raise
        return replace(cell, seed=row["seed"])


def spec_columns(key: str, spec: RunSpec) -> dict[str, Any]:
    """The row of `specs` for a run."""
    return {
        "key": key,
        "document": canonical_json(spec.to_dict()),
        **{name: column_text(getattr(spec, name)) for name in AXES},
        "seed": spec.seed,
        "frames": spec.frames,
        "budget_kind": spec.budget.kind,
        "budget_amount": spec.budget.amount,
    }


def digest_of(document: str) -> str:
    """The key of the run whose settings are in this document."""
    return hashlib.sha256(document.encode(errors="replace")).hexdigest()
