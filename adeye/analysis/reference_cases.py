"""Scenes of UN R157 from a CSV file, driven by the reference drivers."""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from adeye.errors import UsageError
from adeye.kernel.reference_drivers import reactions as columns
from adeye.kernel.reference_drivers.drivers import SCRATCH_SIZE, drive_scenes
from adeye.kernel.reference_drivers.reactions import must_be_avoided
from adeye.outputs import require_plain
from adeye.units import decimal

Floats = NDArray[np.float64]

KINDS: Final[Mapping[str, int]] = {
    "cut_in": columns.CUT_IN,
    "cut_out": columns.CUT_OUT,
    "deceleration": columns.BRAKING_LEAD,
}
INTEGRATORS: Final[Mapping[str, int]] = {
    "exact": columns.EXACT,
    "semi-implicit": columns.SEMI_IMPLICIT,
}

MAX_BYTES: Final = 100_000_000
"""Largest file of scenes [bytes]; our choice, a million scenes."""
_BLOCK: Final = 2_000
_JRC_TTC_END: Final = 2.0
_LANE: Final = 3.5


@dataclass(frozen=True, slots=True)
class _Column:
    """A column of the file: its place in a scene and what it may hold."""

    place: int
    low: float = 0.0
    high: float = 100.0
    default: float | None = None
    is_open: bool = False
    """Whether the lowest value itself is refused."""


_BODY: Final[Mapping[str, _Column]] = {
    "ego_length_m": _Column(columns.S_EGO_LENGTH, 0.0, 30.0, 4.3, is_open=True),
    "ego_width_m": _Column(columns.S_EGO_WIDTH, 0.0, 4.0, 1.9, is_open=True),
    "other_length_m": _Column(columns.S_OTHER_LENGTH, 0.0, 30.0, 4.3, is_open=True),
    "other_width_m": _Column(columns.S_OTHER_WIDTH, 0.0, 4.0, 1.9, is_open=True),
    "lane_width_m": _Column(columns.S_LANE_WIDTH, 2.0, 6.0, _LANE),
}
COLUMNS: Final[Mapping[str, Mapping[str, _Column]]] = {
    "cut_in": {
        "ego_speed_mps": _Column(columns.S_EGO_SPEED, is_open=True),
        "other_speed_mps": _Column(columns.S_OTHER_SPEED),
        "gap_m": _Column(columns.S_GAP, -100.0, 1000.0),
        "lateral_speed_mps": _Column(columns.S_LATERAL_SPEED, 0.0, 20.0),
        "lateral_offset_m": _Column(columns.S_LATERAL_OFFSET, -20.0, 20.0, _LANE),
        "lateral_acceleration_mps2": _Column(
            columns.S_LATERAL_ACCELERATION, 0.0, 100.0, math.inf, is_open=True
        ),
        **_BODY,
    },
    "cut_out": {
        "ego_speed_mps": _Column(columns.S_EGO_SPEED, is_open=True),
        "other_speed_mps": _Column(columns.S_OTHER_SPEED),
        "gap_m": _Column(columns.S_GAP, 0.0, 1000.0, math.nan),
        "front_gap_m": _Column(columns.S_FRONT_GAP, 0.0, 1000.0),
        "lateral_speed_mps": _Column(columns.S_LATERAL_SPEED, 0.0, 20.0),
        **_BODY,
    },
    "deceleration": {
        "ego_speed_mps": _Column(columns.S_EGO_SPEED, is_open=True),
        "other_speed_mps": _Column(columns.S_OTHER_SPEED),
        "gap_m": _Column(columns.S_GAP, 0.0, 1000.0, math.nan),
        "max_deceleration_mps2": _Column(columns.S_BRAKING, 0.0, 20.0),
        "jerk_mps3": _Column(columns.S_BRAKING_JERK, 0.0, 1000.0, math.inf, is_open=True),
        **_BODY,
    },
}


@dataclass(frozen=True, slots=True)
class Question:
    """Which drivers are asked, and how."""

    scene: str = "cut_in"
    models: tuple[str, ...] = tuple(columns.MODELS)
    edition: str = "r157-01"
    variant: tuple[str, ...] = ()
    step: float = 0.01
    integrator: str = "exact"


def check_question(question: Question) -> None:
    """Refuse names and numbers that mean nothing.

    Raises:
        UsageError: With the value, what is allowed and what to do.
    """
    _known("scene", [question.scene], KINDS)
    _known("model", question.models, columns.MODELS)
    _known("edition", [question.edition], columns.EDITIONS)
    _known("variant", question.variant, [*columns.VARIANTS, *columns.GROUPS])
    _known("integrator", [question.integrator], INTEGRATORS)
    if not question.models:
        raise UsageError("no model is named", remedy=f"Name some of {', '.join(columns.MODELS)}.")
    if not 0.001 <= question.step <= 0.1:
        raise UsageError(
            f"the step of {question.step:g} s is not allowed",
            remedy="Take one from 0.001 s to 0.1 s.",
        )


def _known(what: str, names: Sequence[str], allowed: Sequence[str] | Mapping[str, object]) -> None:
    for name in names:
        if name not in allowed:
            raise UsageError(
                f"there is no {what} {name!r}", remedy=f"Take one of {', '.join(allowed)}."
            )


def read(path: Path, scene: str) -> tuple[list[dict[str, str]], Floats]:
    """Read the scenes of a CSV file.

    Args:
        path: With a header; other columns are handed through.
        scene: One of ``KINDS``.

    Returns:
        The rows as written and the scenes, shape (N, SCENE_SIZE).

    Raises:
        UsageError: With file and line.
    """
    wanted = COLUMNS[scene]
    try:
        require_plain(path, MAX_BYTES)
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, strict=True)
            names = reader.fieldnames or []
            _check_header(path, names, wanted)
            rows = []
            scenes = []
            for row in reader:
                where = f"{path}:{reader.line_num}"
                if None in row or None in row.values():
                    raise UsageError(
                        f"{where}: the row has not as many cells as the header has names",
                        remedy=f"Give {len(names)} cells.",
                    )
                scenes.append(_scene(where, row, wanted))
                rows.append(row)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(
            f"{path} cannot be read: {error}", remedy="Name a readable CSV file in UTF-8."
        ) from error
    if not scenes:
        raise UsageError(f"{path} holds no scene", remedy="Write one scene per row.")
    return rows, np.array(scenes, dtype=np.float64)


def _check_header(path: Path, names: Sequence[str], wanted: Mapping[str, _Column]) -> None:
    missing = [name for name, column in wanted.items() if column.default is None]
    missing = [name for name in missing if name not in names]
    twice = sorted({name for name in names if names.count(name) > 1})
    if missing or twice:
        said = f"has no column {missing[0]!r}" if missing else f"has column {twice[0]!r} twice"
        raise UsageError(
            f"{path}:1: the header {said}",
            remedy=f"Columns are {', '.join(wanted)}; those with a default may be left out.",
        )
    _refuse_misspelt(path, names, wanted)


def _refuse_misspelt(path: Path, names: Sequence[str], wanted: Mapping[str, _Column]) -> None:
    """Refuse a name that is nearly one of ours: its column would be ignored for a default."""
    absent = [name for name in wanted if name not in names]
    elsewhere = {name for scene in COLUMNS.values() for name in scene}
    for name in names:
        if name in elsewhere:
            continue
        word = name.strip().lower()
        # Another spelling of one that is there: nobody can tell which of the two is meant.
        meant = [word] if word in wanted else []
        meant += [known for known in absent if word == known.rpartition("_")[0]]
        meant = meant or difflib.get_close_matches(word, absent, n=1, cutoff=0.8)
        if meant:
            raise UsageError(
                f"{path}:1: column {name!r} is none that is read",
                remedy=f"Write {meant[0]!r} if that is meant, or give it quite another name.",
            )


def _scene(where: str, row: Mapping[str, str], wanted: Mapping[str, _Column]) -> list[float]:
    scene = [0.0] * columns.SCENE_SIZE
    for name, column in wanted.items():
        text = row.get(name, "").strip()
        if not text and column.default is not None:
            scene[column.place] = column.default
            continue
        value = _number(text)
        if not column.low <= value <= column.high or (column.is_open and value == column.low):
            start = "above" if column.is_open else "from"
            raise UsageError(
                f"{where}: {name} is {text!r}",
                remedy=f"Write a number {start} {column.low:g} to {column.high:g}.",
            )
        scene[column.place] = value
    return scene


def _number(text: str) -> float:
    """Return the number that a text is; NaN for none, which no range contains."""
    try:
        return decimal(text)
    except ValueError:
        return math.nan


RESULTS: Final = ("contact", "impact_speed_mps", "min_gap_m", "braking_time_s")
"""What is written of each model, in the order of the columns of ``drive``."""
_DUTY: Final = "reg157_must_be_avoided"


def answers(path: Path, names: Collection[str], question: Question) -> list[str]:
    """Return the columns that the answers add to those of a file.

    Args:
        path: Of the scenes.
        names: Its columns.
        question: What is answered.

    Raises:
        UsageError: The file has such a column already, as an output that is asked again.
    """
    made = [f"{model}_{field}" for model in question.models for field in RESULTS]
    if question.scene == "cut_in":
        made.append(_DUTY)
    if twice := [name for name in made if name in names]:
        raise UsageError(
            f"{path}:1: there is a column {twice[0]!r} already, and the answers would be another",
            remedy=f"Give {'it' if len(twice) == 1 else f'these {len(twice)} columns'} other names "
            "in that file, such as with the variant before them, or leave them out.",
        )
    return made


def drive(
    scenes: Floats,
    question: Question,
    model: str,
    *,
    threads: int = 1,
    told: Callable[[int], None] | None = None,
) -> Floats:
    """Let one model drive scenes.

    Args:
        scenes: Shape (N, SCENE_SIZE).
        question: Checked.
        model: One of its models.
        threads: How many scenes are driven at once; changes no bit.
        told: Called with the number of scenes of each block that is done.

    Returns:
        Shape (N, RESULT_SIZE).
    """
    parameters = columns.vector(columns.parameters_of(model, question.edition, question.variant))
    names = columns.named(question.variant)
    ends = model == "cc" and "jrc-ttc-end" in names
    results = np.empty((len(scenes), columns.RESULT_SIZE))

    def block(start: int) -> int:
        part = slice(start, min(start + _BLOCK, len(scenes)))
        drive_scenes(
            scenes[part],
            KINDS[question.scene],
            columns.MODELS[model],
            parameters,
            question.step,
            INTEGRATORS[question.integrator],
            _JRC_TTC_END if ends else math.inf,
            np.zeros(SCRATCH_SIZE),
            results[part],
            "jrc-first-step" in names,
        )
        return part.stop - part.start

    with ThreadPoolExecutor(threads) as pool:
        for done in pool.map(block, range(0, len(scenes), _BLOCK)):
            if told is not None:
                told(done)
    return results


def obligations(scenes: Floats, edition: str) -> Floats:
    """Tell for which cut-ins paragraph 5.2.5.2 forbids a contact: 1 or 0, shape (N,)."""
    rules = columns.EDITIONS[edition]
    return np.array([must_be_avoided(row, rules.delay, rules.braking, 0.3) for row in scenes])
