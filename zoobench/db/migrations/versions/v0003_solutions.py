"""The solution of a run that is done."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """Make the table of solutions."""
    op.create_table(
        "solutions",
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id"), primary_key=True),
        sa.Column("params", sa.LargeBinary(), nullable=False),
    )
