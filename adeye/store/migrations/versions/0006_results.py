"""Results that runs repeat, and implications whose antecedent never held."""

from __future__ import annotations

from pathlib import Path

from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add tables and renew views."""
    connection = op.get_bind()
    name = f"0006_results.{connection.dialect.name}.sql"
    script = (Path(__file__).parent / name).read_text("utf-8")
    _comment, *statements = script.split("\n\n--\n\n")
    for statement in statements:
        connection.exec_driver_sql(statement)
