"""Numbers of runs: what metrics, verdicts and events refer to, in the order in which runs came in.

A digest falls anywhere into an index; with a number, the rows of a block lie one after the other.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from adeye.errors import IntegrityError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sqlalchemy import Connection

    from adeye.signals import Ints


def next_number(connection: Connection) -> int:
    """Return the number that the next run gets, in a write transaction."""
    last = connection.exec_driver_sql("SELECT max(number) FROM run").scalar()
    return 1 if last is None else int(last) + 1


def run_numbers(connection: Connection, digests: Sequence[str]) -> Ints:
    """Look up the numbers (B,) of runs.

    Raises:
        IntegrityError: One of them is not in the database.
    """
    found = connection.exec_driver_sql(
        "SELECT result_digest, number FROM run "
        "WHERE result_digest IN (SELECT value FROM json_each(?))",
        (json.dumps(digests),),
    )
    numbers = {str(item.result_digest): int(item.number) for item in found}
    missing = next((digest for digest in digests if digest not in numbers), None)
    if missing is not None:
        raise IntegrityError(f"run {missing[:12]} is not in the database. Execute it first.")
    return np.array([numbers[digest] for digest in digests], dtype=np.int64)
