"""Draw a map as SVG: lanes by kind with their ids, widths and directions, signals, junctions.

The plan has north, the y axis of the map, up. Where lanes are too narrow on it for words, they are
shown once more as seen along the road, each kind of cross-section once. Maps of many lanes are
drawn without words, so that the file stays small.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from adeye.maps.lanes import REFERENCE, LaidRoad, Strip, along, width_at
from adeye.maps.network import BUS, DRIVE, KINDS, Network, Rows, build_of_rows
from adeye.maps.opendrive import Floats, OpenDrive
from adeye.maps.outlines import Points, points_along, strips_of

WIDTH: Final = 1280
"""Of the picture [px]; its height follows from the map."""
_TALLEST: Final = 900
_MARGIN, _HEAD, _FOOT = 24, 84, 100
_MANY: Final = 2000
"""With more lanes than this, no words are drawn."""
_EXACT: Final = 0.2
"""How far a drawn border is from the true one at most [px]; where few are drawn, also [m]."""
_COARSE: Final = 20.0
"""Between the points that tell how large a map is, at most [m]."""
_FINEST: Final = 0.02
"""What one step of a drawn number is worth at most [m]."""
_LETTER: Final = 6.0
"""Width of a letter, about [px]."""
_THIN: Final = 0.3
"""Where a metre is less than this, lanes are no more than lines [px/m]."""
_WORDS: Final = 9.0
"""Width of a lane that has room for words [px]."""
_SECTIONS: Final = 8
"""Cross-sections that are shown at most."""
_PER_METRE: Final = 12.0
"""Of a cross-section [px/m]."""
_COLOURS: Final = dict(
    zip(
        KINDS,
        ("#aeb8c6", "#e0b14f", "#cf7f70", "#dde2e8", "#86aede", "#d3c5aa", "#9b8fb0", "#eceff2"),
        strict=True,
    )
)
_ARROW: Final = "M-1-.35H.2V-.75L1 0 .2.75V.35H-1Z"
_STYLE: Final = (
    "text{font:11px system-ui,sans-serif;fill:#14181d}"
    ".l,.b{stroke:#5b6573}.b{stroke-width:.5}.j{fill-opacity:.7}.a{fill:#fff;stroke:#14181d;"
    "stroke-width:.15}.h{paint-order:stroke;stroke:#fff;stroke-width:3px}.m{text-anchor:middle}"
    ".t{font-size:18px;font-weight:600}.w{fill:#fff;stroke:#b3261e;stroke-width:2}"
) + "".join(f".{kind}{{fill:{colour}}}" for kind, colour in _COLOURS.items())


def draw_map(drive: OpenDrive, name: str) -> str:
    """Return a map as SVG.

    Args:
        drive: Which map.
        name: Its title.
    """
    rows = Rows(drive)
    scene = _Scene(rows, build_of_rows(rows), list(strips_of(rows)))
    view = _View.around(points_along(scene.strips, _COARSE), is_fine=len(scene.strips) <= _MANY)
    exact = min(_EXACT / view.scale, _EXACT) if view.is_fine else _EXACT / view.scale
    shapes = [scene.outline(row, exact) for row in range(len(scene.strips))]
    sections = list(_cross_sections(scene)) if scene.is_narrow(view) else []
    height = view.bottom + _FOOT + sum(size for size, _ in sections)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height:.0f}" '
        f'viewBox="0 0 {WIDTH} {height:.0f}" role="img" aria-labelledby="title desc">',
        f'<title id="title">{escape(name)}</title>',
        f'<desc id="desc">{escape(_described(drive, scene))}</desc>',
        f"<style>{_STYLE}{_strokes(view)}</style>",
        f'<defs><path id="a" class="a" d="{_ARROW}"/>{_GLYPHS}</defs>',
        f'<rect width="{WIDTH}" height="{height:.0f}" fill="#fff"/>',
        f'<text class="t" x="{_MARGIN}" y="34">{escape(name)}</text>',
        f'<text x="{_MARGIN}" y="52">{escape(_described(drive, scene))}</text>',
        *_lanes(scene, view, shapes),
        *_arrows(scene, view),
        *_signals(scene, view),
        *(_words(scene, view) if view.is_fine else ()),
        *_frame(scene, view),
    ]
    top = view.bottom + _FOOT
    for size, lines in sections:
        parts += [f'<g transform="translate({_MARGIN} {top:.0f})">', *lines, "</g>"]
        top += size
    return "\n".join([*parts, "</svg>", ""])


_GLYPHS: Final = (
    '<circle id="s" class="w" r="4"/><g id="d"><rect x="-3.5" y="-8" width="7" height="16" rx="2" '
    'fill="#14181d"/><circle cy="-5" r="2" fill="#e5484d"/><circle r="2" fill="#f5c518"/>'
    '<circle cy="5" r="2" fill="#30a46c"/></g>'
)


def _strokes(view: _View) -> str:
    """Return how lanes are outlined; those too thin to be seen are as thick as a line."""
    text = f".l{{stroke-width:{min(0.12 * view.scale, 0.5):.2f}}}"
    return text if view.scale > _THIN else f"{text}.l.drive{{stroke-width:1.5}}"


@dataclass(frozen=True, slots=True)
class _View:
    """Where the plan lies in the picture.

    Attributes:
        west: Least x of the map [m].
        north: Greatest y [m].
        scale: [px/m].
        left: Of the plan [px].
        bottom: Of the plan [px].
        digits: Behind the point of drawn numbers.
        is_fine: Whether there are words, and borders that may be looked at from near.
    """

    west: float
    north: float
    scale: float
    left: float
    bottom: float
    digits: int
    is_fine: bool

    @classmethod
    def around(cls, points: Points, *, is_fine: bool) -> _View:
        if not len(points.x):
            return cls(0.0, 0.0, 1.0, _MARGIN, _HEAD, 1, is_fine)
        half = 0.5 * float(points.width.max())
        low = np.array((points.x.min(), points.y.min())) - half
        high = np.array((points.x.max(), points.y.max())) + half
        size = np.maximum(high - low, 1.0)
        room = WIDTH - 2 * _MARGIN
        scale = float(min(room / size[0], _TALLEST / size[1]))
        left = _MARGIN + 0.5 * (room - size[0] * scale)
        finest = _FINEST if is_fine else _EXACT
        digits = max(1, math.ceil(-math.log10(finest * scale))) if is_fine else 1
        bottom = _HEAD + float(size[1]) * scale
        return cls(float(low[0]), float(high[1]), scale, float(left), bottom, digits, is_fine)

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point of the map is in the picture [px]."""
        return self.left + (x - self.west) * self.scale, _HEAD + (self.north - y) * self.scale

    def text(self, value: float) -> str:
        return f"{value:.{self.digits}f}".rstrip("0").rstrip(".")

    def path(self, points: Floats) -> str:
        """Return a closed path around points (P, 2) of the map."""
        places = np.round(
            (points - (self.west, self.north)) * (self.scale, -self.scale) + (self.left, _HEAD),
            self.digits,
        )
        # A point that is drawn where the one before is says nothing.
        moved = np.append(True, (np.diff(places, axis=0) != 0.0).any(axis=1))
        pairs = (f"{self.text(x)} {self.text(y)}" for x, y in places[moved].tolist())
        return f"M{' '.join(pairs)}Z"

    def turned(self, x: float, y: float, heading: float) -> str:
        """Return the transformation to a point of the map, along a heading."""
        px, py = self.place(x, y)
        return f"translate({self.text(px)} {self.text(py)})rotate({-math.degrees(heading):.0f})"


class _Scene:
    """A graph, and where its lanes lie."""

    def __init__(self, rows: Rows, network: Network, strips: list[tuple[LaidRoad, Strip]]) -> None:
        self.rows, self.network, self.strips = rows, network, strips
        self.kinds = [KINDS[kind] for kind in network.kind]
        self.widths = [
            float(width_at(strip, np.array([0.5 * (strip.start + strip.end)]))[0])
            for _, strip in strips
        ]

    def outline(self, row: int, exact: float) -> Floats:
        """Return the points around a lane (P, 2), one border on and the other one back [m]."""
        road, strip = self.strips[row]
        sides = [_border(road, line, strip, exact) for line in (strip.inner, strip.outer)]
        return np.concatenate((sides[0], sides[1][::-1]))

    def middle(self, row: int) -> tuple[float, float, float, float]:
        """Return the middle of a lane: x, y, heading of its traffic, how long it is [m]."""
        road, strip = self.strips[row]
        line = along(road, strip.center, np.array([0.5 * (strip.start + strip.end)]))
        heading = float(line.heading[0]) + (math.pi if self.network.way[row] < 0 else 0.0)
        length = (strip.end - strip.start) * float(line.rate[0])
        return float(line.x[0]), float(line.y[0]), heading, length

    def is_narrow(self, view: _View) -> bool:
        """Tell whether half of what is driven on has no room for words."""
        driven = [
            width
            for kind, width, junction in zip(
                self.kinds, self.widths, self.network.junction, strict=True
            )
            if kind == "drive" and junction < 0
        ]
        return bool(driven) and float(np.median(driven)) * view.scale < _WORDS


def _border(road: LaidRoad, line: Floats, strip: Strip, exact: float) -> Floats:
    """Return points of a border (P, 2), as many as its bends need [m]."""
    steps = {s for s in line[:, 0].tolist() if strip.start < s < strip.end}
    bends = {s for s in road.pieces[:, 0].tolist() if strip.start < s < strip.end}
    # Where a width jumps, the border goes across: there it has two points.
    before = {max(s - 1e-6, strip.start) for s in steps}
    knots = sorted({strip.start, strip.end} | steps | bends | before)
    looked = np.concatenate([np.linspace(a, b, 7)[1:-1] for a, b in pairwise(knots)])
    curvature = np.abs(along(road, line, looked).curvature).reshape(-1, 5).max(axis=1)
    counts = np.diff(knots) * np.sqrt(curvature / (8.0 * exact))
    counts = np.clip(np.ceil(np.nan_to_num(counts, nan=1.0, posinf=200.0)), 1, 200).astype(int)
    inner = [
        np.linspace(a, b, count, endpoint=False)
        for (a, b), count in zip(pairwise(knots), counts.tolist(), strict=True)
    ]
    found = along(road, line, np.append(np.concatenate(inner), strip.end))
    return np.stack((found.x, found.y), axis=1)


def _described(drive: OpenDrive, scene: _Scene) -> str:
    roads = drive.roads.values()
    counts = (
        ("Roads", len(roads)),
        ("junctions", len(drive.junctions)),
        ("lanes", len(scene.strips)),
        ("lanes to drive on", scene.kinds.count("drive")),
        ("signals", sum(len(road.signals) for road in roads)),
    )
    told = [f"{name}: {count:,}" for name, count in counts]
    return f"{', '.join(told)}; {sum(road.length for road in roads) / 1000.0:,.3f} km."


def _lanes(scene: _Scene, view: _View, shapes: list[Floats]) -> Iterator[str]:
    joined = scene.network.junction >= 0
    for row in [*np.flatnonzero(~joined), *np.flatnonzero(joined)]:
        word = f"l {scene.kinds[row]}{' j' if joined[row] else ''}"
        path = f'<path class="{word}" d="{view.path(shapes[row])}"'
        if not view.is_fine:
            yield f"{path}/>"
            continue
        lane = scene.rows.lanes[row]
        told = f"{scene.network.name(row)}: {lane.type}, {scene.widths[row]:.2f} m wide half-way"
        yield f"{path}><title>{escape(told)}</title></path>"


def _arrows(scene: _Scene, view: _View) -> Iterator[str]:
    network = scene.network
    for row in np.flatnonzero(np.isin(network.kind, (DRIVE, BUS)) & (network.way != 0)).tolist():
        x, y, heading, length = scene.middle(row)
        room = scene.widths[row] * view.scale
        is_inner = network.left[row] < 0 or scene.kinds[network.left[row]] != "drive"
        size = min(max(0.45 * room, 2.0), 7.0)
        # Of lanes as narrow as a line one arrow tells the way of all.
        if (room >= 3.0 or is_inner) and length * view.scale > 4.0 * size:
            yield f'<use href="#a" transform="{view.turned(x, y, heading)}scale({size:.1f})"/>'


def _signals(scene: _Scene, view: _View) -> Iterator[str]:
    roads = {road.road.id: road for road, _ in scene.strips}
    for road in roads.values():
        for signal in road.road.signals:
            line = along(road, REFERENCE, np.array([min(max(signal.s, 0.0), road.road.length)]))
            x = float(line.x[0]) - signal.t * math.sin(line.heading[0])
            y = float(line.y[0]) + signal.t * math.cos(line.heading[0])
            px, py = view.place(x, y)
            mark = "d" if signal.dynamic else "s"
            glyph = (
                f'<use href="#{mark}" transform="translate({view.text(px)} {view.text(py)})'
                f'scale({min(max(0.3 * view.scale, 0.35), 1.0):.2f})"'
            )
            told = f"signal {signal.id}: {'light' if signal.dynamic else 'sign'} {signal.type}"
            yield f"{glyph}><title>{escape(told)}</title></use>" if view.is_fine else f"{glyph}/>"


def _words(scene: _Scene, view: _View) -> Iterator[str]:
    """Yield ids and widths of lanes with room for them, then those of roads and junctions."""
    network = scene.network
    for row, width in enumerate(scene.widths):
        x, y, heading, length = scene.middle(row)
        if network.junction[row] >= 0 and width * view.scale < 2.0 * _WORDS:
            # Lanes lie on each other there.
            continue
        number = f"{network.lane[row]}".replace("-", "\N{MINUS SIGN}")
        text = f"{number} \N{MIDDLE DOT} {width:.2f} m"
        size = min(0.7 * width * view.scale, 11.0)
        # Behind the arrow, which stands half-way.
        if width * view.scale >= _WORDS and length * view.scale > 2.0 * len(text) * size:
            upright = heading if math.cos(heading) > -1e-6 else heading + math.pi
            yield (
                f'<text style="font-size:{size:.1f}px" x="16" y="{0.35 * size:.1f}" '
                f'transform="{view.turned(x, y, upright)}">{text}</text>'
            )
    yield from _names(scene, view)


def _names(scene: _Scene, view: _View) -> Iterator[str]:
    network = scene.network
    outer: dict[int, int] = {}
    inside: dict[int, list[tuple[float, float]]] = {}
    for row in range(len(network)):
        if network.junction[row] >= 0:
            inside.setdefault(int(network.junction[row]), []).append(scene.middle(row)[:2])
        elif scene.strips[row][1].section == 0:
            # Rows ascend by lane: the first of a road lies furthest to the right.
            outer.setdefault(int(network.road[row]), row)
    taken: list[tuple[float, float, float]] = []
    for number, places in inside.items():
        x, y = (sum(values) / len(places) for values in zip(*places, strict=True))
        yield from _label(taken, view.place(x, y), f"junction {network.junctions[number]}")
    for number, row in outer.items():
        x, y, heading, _ = scene.middle(row)
        heading += math.pi if network.way[row] < 0 else 0.0
        beside = 0.5 * scene.widths[row] + 10.0 / view.scale
        aside = math.sin(heading)
        px, py = view.place(x + beside * aside, y - beside * math.cos(heading))
        text = f"road {network.roads[number]}"
        # Beside a road that goes up or down, a word begins or ends there.
        shift = 0.0 if abs(aside) < 0.4 else math.copysign(0.5 * _LETTER * len(text), aside)
        yield from _label(taken, (px + shift, py + 4.0), text)


def _label(
    taken: list[tuple[float, float, float]], place: tuple[float, float], text: str
) -> Iterator[str]:
    """Yield a word around a place, unless it would lie on another one."""
    (x, y), half = place, 0.5 * _LETTER * len(text)
    if all(abs(x - a) > half + other or abs(y - b) > 2.0 * _LETTER for a, b, other in taken):
        taken.append((x, y, half))
        yield f'<text class="h m" x="{x:.1f}" y="{y:.1f}">{escape(text)}</text>'


def _frame(scene: _Scene, view: _View) -> Iterator[str]:
    """Yield scale, north and the meaning of colours."""
    metres = 10.0 ** math.floor(math.log10(200.0 / view.scale))
    metres = max(factor * metres for factor in (1, 2, 5) if factor * metres * view.scale <= 200.0)
    y = view.bottom + 34.0
    size = metres * view.scale
    yield (
        f'<path d="M{_MARGIN} {y - 5:.1f}v5h{size:.1f}v-5" fill="none" stroke="#14181d" '
        f'stroke-width="1.5"/><text x="{_MARGIN + size + 8:.1f}" y="{y:.1f}">{metres:g} m</text>'
    )
    yield (
        f'<path d="M{WIDTH - 40} 52v-34m-6 10l6-10 6 10" fill="none" stroke="#14181d" '
        f'stroke-width="1.5"/><text x="{WIDTH - 30}" y="28">N</text>'
    )
    x, y = float(_MARGIN), view.bottom + 54.0
    for kind in (kind for kind in KINDS if kind in scene.kinds):
        yield (
            f'<rect class="b {kind}" x="{x:.0f}" y="{y:.1f}" width="18" height="12"/>'
            f'<text x="{x + 24:.0f}" y="{y + 10:.1f}">{kind}</text>'
        )
        x += 100.0
    dynamic = {signal.dynamic for road, _ in scene.strips for signal in road.road.signals}
    for mark, word in (("d", "light"), ("s", "sign")):
        if (mark == "d") not in dynamic:
            continue
        yield (
            f'<use href="#{mark}" x="{x + 9:.0f}" y="{y + 6:.1f}"/>'
            f'<text x="{x + 24:.0f}" y="{y + 10:.1f}">{word}</text>'
        )
        x += 100.0


# --- Cross-sections -------------------------------------------------------------------------------


class _Bar(NamedTuple):
    """A lane of a cross-section."""

    lane: int
    kind: str
    width: float
    way: int


def _cross_sections(scene: _Scene) -> Iterator[tuple[float, list[str]]]:
    """Yield the most frequent cross-sections by length: their height [px] and their lines."""
    network = scene.network
    rows: dict[tuple[int, int], list[int]] = {}
    for row in np.flatnonzero(network.junction < 0).tolist():
        rows.setdefault((int(network.road[row]), int(network.section[row])), []).append(row)
    lengths: dict[tuple[_Bar, ...], float] = {}
    example: dict[tuple[_Bar, ...], int] = {}
    for members in rows.values():
        key = tuple(
            _Bar(
                int(network.lane[row]),
                scene.kinds[row],
                round(scene.widths[row], 2),
                int(network.way[row]),
            )
            for row in reversed(members)
        )
        length = float(network.end[members[0]] - network.start[members[0]])
        lengths[key] = lengths.get(key, 0.0) + length
        example.setdefault(key, members[0])
    ordered = sorted(lengths, key=lambda key: (-lengths[key], example[key]))
    if ordered:
        few = len(ordered) <= _SECTIONS
        shown = "all" if few else f"the {_SECTIONS} longest of {len(ordered):,}"
        yield 26.0, [f"<text>Lanes as seen along s, half-way of their section: {shown}.</text>"]
    for key in ordered[:_SECTIONS]:
        name = network.name(example[key]).rpartition(", ")[0]
        yield 62.0, list(_bars(key, f"Such as {name}: {lengths[key]:,.0f} m in all"))


def _bars(lanes: tuple[_Bar, ...], title: str) -> Iterator[str]:
    yield f"<text>{escape(title)}</text>"
    total = sum(max(bar.width, 0.0) for bar in lanes)
    scale = min(_PER_METRE, (WIDTH - 2 * _MARGIN) / max(total, 1.0))
    x = 0.0
    for lane, kind, width, way in lanes:
        size = max(width, 0.0) * scale
        middle = x + 0.5 * size
        yield f'<rect class="b {kind}" x="{x:.1f}" y="6" width="{size:.1f}" height="34"/>'
        arrow = {1: "\N{UPWARDS ARROW}", -1: "\N{DOWNWARDS ARROW}"}.get(way, "")
        number = str(lane).replace("-", "\N{MINUS SIGN}")
        for y, text in ((20, f"{number}{arrow}"), (34, f"{width:.2f}")):
            letters = min(11.0, 1.7 * size / len(text))
            if letters > 6.0:
                style = f'style="font-size:{letters:.1f}px"'
                yield f'<text class="m" x="{middle:.1f}" y="{y}" {style}>{text}</text>'
        x += size
