"""What judging takes: metrics of criticality, uncertainty, checks of the concept, judging again."""

from __future__ import annotations

from pathlib import Path

from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the tables and views; runs and concepts that are there lack what is in them."""
    connection = op.get_bind()
    name = f"0004_judging.{connection.dialect.name}.sql"
    script = (Path(__file__).parent / name).read_text("utf-8")
    _comment, *statements = script.split("\n\n--\n\n")
    for statement in statements:
        connection.exec_driver_sql(statement)
