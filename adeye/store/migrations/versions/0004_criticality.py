"""Metrics of criticality that came later, in a table of their own."""

from __future__ import annotations

from pathlib import Path

from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add a table and join it into ``v_runs``; the runs that are there lack the new metrics."""
    connection = op.get_bind()
    name = f"0004_criticality.{connection.dialect.name}.sql"
    script = (Path(__file__).parent / name).read_text("utf-8")
    _comment, *statements = script.split("\n\n--\n\n")
    for statement in statements:
        connection.exec_driver_sql(statement)
