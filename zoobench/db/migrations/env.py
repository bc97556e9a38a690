"""Alembic's entry: runs the revisions on the connection that `zoobench.db.schema` hands over."""

from alembic import context

from zoobench.db.models import Base

context.configure(connection=context.config.attributes["connection"], target_metadata=Base.metadata)
with context.begin_transaction():
    context.run_migrations()
