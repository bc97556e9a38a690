"""A digest of every run that has ended."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    """Add the column; runs that have ended before have none."""
    op.add_column("runs", sa.Column("digest", sa.String(length=64), nullable=True))
