"""Decompositions, dependent failures and relations of elements; one view for each check."""

from __future__ import annotations

from pathlib import Path

from alembic import op

revision = "0006"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add four tables and the views; concepts that are there use none of the new keys."""
    connection = op.get_bind()
    name = f"0006_checks.{connection.dialect.name}.sql"
    script = (Path(__file__).parent / name).read_text("utf-8")
    _comment, *statements = script.split("\n\n--\n\n")
    for statement in statements:
        connection.exec_driver_sql(statement)
