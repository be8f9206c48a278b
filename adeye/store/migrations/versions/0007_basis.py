"""What it takes to judge a run again without its trace."""

from __future__ import annotations

from pathlib import Path

from alembic import op

revision = "0007"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add four tables; the runs that are there have no rows in them."""
    connection = op.get_bind()
    name = f"0007_basis.{connection.dialect.name}.sql"
    script = (Path(__file__).parent / name).read_text("utf-8")
    _comment, *statements = script.split("\n\n--\n\n")
    for statement in statements:
        connection.exec_driver_sql(statement)
