"""Evidence that survives: ledger, roots, accounts, certificates; the first schema of PostgreSQL."""

from __future__ import annotations

from pathlib import Path

from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add tables and renew views of an SQLite database; make everything in one of PostgreSQL."""
    connection = op.get_bind()
    name = f"0005_evidence.{connection.dialect.name}.sql"
    script = (Path(__file__).parent / name).read_text("utf-8")
    _comment, *statements = script.split("\n\n--\n\n")
    for statement in statements:
        connection.exec_driver_sql(statement)
