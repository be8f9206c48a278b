"""Everything that a comparison of architectures needs of a campaign, in one bulk read.

The verdicts of every planned case are columns of codes and numbers; a planned case without a
result is NOT_RUN, an FSR that is not judged on a case has no verdict there.
"""

from __future__ import annotations

import json
from array import array
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.evaluation.judgement import VERDICTS
from adeye.evaluation.pairing import NOT_JUDGED, NOT_RUN
from adeye.store.figures import Labels, encode_points, read_chunks, read_columns
from adeye.store.half_tables import plain_digests

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from sqlalchemy import Connection

    from adeye.signals import Bools, Floats, Ints

_ARCHITECTURE_AXIS: Final = "architecture."
_SEEN: Final = "first_detection_distance_m"
"""Metric with a value where a critical object was there to be seen."""


@dataclass(frozen=True, eq=False)
class Compared:
    """Planned cases of the compared architectures, N in the order of the plan.

    Attributes:
        scenario: (N,) id.
        architecture: (N,) id.
        fault_entry: (N,) entry of the fault list.
        situation: (N,) code of the situation: scenario, parameters, replicate and seed.
        situation_digests: (N,) its digest, the same in every campaign; empty unless asked for.
        faults: (N,) executable content of the faults, as JSON.
        point: (N,) code of scenario and parameters: the point of the design.
        axes: (N,) swept values of the architecture by axis; no word where a case has none.
        result: (N,) digest of the result that the case has or would have.
        trace: (N,) code of the trace that was recorded, the same where traces are; -1 for none.
        is_done: (N,) whether it was executed and has the verdict of every FSR that is judged on it.
        fsrs: F ids.
        fsr_digests: F identities of what their verdicts depend on beside the trace.
        verdict: (N, F) codes of ``VERDICTS``, ``NOT_RUN`` or ``NOT_JUDGED``.
        robustness: (N, F) lower end; NaN where there is none.
        margin: (N, F) in the unit of the binding predicate; NaN where there is none.
        measured: (N, F) code of unit and signal of the margin, -1 for none.
        units: Unit behind each code of ``measured``.
        measures: Unit and signal behind each code of ``measured``.
        acting: (N,) codes of the channels that had authority, as bits of ``channels``.
        channels: Ids.
        seen_s: (N, S) when each sensor first detected the critical object [s]; NaN for never.
        has_object: (N,) whether there was one.
        sensors: S ids.
    """

    scenario: Labels
    architecture: Labels
    fault_entry: Labels
    situation: Ints
    situation_digests: tuple[str, ...]
    faults: Labels
    point: Ints
    axes: Mapping[str, Labels]
    result: tuple[str, ...]
    trace: Ints
    is_done: Bools
    fsrs: tuple[str, ...]
    fsr_digests: tuple[str, ...]
    verdict: Ints
    robustness: Floats
    margin: Floats
    measured: Ints
    units: tuple[str, ...]
    measures: tuple[tuple[str, str], ...]
    acting: Ints
    channels: tuple[str, ...]
    seen_s: Floats
    has_object: Bools
    sensors: tuple[str, ...]

    def __len__(self) -> int:
        """Return the number of cases N."""
        return len(self.result)


def read_compared(
    connection: Connection,
    campaign_id: str,
    architectures: Collection[str],
    *,
    is_named: bool = False,
) -> Compared:
    """Read the cases of some architectures of a campaign with verdicts and what happened.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
        architectures: Their ids.
        is_named: Whether to keep the digest of each situation, which takes memory.
    """
    cases = _Cases.read(connection, campaign_id, frozenset(architectures))
    situation, fault, faults, parameters = read_columns(
        connection,
        "test_case",
        "digest",
        ("situation_digest", "fault_entry", "faults", "parameters"),
        cases.tests,
        object,
    )
    number, trace = read_columns(
        connection, "run", "result_digest", ("number", "trace_digest"), cases.results, object
    )
    number = number.astype(np.float64)
    has_run = np.isfinite(number)
    numbers, inverse = np.unique(number[has_run].astype(np.int64), return_inverse=True)
    rows = np.full(len(cases.results), -1, dtype=np.int64)
    rows[has_run] = inverse
    fsrs, judged, digest, digests = _judged_on(connection, campaign_id, cases)
    # By what the verdict on each run was given: with numeric uncertainty that depends on where.
    by = np.full((len(numbers), len(fsrs)), -1, dtype=np.int64)
    by[inverse] = digest[has_run]
    plain = plain_digests(connection, campaign_id)
    verdicts = _Verdicts(len(numbers), len(fsrs))
    verdicts.read(connection, numbers, by, digests)
    happened = _Happened(len(numbers))
    happened.read(connection, numbers)
    scenario = Labels.of(cases.scenarios)
    code = np.where(has_run[:, np.newaxis], verdicts.code[rows], NOT_RUN)
    # A run of another campaign may wait to be judged on an FSR that has changed since.
    is_done = has_run & ~(judged & (code == NOT_RUN)).any(axis=1)
    return Compared(
        scenario=scenario,
        architecture=Labels.of(cases.architectures),
        fault_entry=Labels.of(fault),
        situation=Labels.of(zip(cases.scenarios, situation, strict=True)).codes,
        situation_digests=tuple(situation) if is_named else (),
        faults=Labels.of(faults),
        point=Labels.of(zip(cases.scenarios, parameters, strict=True)).codes,
        axes=encode_points(map(_own_axes, cases.points)),
        result=tuple(cases.results),
        trace=Labels.of(trace).codes,
        is_done=is_done,
        fsrs=fsrs,
        fsr_digests=tuple(plain[name] for name in fsrs),
        verdict=np.where(judged, code, NOT_JUDGED),
        robustness=np.where(is_done[:, np.newaxis], verdicts.numbers[0][rows], np.nan),
        margin=np.where(is_done[:, np.newaxis], verdicts.numbers[1][rows], np.nan),
        measured=np.where(is_done[:, np.newaxis], verdicts.measured[rows], -1),
        units=tuple(unit for unit, _ in verdicts.signals),
        measures=tuple(verdicts.signals),
        acting=np.where(is_done, happened.acting[rows], 0),
        channels=tuple(happened.channels),
        seen_s=np.where(is_done[:, np.newaxis], happened.seen_s[rows], np.nan),
        has_object=is_done & happened.has_object[rows],
        sensors=tuple(happened.sensors),
    )


def _own_axes(point: str) -> dict[str, float | str]:
    """Keep the axes of the architecture of a swept point."""
    # Most sweeps have none, and reading JSON takes longer than looking.
    if f'"{_ARCHITECTURE_AXIS}' not in point:
        return {}
    axes = json.loads(point).items()
    return {key: value for key, value in axes if key.startswith(_ARCHITECTURE_AXIS)}


@dataclass(frozen=True)
class _Cases:
    """Columns of ``campaign_case``."""

    scenarios: list[str]
    architectures: list[str]
    inside: array[int]
    points: list[str]
    tests: list[str]
    results: list[str]

    @classmethod
    def read(cls, connection: Connection, campaign_id: str, wanted: frozenset[str]) -> _Cases:
        query = (
            "SELECT scenario, architecture, inside_odd, point, test_case_digest, result_digest "
            "FROM campaign_case WHERE campaign_id = ? ORDER BY ordinal"
        )
        found = cls([], [], array("b"), [], [], [])
        same: dict[str, str] = {}
        for chunk in read_chunks(connection, query, campaign_id):
            for scenario, architecture, inside, point, test, result in chunk:
                if architecture in wanted:
                    found.scenarios.append(same.setdefault(scenario, scenario))
                    found.architectures.append(same.setdefault(architecture, architecture))
                    found.inside.append(inside)
                    found.points.append(point)
                    found.tests.append(test)
                    found.results.append(result)
        return found


def _judged_on(
    connection: Connection, campaign_id: str, cases: _Cases
) -> tuple[tuple[str, ...], Bools, Ints, dict[str, int]]:
    """Give the FSRs, on which cases they are judged (N, F), by what (N, F), and its digests."""
    found = connection.exec_driver_sql(
        "SELECT fsr_id, fsr_digest, architecture, scenario, applies, applicable "
        "FROM campaign_fsr WHERE campaign_id = ? ORDER BY fsr_id",
        (campaign_id,),
    ).all()
    place: dict[str, int] = {}
    digests: dict[str, int] = {}
    # Whether each is judged outside and inside the ODD.
    asked: dict[tuple[str, str], tuple[Bools, Ints]] = {}
    for item in found:
        place.setdefault(item[0], len(place))
        digests.setdefault(item[1], len(digests))
    none = np.zeros((2, len(place)), dtype=np.bool_), np.full(len(place), -1, dtype=np.int64)
    for fsr, digest, architecture, scenario, applies, applicable in found:
        key = str(architecture), str(scenario)
        wanted, by = asked.setdefault(key, (none[0].copy(), none[1].copy()))
        wanted[:, place[fsr]] = applicable and np.array([applies != "inside", applies != "outside"])
        by[place[fsr]] = digests[digest]
    keys = Labels.of(zip(cases.architectures, cases.scenarios, strict=True))
    chosen = [asked.get(key, none) for key in keys.words] or [none]
    judged: Bools = np.array([item[0] for item in chosen])[
        keys.codes, np.array(cases.inside, dtype=np.int64)
    ]
    return tuple(place), judged, np.array([item[1] for item in chosen])[keys.codes], digests


class _Verdicts:
    """Verdicts of R runs on F FSRs."""

    def __init__(self, runs: int, fsrs: int) -> None:
        # One row more: what a case without a run points at.
        shape = (runs + 1, fsrs)
        self.code = np.full(shape, NOT_RUN, dtype=np.int64)
        self.numbers = np.full((2, *shape), np.nan)
        self.measured = np.full(shape, -1, dtype=np.int64)
        self.signals: dict[tuple[str, str], int] = {}

    def read(
        self, connection: Connection, numbers: Ints, by: Ints, digests: Mapping[str, int]
    ) -> None:
        """Read the verdicts that were given by what is asked.

        Args:
            connection: In a transaction.
            numbers: (R,) numbers of the runs, ascending.
            by: (R, F) code of the digest of each FSR, -1 for none.
            digests: Their codes.
        """
        if not len(numbers):
            return
        columns = np.full(len(digests) + 1, -1, dtype=np.int64)
        for fsr in range(by.shape[1]):
            columns[by[:, fsr]] = fsr
        columns[-1] = -1
        known = _Codes(digests)
        codes = {str(word): code for code, word in enumerate(VERDICTS)}
        query = (
            "SELECT run_number, fsr_digest, verdict, robustness_low, margin, unit, signal "
            "FROM verdict WHERE run_number BETWEEN ? AND ?"
        )
        for chunk in read_chunks(connection, query, int(numbers[0]), int(numbers[-1])):
            number, digest, verdict, robustness, margin, unit, signal = zip(*chunk, strict=True)
            rows = _rows(numbers, number)
            given = _coded(known, digest)
            column = columns[given]
            kept = (rows >= 0) & (column >= 0) & (by[rows, column] == given)
            places = rows[kept], column[kept]
            self.code[places] = _coded(codes, verdict)[kept]
            for place, values in enumerate((robustness, margin)):
                self.numbers[place][places] = np.array(values, dtype=np.float64)[kept]
            pairs = list(zip(unit, signal, strict=True))
            for pair in dict.fromkeys(pairs):
                if pair[0] is not None:
                    self.signals.setdefault(pair, len(self.signals))
            self.measured[places] = _coded(_Codes(self.signals), pairs)[kept]


class _Codes(dict[Any, int]):
    """Codes of words; -1 for every other."""

    def __missing__(self, _: object) -> int:
        return -1


def _coded(codes: Mapping[Any, int], words: Sequence[Any]) -> Ints:
    """Give the code of each word."""
    return np.fromiter(map(codes.__getitem__, words), dtype=np.int64, count=len(words))


class _Happened:
    """Who had authority in R runs, and which sensor first saw the critical object when."""

    def __init__(self, runs: int) -> None:
        self.acting = np.zeros(runs + 1, dtype=np.int64)
        self.has_object = np.zeros(runs + 1, dtype=np.bool_)
        self.channels: dict[str, int] = {}
        self.sensors: dict[str, int] = {}
        self.seen_s = np.zeros((runs + 1, 0))

    def read(self, connection: Connection, numbers: Ints) -> None:
        if not len(numbers):
            return
        (distance,) = read_columns(
            connection, "metric", "run_number", (_SEEN,), numbers.tolist(), np.float64
        )
        self.has_object[:-1] = np.isfinite(distance)
        seen: list[tuple[Ints, Ints, Floats]] = []
        query = (
            "SELECT run_number, kind = 'switch', subject, time_s FROM event "
            "WHERE run_number BETWEEN ? AND ? AND kind IN ('sensor', 'switch')"
        )
        for chunk in read_chunks(connection, query, int(numbers[0]), int(numbers[-1])):
            number, is_switch, subject, time_s = zip(*chunk, strict=True)
            rows = _rows(numbers, number)
            switched = (rows >= 0) & np.array(is_switch, dtype=np.bool_)
            found = (rows >= 0) & ~switched
            names = np.zeros(len(rows), dtype=np.int64)
            for known, own in ((self.channels, switched), (self.sensors, found)):
                words = [subject[place] for place in np.flatnonzero(own).tolist()]
                for word in dict.fromkeys(words):
                    known.setdefault(word, len(known))
                names[own] = _coded(known, words)
            np.bitwise_or.at(self.acting, rows[switched], np.int64(1) << names[switched])
            seen.append((rows[found], names[found], np.array(time_s, dtype=np.float64)[found]))
        self.seen_s = np.full((len(self.acting), len(self.sensors)), np.nan)
        for row, name, time in seen:
            self.seen_s[row, name] = time


def _rows(numbers: Ints, wanted: Sequence[int]) -> Ints:
    """Find the rows of run numbers, -1 for those of other runs."""
    given = np.array(wanted, dtype=np.int64)
    rows = np.searchsorted(numbers, given)
    rows[rows == len(numbers)] = 0
    return np.where(numbers[rows] == given, rows, -1) if len(numbers) else given * 0 - 1
