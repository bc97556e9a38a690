"""Storage of reference scores, which runs share: of several that need one, the first computes it."""

from sqlalchemy import select

from zoobench.db.engine import Database
from zoobench.db.lifecycle import why_lost
from zoobench.db.models import ReferenceRecord, RunRecord
from zoobench.db.rows import Claim, RunState, SharedScore, decode_value, encode_value


def ask_for(database: Database, claim: Claim, key: str) -> SharedScore:
    """The reference score under this key, or whose turn it is to compute it.

    It is the turn of the first that asks, as long as its attempt goes on; then of the next.
    """
    with database.write() as session:
        mine = {"run_id": claim.run_id, "attempt": claim.attempt}
        session.execute(database.insert(ReferenceRecord).values(key=key, **mine).on_conflict_do_nothing())
        record = session.scalars(select(ReferenceRecord).where(ReferenceRecord.key == key).with_for_update()).one()
        if record.kind is not None:
            return SharedScore(decode_value(record.value, record.kind), record.unit or "")
        run = session.get_one(RunRecord, record.run_id)
        is_under_way = run.state == RunState.RUNNING and run.attempt == record.attempt and why_lost(run) is None
        if not is_under_way:
            record.run_id, record.attempt = claim.run_id, claim.attempt
        return SharedScore(is_ours=(record.run_id, record.attempt) == (claim.run_id, claim.attempt))


def keep(database: Database, claim: Claim, key: str, number: float, unit: str) -> None:
    """Store a reference score for all runs; of two that computed it the first stays, as both must agree."""
    value, kind = encode_value(number)
    contents = {"run_id": claim.run_id, "attempt": claim.attempt, "value": value, "kind": kind, "unit": unit}
    with database.write() as session:
        insert = database.insert(ReferenceRecord).values(key=key, **contents)
        unknown = ReferenceRecord.kind.is_(None)
        session.execute(insert.on_conflict_do_update(index_elements=["key"], set_=contents, where=unknown))
