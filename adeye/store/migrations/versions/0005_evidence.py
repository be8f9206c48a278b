"""What evidence takes: certificates of determinism."""

from __future__ import annotations

from pathlib import Path

from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table; campaigns that are there have no certificate."""
    connection = op.get_bind()
    name = f"0005_evidence.{connection.dialect.name}.sql"
    script = (Path(__file__).parent / name).read_text("utf-8")
    _comment, *statements = script.split("\n\n--\n\n")
    for statement in statements:
        connection.exec_driver_sql(statement)
