"""Sweeps, and indexes for the queries of reports and launchers."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Make the tables of sweeps and the indexes."""
    op.create_table(
        "sweeps",
        sa.Column("id", sa.Integer(), primary_key=True),
        sa.Column("created_at", sa.Double(), nullable=False),
    )
    op.create_table(
        "sweep_runs",
        sa.Column("sweep_id", sa.Integer(), sa.ForeignKey("sweeps.id"), primary_key=True),
        sa.Column("run_id", sa.Integer(), sa.ForeignKey("runs.id"), primary_key=True),
    )
    op.create_index(op.f("ix_specs_controller"), "specs", ["controller"], unique=False)
    op.create_index(op.f("ix_specs_fidelity"), "specs", ["fidelity"], unique=False)
    op.create_index(op.f("ix_runs_finished_at"), "runs", ["finished_at"], unique=False)
