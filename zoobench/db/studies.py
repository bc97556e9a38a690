"""Storage of studies: each is carried out any number of times, its rows written one by one as they are done."""

import hashlib
import json
import logging
import time
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from zoobench.db.engine import Database
from zoobench.db.models import ProvenanceRecord, StudyRecord, StudyRowRecord
from zoobench.db.rows import StudyRow, StudyRun, ValueKind, document_of, encode_value
from zoobench.spec import canonical_json

_LOG = logging.getLogger(__name__)


def keep_provenance(database: Database, session: Session, provenance: Mapping[str, Any]) -> str:
    """Store a provenance unless it is there, and return its hash."""
    document = canonical_json(dict(provenance))
    values = {"hash": hashlib.sha256(document.encode()).hexdigest(), "document": document}
    session.execute(database.insert(ProvenanceRecord).values(values).on_conflict_do_nothing())
    return values["hash"]


def carry_out(
    database: Database, name: str, rows: Iterable[StudyRow], provenance: Mapping[str, Any]
) -> Iterator[StudyRow]:
    """Hand on the rows of a study, each of which is stored for good before."""
    with database.write() as session:
        study = StudyRecord(
            name=name, provenance_hash=keep_provenance(database, session, provenance), started_at=time.time()
        )
        session.add(study)
        session.flush()
        study_id = study.id
    for number, row in enumerate(rows):
        with database.write() as session:
            session.add(
                StudyRowRecord(
                    study_id=study_id,
                    number=number,
                    case_name=row.case,
                    verdict=row.verdict,
                    document=json.dumps(_plain(row.document), allow_nan=False),
                    finished_at=time.time(),
                )
            )
        yield row
    with database.write() as session:
        session.get_one(StudyRecord, study_id).finished_at = time.time()


def load_studies(database: Database, name: str) -> list[StudyRun]:
    """All studies of that name, oldest first."""
    statement = (
        select(StudyRecord, ProvenanceRecord.document)
        .join(ProvenanceRecord, ProvenanceRecord.hash == StudyRecord.provenance_hash)
        .where(StudyRecord.name == name)
        .order_by(StudyRecord.id)
    )
    with database.read() as session:
        return [
            StudyRun(
                id=record.id,
                name=record.name,
                started_at=record.started_at,
                finished_at=record.finished_at,
                provenance=document_of(document),
                rows=_rows(session, record.id),
            )
            for record, document in session.execute(statement)
        ]


def _rows(session: Session, study_id: int) -> tuple[StudyRow, ...]:
    statement = select(StudyRowRecord).where(StudyRowRecord.study_id == study_id).order_by(StudyRowRecord.number)
    found = []
    for record in session.scalars(statement):
        document = document_of(record.document)
        if document or record.document == "{}":
            found.append(StudyRow(record.case_name, record.verdict, document, record.finished_at))
        else:
            _LOG.warning("Row %d of study %d is damaged. It is left out.", record.number, study_id)
    return tuple(found)


def _plain(value: Any) -> Any:
    """The value with numbers that JSON cannot hold as words."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        number, kind = encode_value(value)
        return number if kind is ValueKind.FINITE else str(kind)
    return value
