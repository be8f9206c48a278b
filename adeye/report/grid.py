"""The grid map of a run as the replay draws it: ratings of the ground, and when it is occupied."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.evaluation.grid import OBJECTS, TRUTH, GridMap, grid_at
from adeye.evaluation.safe_stop import ratings_of
from adeye.report.replay import GridView
from adeye.spec.channels import SafetyChannel
from adeye.spec.grid import GridSettings, rating_costs
from adeye.trace import NO_TRACKS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from adeye.trace import Trace

PERIOD: Final = 0.25
"""Time between two maps of the ground that are drawn [s]; it does not move, the window does."""

MOST: Final = 60_000
"""Characters of all maps of a run, kept to by drawing fewer of those of what moves."""

TIMES: Final = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Times to occupancy that are told apart [s]; up to the first the cell is occupied now."""


def grid_of(trace: Trace, run: int, held: Any) -> GridView:
    """Return the grid maps of a run that are drawn.

    The objects are those of the safety channel, or the truth where it shows no tracks. Numbers are
    its ratings of the ground.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        held: (rows,) row of the trace that each row of the replay shows.
    """
    every = max(1, math.ceil(PERIOD / trace.layout.context.step - 1e-6))
    ratings = ratings_of(trace.layout.architectures[run])
    ground = rating_costs(ratings).model_copy(update={"rules": ()})
    settings = GridSettings(costs=ground)
    view = view_of(trace, run)
    rows = range(len(held))
    grounds = [grid_at(trace, run, row, settings, layers=["number"]) for row in rows[::every]]
    levels = sorted({float(value) for item in grounds for value in np.unique(item["number"])})
    number = packed([np.searchsorted(levels, item["number"]) for item in grounds])
    room = MOST - sum(len(text) for text in number)
    codes = [
        occupancy(grid_at(trace, run, row, settings, view=view, layers=OBJECTS)) for row in rows
    ]
    for occupied_every in range(1, every + 1):
        occupied = packed(codes[::occupied_every])
        if sum(len(text) for text in occupied) <= room:
            break
    first = grounds[0]
    return GridView(
        every=every,
        occupied_every=occupied_every,
        view=view,
        cell_m=first.cell,
        x_m=float(first.x[0]) - 0.5 * first.cell,
        y_m=float(first.y[0]) - 0.5 * first.cell,
        columns=len(first.x),
        rows=len(first.y),
        levels=tuple(levels),
        worst=ground.blocked,
        times_s=TIMES,
        number=number,
        occupied=occupied,
    )


def view_of(trace: Trace, run: int) -> str:
    """Return whose objects are drawn: the first safety channel's that shows tracks, or the truth.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
    """
    channels = trace.layout.architecture.channels
    for index, name in enumerate(trace.layout.channels):
        shows = trace["false_tracks"][run, : trace.length[run], index] != NO_TRACKS
        if isinstance(channels.get(name), SafetyChannel) and shows.any():
            return name
    return TRUTH


def occupancy(found: GridMap) -> NDArray[np.int64]:
    """Return by which of ``TIMES`` each cell is occupied, counted from 1; 0 for never."""
    times = np.where(found["static"] > 0.0, 0.0, found["time_to_occupancy"])
    code = np.searchsorted(np.array(TIMES), times) + 1
    return np.where(code > len(TIMES), 0, code)


def packed(maps: Sequence[NDArray[Any]]) -> tuple[str, ...]:
    """Pack the codes of the cells of maps as one text each.

    Cells follow one another from the back to the front, and rows from the right to the left. Each
    code is taken exclusive-or with that of the cell to its right, because lanes are long rows, and
    equal ones are counted: a letter for the code, ``a`` for 0, and how often it repeats, if more
    than once. Where that is shorter, a map is first taken exclusive-or with the one before; its
    text begins with a plus.

    Args:
        maps: (X, Y) codes from 0 to 15.

    >>> one, other = np.array([[1, 1], [1, 1], [0, 2]]), np.array([[1, 1], [1, 1], [2, 0]])
    >>> packed([one, other, other])
    ('b2a3c', 'b2ca2c', '+a6')
    """
    made = []
    before: NDArray[Any] | None = None
    for codes in maps:
        text = _runs(codes)
        if before is not None:
            change = f"+{_runs(codes ^ before)}"
            text = change if len(change) < len(text) else text
        made.append(text)
        before = codes
    return tuple(made)


def _runs(codes: NDArray[Any]) -> str:
    rows = codes.T
    changed = rows.copy()
    changed[1:] ^= rows[:-1]
    flat = changed.ravel()
    starts = np.flatnonzero(np.diff(flat, prepend=-1))
    counts = np.diff(starts, append=len(flat))
    return "".join(
        f"{chr(ord('a') + code)}{count if count > 1 else ''}"
        for code, count in zip(flat[starts].tolist(), counts.tolist(), strict=True)
    )
