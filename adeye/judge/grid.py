"""The grid map of a run at one tick: layers of cells around the ego, and one number for each cell.

What the map says is known; what moves is either the truth, or what a channel believed. The places
are rated by the function of the planner of safe stops, and predicted by that of the channels, so
the map shows what they reckon with. It is made from the trace and drives nothing.
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye import signals as columns
from adeye.errors import UsageError, suggest
from adeye.judge.safe_stop import ratings_of
from adeye.kernel.elementary import sin_cos
from adeye.kernel.grid import count_cover, cover_at, fill_ground, sweep
from adeye.kernel.stops import RULE_NAMES, RULE_OFF_ROAD, RULE_SHOULDER, STOP_INTERVAL
from adeye.spec.grid import CellCosts, GridSettings, rating_costs

if TYPE_CHECKING:
    from collections.abc import Collection

    from numpy.typing import NDArray

    from adeye.signals import Floats
    from adeye.trace import Trace

TRUTH: Final = "truth"
"""View of the objects as they are."""

LAYERS: Final = {
    "static": "height of a static object [m], 0 where none is; NaN in the view of a channel, which "
    "cannot tell it from one that stands",
    "drivable": "the centre is on a lane, the shoulder, a parking bay, a rest area or free verge",
    "time_to_occupancy": "when a moving object is first predicted to be in the cell [s], 0 where "
    "one is now, inf for never within the horizon",
    "ego": "the ego covers a part of the cell",
    "lane": "number of the lane of the centre, 0 for the rightmost, -1 off the lanes",
    "shoulder": "the centre is on the hard shoulder",
    "parking": "row in the map's refuges of the parking bay of the centre, -1 for none",
    "rest_area": "row in the map's refuges of the rest area of the centre, -1 for none",
    "sensors": "how many living sensors cover the centre, by mount, field of view and range",
    "place": "kind of place of the centre, stop_rating.RULE_NAMES",
    "number": "rating or cost of standing there",
    "blocked": "the number is that of a blocked cell, or greater",
}
"""Layers of a grid map."""

OBJECTS: Final = ("static", "time_to_occupancy")
"""Layers of what occupies cells."""

_OBJECTS: Final = frozenset(OBJECTS)
_VEHICLE: Final = frozenset({"ego", "sensors"})
_RATED: Final = frozenset({"number", "blocked"})


@dataclass(frozen=True)
class GridMap:
    """Layers of one run at one tick.

    Attributes:
        time: Of the tick [s].
        view: ``truth`` or the channel whose tracks are drawn.
        ego: x [m], y [m] and heading [rad] of the ego's frame in the map.
        x: (X,) centres of the cells ahead of the ego's centre [m].
        y: (Y,) to its left [m].
        cell: Edge of a cell [m].
        layers: (X, Y) arrays by name, see ``LAYERS``.
        costs: How ``number`` is made.
    """

    time: float
    view: str
    ego: tuple[float, float, float]
    x: Floats
    y: Floats
    cell: float
    layers: dict[str, NDArray[Any]]
    costs: CellCosts

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a layer by its name."""
        return self.layers[name]

    def archive(self) -> bytes:
        """Give layers, axes, pose of the ego and names of the places as a NumPy archive."""
        file = io.BytesIO()
        np.savez_compressed(
            file,
            allow_pickle=False,
            x=self.x,
            y=self.y,
            pose=np.array(self.ego),
            time=np.array(self.time),
            view=np.array(self.view),
            place_names=np.array(RULE_NAMES),
            **self.layers,
        )
        return file.getvalue()


def grid_map(
    trace: Trace,
    run: int,
    time: float,
    settings: GridSettings | None = None,
    *,
    view: str = TRUTH,
) -> GridMap:
    """Make the grid map of a run at a time.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        time: Within the run; the tick nearest to it is taken [s].
        settings: Window, cells and costs; None for the defaults.
        view: ``truth``, or a channel that shows its tracks. What it believes has a place, a speed
            and a size, but no class and no braking: its tracks keep to lanes and their speed, and
            the time of prediction counts from its observation.

    Raises:
        UsageError: The run has no such time, or there is no such view.
    """
    rows = int(trace.length[run])
    end = float(trace.time[rows - 1])
    if not 0.0 <= time <= end:
        raise UsageError(f"the run has no {time:g} s", remedy=f"Give a time from 0 to {end:g} s.")
    return grid_at(trace, run, round(time / trace.layout.context.step), settings, view=view)


def grid_at(
    trace: Trace,
    run: int,
    row: int,
    settings: GridSettings | None = None,
    *,
    view: str = TRUTH,
    layers: Collection[str] = tuple(LAYERS),
) -> GridMap:
    """Make the grid map of a run at a row of its trace, see ``grid_map``.

    Args:
        trace: The batch that the run is in.
        run: Its row in the batch.
        row: Of the trace.
        settings: As for ``grid_map``.
        view: As for ``grid_map``.
        layers: Those that are wanted; what others cost is saved.

    Raises:
        UsageError: There is no such view.
    """
    wanted = settings or GridSettings()
    costs = wanted.costs or rating_costs(ratings_of(trace.layout.architectures[run]))
    needed = frozenset(layers)
    if costs.rules and needed & _RATED:
        # A rule may look at any layer.
        needed = frozenset(LAYERS)
    made = _Making(trace, run, row, wanted)
    if needed - _OBJECTS - _VEHICLE:
        made.lay_ground(costs)
    if needed & _OBJECTS and view == TRUTH:
        made.lay_truth()
    elif needed & _OBJECTS:
        made.lay_tracks(_channel(trace, view))
    if needed & _VEHICLE:
        made.lay_ego_and_sensors()
    if needed & _RATED:
        made.apply(costs)
    return GridMap(
        time=float(trace.time[row]),
        view=view,
        ego=(float(made.ego[0]), float(made.ego[1]), float(made.ego[2])),
        x=made.x,
        y=made.y,
        cell=wanted.cell,
        layers={name: made.layers[name] for name in layers},
        costs=costs,
    )


def _channel(trace: Trace, view: str) -> int:
    channels = trace.layout.channels
    if view in channels and trace["tracks"].shape[3] == 0:
        raise UsageError(
            "the trace has no tracks", remedy="Execute the run again with drawn=True, or use truth."
        )
    if view not in channels:
        known = [TRUTH, *channels]
        raise UsageError(
            f"there is no view {view!r}", remedy=f"{suggest(view, known)} It is truth or a channel."
        )
    return channels.index(view)


class _Making:
    """A grid map in the making: its frame and its layers so far."""

    def __init__(self, trace: Trace, run: int, row: int, settings: GridSettings) -> None:
        self._trace, self._run, self._row, self._settings = trace, run, row, settings
        cell = settings.cell
        along = math.ceil((settings.ahead + settings.behind) / cell - 1e-9)
        across = math.ceil(settings.width / cell - 1e-9)
        self.x = (np.arange(along) + 0.5) * cell - settings.behind
        self.y = (np.arange(across) + 0.5) * cell - 0.5 * settings.width
        self.ego = trace["ego"][
            run, row, [columns.EGO_X, columns.EGO_Y, columns.EGO_HEADING]
        ].astype(np.float64)
        self.layers: dict[str, NDArray[Any]] = {}
        self._ground = trace.layout.context.road.ground(run)

    @property
    def _cells(self) -> tuple[Floats, Floats, float]:
        return self.x, self.y, self._settings.cell

    def _layer(self, value: float) -> Floats:
        return np.full((len(self.x), len(self.y)), value)

    def lay_ground(self, costs: CellCosts) -> None:
        """Tell what the map knows of each cell, and what its ground counts."""
        place, lane, refuge = (self._layer(0).astype(np.int64) for _ in range(3))
        number = self._layer(0.0)
        fill_ground(
            np.array(costs.table()),
            self._ground,
            self.ego,
            self.x,
            self.y,
            self._settings.cell,
            place,
            lane,
            refuge,
            number,
        )
        kinds = [
            columns.REFUGE_KINDS[int(kind)] for kind in self._ground.refuges[:, columns.REFUGE_KIND]
        ]
        inside = {
            kind: np.isin(refuge, [row for row, name in enumerate(kinds) if name == kind])
            for kind in columns.REFUGE_KINDS
        }
        self.layers |= {
            "place": place,
            "lane": lane,
            "number": number,
            "drivable": place != RULE_OFF_ROAD,
            "shoulder": place == RULE_SHOULDER,
            "parking": np.where(inside["parking_bay"], refuge, -1),
            "rest_area": np.where(inside["rest_area"], refuge, -1),
        }

    def lay_truth(self) -> None:
        """Lay static objects, and the others with what is predicted of them."""
        context = self._trace.layout.context
        static, times = self._layer(0.0), self._layer(np.inf)
        states = self._trace["objects"][self._run, self._row]
        sizes = context.object_sizes[self._run]
        for index, state in enumerate(states):
            length, width, height = sizes[index]
            x, y, heading = (
                state[columns.OBJECT_X],
                state[columns.OBJECT_Y],
                state[columns.OBJECT_HEADING],
            )
            body = np.array([x, y, heading, length, width])
            if index >= context.actor_count:
                under = self._layer(np.inf)
                cover_at(self.ego, body, 0.0, *self._cells, under)
                static = np.where(under < np.inf, np.maximum(static, height), static)
                continue
            kind = int(context.object_classes[index])
            sine, cosine = sin_cos(heading)
            velocity = np.array([cosine, sine]) * state[columns.OBJECT_SPEED]
            self._sweep(body, velocity, float(state[columns.OBJECT_ACCELERATION]), kind, times)
        self.layers |= {"static": static, "time_to_occupancy": times}

    def lay_tracks(self, channel: int) -> None:
        """Lay what a channel believed is there, placed by where the ego was when it looked."""
        trace, run = self._trace, self._run
        times = self._layer(np.inf)
        # The last row of a run has no decision: it shows that of the row before.
        row = max(0, min(self._row, int(trace.length[run]) - 2))
        tracks, stamp = trace["tracks"][run, row, channel], trace["stamp"][run, row, channel]
        looked = min(max(0, round(float(stamp) / trace.layout.context.step)), row)
        x, y, heading = trace["ego"][
            run, looked, [columns.EGO_X, columns.EGO_Y, columns.EGO_HEADING]
        ]
        sine, cosine = sin_cos(heading)
        for track in tracks[np.isfinite(tracks).all(axis=-1)].astype(np.float64):
            along, across, forward, aside, length, width = track
            place_x, place_y = (
                x + cosine * along - sine * across,
                y + sine * along + cosine * across,
            )
            velocity = np.array([cosine * forward - sine * aside, sine * forward + cosine * aside])
            body = np.array([place_x, place_y, heading, length, width])
            self._sweep(body, velocity, 0.0, 0, times)
        self.layers |= {"static": self._layer(np.nan), "time_to_occupancy": times}

    def _sweep(
        self, body: Floats, velocity: Floats, acceleration: float, kind: int, times: Floats
    ) -> None:
        cover_at(self.ego, body, 0.0, *self._cells, times)
        sweep(
            self._ground,
            self.ego,
            body,
            velocity,
            acceleration,
            columns.FIRST_FREE <= kind <= columns.LAST_FREE,
            STOP_INTERVAL,
            math.ceil(self._settings.horizon / STOP_INTERVAL - 1e-9),
            self.x,
            self.y,
            self._settings.cell,
            times,
        )

    def lay_ego_and_sensors(self) -> None:
        """Lay the ego's footprint, and count the sensors that look at each cell."""
        trace, run = self._trace, self._run
        length, width = trace.layout.context.ego_size[run, :2]
        under = self._layer(np.inf)
        cover_at(self.ego, np.array([*self.ego, length, width]), 0.0, *self._cells, under)
        counts = self._layer(0).astype(np.int64)
        row = max(0, min(self._row, int(trace.length[run]) - 2))
        for index, name in enumerate(trace.layout.sensors):
            spec = trace.layout.architecture.sensors[name]
            angle, mount = getattr(spec, "field_of_view", None), getattr(spec, "mount", None)
            if angle is None or mount is None or not trace["sensor_alive"][run, row, index]:
                continue
            # A camera that takes images has no range of its own.
            reach = float(getattr(spec, "range", math.inf))
            count_cover(mount.x, mount.y, mount.yaw, angle, reach, self.x, self.y, counts)
        self.layers |= {"ego": under < np.inf, "sensors": counts}

    def apply(self, costs: CellCosts) -> None:
        """Apply the rules to the number of the ground, and mark what is blocked."""
        width = float(self._trace.layout.context.ego_size[self._run, 1])
        left = np.broadcast_to(self.y - 0.5 * width, (len(self.x), len(self.y)))
        number = self.layers["number"]
        for rule in costs.rules:
            layer = left if rule.layer == "left_of_ego" else self.layers[rule.layer]
            above, up_to = rule.limits
            holds = (layer > above) & (layer <= up_to)
            if rule.set is not None:
                number[holds] = rule.set
            else:
                number[holds] += rule.add
        self.layers["blocked"] = number >= costs.blocked
