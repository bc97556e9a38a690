"""The rank of a run in the queue."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"


def upgrade() -> None:
    """Add the column, 0 for all that are there, and the index by which the next run is found."""
    op.add_column("runs", sa.Column("rank", sa.Integer(), nullable=False, server_default="0"))
    op.create_index("ix_runs_queue", "runs", ["state", "rank", "id"])
