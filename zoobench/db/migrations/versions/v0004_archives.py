"""The archive of a run that is done, with solutions besides the best."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Make the table of archives."""
    op.create_table(
        "archives",
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id"), primary_key=True),
        sa.Column("data", sa.LargeBinary(), nullable=False),
    )
