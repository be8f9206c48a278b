"""Drives of reference drivers in the situations of stored runs."""

from __future__ import annotations

from pathlib import Path

from alembic import op

revision = "0008"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add a table and a view."""
    connection = op.get_bind()
    name = f"0008_benchmarks.{connection.dialect.name}.sql"
    script = (Path(__file__).parent / name).read_text("utf-8")
    _comment, *statements = script.split("\n\n--\n\n")
    for statement in statements:
        connection.exec_driver_sql(statement)
