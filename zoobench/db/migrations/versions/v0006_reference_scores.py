"""Reference scores, which the runs of a cell share."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Make the table of reference scores."""
    op.create_table(
        "reference_scores",
        sa.Column("key", sa.String(length=64), primary_key=True),
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id"), nullable=False),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("value", sa.Double(), nullable=True),
        sa.Column("kind", sa.String(length=8), nullable=True),
        sa.Column("unit", sa.String(length=30), nullable=True),
    )
