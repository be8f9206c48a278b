"""Minimal-risk manoeuvres of a supervisor: which is asked for, and which is in force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from adeye.kernel.jit import inlined
from adeye.kernel.refuge_stops import ANYWHERE, ONLY_REST_AREA, ROADSIDE
from adeye.kernel.refuges import REST_AREA as REST_AREA_KIND
from adeye.signals import REFUGE_KIND, REFUGE_S
from adeye.spec.supervisor import MANOEUVRES

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats

NONE, CONTINUE, REST_AREA, ROADSIDE_PARKING, STOP = range(5)
"""No manoeuvre, and those of ``spec.supervisor.MANOEUVRES`` in their order."""

assert len(MANOEUVRES) == STOP

# Columns of the settings.
(
    SET_EVERY,  # ticks of the channel from one evaluation of the monitors to the next
    SET_PATIENCE,  # [s]
    SET_LEAST,  # how far ahead a rest area must be [m]
    SET_SIGHT,  # how far ahead the map is searched [m]
    SET_OF_LEVEL,  # manoeuvre of level 1; those of the others follow
) = range(5)
SET_ROW: Final = 8

# Columns of the state.
(
    FORCE_ASKED,  # manoeuvre that the highest level asks for
    FORCE_HELD,  # that which is in force
    FORCE_WAITED,  # since it is [s]
    FORCE_LEVEL,  # highest level among the confirmed monitors, 0 for none
    FORCE_LEFT,  # ticks until the monitors are asked again
) = range(5)
FORCE_ROW: Final = 5


class Force(NamedTuple):
    """What decides about manoeuvres.

    Attributes:
        settings: (B, SET_ROW).
        state: (B, FORCE_ROW) in and out.
    """

    settings: Floats
    state: Floats


@inlined
def ask(state: Floats, settings: Floats, stopping: bool, period: float) -> None:  # noqa: FBT001 - a kernel
    """Take the manoeuvre that the level asks for.

    What has given way stays so while the level is the same; a lower level begins anew. Once the
    channel has taken over, the manoeuvre only becomes harder.

    Args:
        state: (FORCE_ROW,) in and out.
        settings: (SET_ROW,).
        stopping: Whether the channel has taken over.
        period: Since the previous call [s].
    """
    level = int(state[FORCE_LEVEL])
    asked = settings[SET_OF_LEVEL + level - 1] if level > 0 else float(NONE)
    held = state[FORCE_HELD]
    begins_anew = asked < state[FORCE_ASKED] and not stopping
    wanted = asked if begins_anew else max(held, asked)
    state[FORCE_ASKED], state[FORCE_HELD] = asked, wanted
    state[FORCE_WAITED] = (
        state[FORCE_WAITED] + period if wanted == held and not begins_anew else 0.0
    )


@inlined
def give_way(state: Floats, settings: Floats, has_rest_area: bool, has_parking: bool) -> None:  # noqa: FBT001 - a kernel
    """Let what cannot be had, or not in time, give way to the next manoeuvre.

    Args:
        state: (FORCE_ROW,) in and out.
        settings: (SET_ROW,).
        has_rest_area: Whether the map shows one ahead.
        has_parking: Whether the map shows a place to park at the side ahead.
    """
    if state[FORCE_HELD] == REST_AREA and not (has_rest_area and _is_patient(state, settings)):
        state[FORCE_HELD], state[FORCE_WAITED] = ROADSIDE_PARKING, 0.0
    if state[FORCE_HELD] == ROADSIDE_PARKING and not (has_parking and _is_patient(state, settings)):
        state[FORCE_HELD], state[FORCE_WAITED] = STOP, 0.0


@inlined
def look_ahead(settings: Floats, refuges: Floats, s: float) -> int:
    """Return the best kind of place to stop in that the map shows ahead.

    Args:
        settings: (SET_ROW,).
        refuges: (R, 5) parking bays and rest areas, see ``signals.REFUGE_COLUMNS``.
        s: Of the ego along the road [m].

    Returns:
        ``ONLY_REST_AREA``, ``ROADSIDE`` for a parking bay, ``ANYWHERE`` for neither.
    """
    best = ANYWHERE
    for row in range(refuges.shape[0]):
        ahead = refuges[row, REFUGE_S] - s
        if settings[SET_LEAST] < ahead <= settings[SET_SIGHT]:
            is_rest_area = refuges[row, REFUGE_KIND] == REST_AREA_KIND
            best = max(best, ONLY_REST_AREA if is_rest_area else ROADSIDE)
    return best


@inlined
def _is_patient(state: Floats, settings: Floats) -> bool:
    return bool(state[FORCE_WAITED] <= settings[SET_PATIENCE] + 1e-9)


@inlined
def show_manoeuvre(state: Floats, shown: Bools) -> None:
    """Write the columns of the manoeuvres (3, 2): asked for, and in force."""
    for row in range(3):
        shown[row, 0] = state[FORCE_ASKED] == REST_AREA + row
        shown[row, 1] = state[FORCE_HELD] == REST_AREA + row
