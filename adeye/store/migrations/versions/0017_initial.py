"""Where upgrades begin: a new database is made from the code that describes it."""

from __future__ import annotations

revision = "0017"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Do nothing: nothing comes before it."""
