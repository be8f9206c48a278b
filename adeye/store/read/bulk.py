"""The executed runs of a campaign as columns of numbers and codes: a million fit into memory.

The view ``v_runs`` finds every row by its digest, in four tables; over a whole campaign it is
faster to read each table once, as it lies in the file, and to put the rows together here.

The verdicts of every planned case are columns of codes and numbers; a planned case without a
result is NOT_RUN, an FSR that is not judged on a case has no verdict there.
"""

from __future__ import annotations

import json
from array import array
from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from sqlalchemy import Connection

from adeye.judge.pairing import NOT_JUDGED, NOT_RUN
from adeye.judge.verdict import VERDICTS, Outcome
from adeye.notices import doing
from adeye.store.cases import standing
from adeye.store.encoding import read_chunks
from adeye.store.location import Place
from adeye.store.read.campaigns import content, plain_digests
from adeye.store.schema import opened
from adeye.store.table_parts import TABLES

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats, Ints
    from adeye.spec.odd import Attributes, CoverageBins
    from adeye.sweep.coverage import Coverage, Situations

# --- The executed runs of a campaign as columns of numbers and codes: a million fit into memory ---


class _Encoder:
    """Turns a long column of few different words into codes."""

    def __init__(self, rows: int = 0) -> None:
        self._seen: dict[Hashable, int] = {}
        self._codes = array("q", [-1] * rows)

    def add(self, value: Hashable) -> None:
        """Add a row; None is no word."""
        seen = self._seen
        self._codes.append(-1 if value is None else seen.setdefault(value, len(seen)))

    def fill(self, rows: int) -> None:
        """Add rows without a word until there are so many."""
        self._codes.extend([-1] * (rows - len(self._codes)))

    def labels(self) -> Labels:
        """Return the column."""
        return Labels(np.array(self._codes, dtype=np.int64), tuple(self._seen))


@dataclass(frozen=True, eq=False)
class Labels:
    """A column of few different words.

    Attributes:
        codes: (R,) index into the words, -1 where there is none.
        words: Each different one once.
    """

    codes: Ints
    words: tuple[Any, ...]

    @classmethod
    def of(cls, values: Iterable[Hashable]) -> Labels:
        """Encode a column; None is no word."""
        encoder = _Encoder()
        for value in values:
            encoder.add(value)
        return encoder.labels()

    def __getitem__(self, place: int) -> Any:
        """Return the word of a row."""
        code = int(self.codes[place])
        return None if code < 0 else self.words[code]

    def take(self, places: Ints) -> Labels:
        """Keep some rows."""
        return Labels(self.codes[places], self.words)


@dataclass(frozen=True, eq=False)
class Figures:
    """Executed runs in the order of the plan.

    Attributes:
        ordinal: (R,) of the test case in the campaign.
        scenario: (R,) id.
        architecture: (R,) id.
        fault_entry: (R,) entry of the fault list.
        replicate: (R,) number.
        outcome: (R,) name.
        points: (R,) swept value by axis; no word where a run does not have the axis.
        metrics: (R,) by id, NaN where a metric has no value.
        duration_s: (R,) simulated time [s].
        machine_dependent: (R,) whether a deadline, limit or clock of a machine had a part in it.
        has_fault: (R,) whether a fault began before it ended.
    """

    ordinal: Ints
    scenario: Labels
    architecture: Labels
    fault_entry: Labels
    replicate: Ints
    outcome: Labels
    points: Mapping[str, Labels]
    metrics: Mapping[str, Floats]
    duration_s: Floats
    machine_dependent: Bools
    has_fault: Bools

    def __len__(self) -> int:
        """Return the number of runs R."""
        return len(self.ordinal)

    def take(self, places: Ints) -> Figures:
        """Keep some runs."""
        changed: dict[str, Any] = {}
        for item in fields(self):
            column = getattr(self, item.name)
            if isinstance(column, Labels):
                changed[item.name] = column.take(places)
            elif isinstance(column, np.ndarray):
                changed[item.name] = column[places]
        return replace(
            self,
            **changed,
            points={name: column.take(places) for name, column in self.points.items()},
            metrics={name: column[places] for name, column in self.metrics.items()},
        )

    def where(self, mask: Bools) -> Figures:
        """Keep the runs (R,) that are marked; without a copy if all of them are."""
        return self if mask.all() else self.take(np.flatnonzero(mask))

    def of_scenario(self, scenario: str) -> Figures:
        """Keep the runs of a scenario."""
        words = self.scenario.words
        code = words.index(scenario) if scenario in words else -1
        return self.where((self.scenario.codes == code) & (code >= 0))

    def point(self, place: int) -> dict[str, float | str]:
        """Return the swept values of a run by axis."""
        values = {name: column[place] for name, column in self.points.items()}
        return {name: value for name, value in values.items() if value is not None}


_SINCE_FAULT: Final = "fault_detection_time_s"
"""A metric that applies to runs with a fault."""


def read_figures(connection: Connection, campaign_id: str) -> Figures:
    """Read every executed run of a campaign.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
    """
    names = "ordinal, scenario, architecture, point, result_digest, test_case_digest"
    query = f"SELECT {names} FROM campaign_case WHERE campaign_id = ? ORDER BY ordinal"  # noqa: S608 - own names
    ordinal, scenario, architecture = array("q"), _Encoder(), _Encoder()
    points, digests, tests = _PointEncoder(), list[str](), list[str]()
    # Row by row into codes: a million rows as objects would take a gigabyte.
    for chunk in read_chunks(connection, query, campaign_id):
        for row in chunk:
            ordinal.append(row[0])
            scenario.add(row[1])
            architecture.add(row[2])
            points.add(json.loads(row[3]))
            digests.append(row[4])
            tests.append(row[5])
    fault, replicate = read_columns(
        connection, "test_case", "digest", ("fault_entry", "replicate"), tests, object
    )
    tests.clear()
    names_of_run = ("outcome", "number", "duration_s", "machine_dependent")
    outcome, number, duration, dependent = read_columns(
        connection, "run", "result_digest", names_of_run, digests, object
    )
    digests.clear()
    numbers = number.tolist()
    metrics: dict[str, Floats] = {}
    for table, ids in TABLES.items():
        columns = read_columns(connection, table, "run_number", ids, numbers, np.float64)
        metrics.update(zip(ids, columns, strict=True))
    [table] = (table for table, ids in TABLES.items() if _SINCE_FAULT in ids)
    status = f"{_SINCE_FAULT}_status"
    [told] = read_columns(connection, table, "run_number", (status,), numbers, object)
    everything = Figures(
        np.array(ordinal, dtype=np.int64),
        scenario.labels(),
        architecture.labels(),
        Labels.of(fault),
        replicate.astype(np.int64),
        Labels.of(outcome),
        points.columns(),
        metrics,
        duration.astype(np.float64),
        dependent == 1,
        np.array([word not in {None, "not_applicable"} for word in told], dtype=np.bool_),
    )
    return everything.where(everything.outcome.codes >= 0)


def read_columns(
    connection: Connection,
    table: str,
    key: str,
    names: Sequence[str],
    keys: Sequence[Hashable],
    kind: type,
) -> Any:
    """Read columns (C, R) of a table for rows of given keys; None or NaN where there is none."""
    first: dict[Hashable, int] = {}
    # Two cases of a campaign may be one test case.
    places = [first.setdefault(item, row) for row, item in enumerate(keys)]
    columns: Any = np.full((len(names), len(keys)), None if kind is object else np.nan, dtype=kind)
    query = f"SELECT {', '.join((key, *names))} FROM {table}"  # noqa: S608 - own names
    # One object for equal values: every row of a database brings its own.
    same: dict[Any, Any] = {}
    for chunk in read_chunks(connection, query):
        rows = np.array([first.get(row[0], -1) for row in chunk], dtype=np.int64)
        values: Any = np.array([row[1:] for row in chunk], dtype=kind)
        if kind is object:
            values = np.frompyfunc(lambda value: same.setdefault(value, value), 1, 1)(values)
        columns[:, rows[rows >= 0]] = values[rows >= 0].T
    return columns[:, places] if len(first) < len(keys) else columns


class _PointEncoder:
    """Turns swept points into a column for each axis."""

    def __init__(self) -> None:
        self._axes: dict[str, _Encoder] = {}
        self._rows = 0

    def add(self, point: Mapping[str, Any]) -> None:
        """Add the point of a run."""
        for name, value in point.items():
            if name not in self._axes:
                self._axes[name] = _Encoder(self._rows)
            self._axes[name].add(value)
        self._rows += 1
        if len(point) < len(self._axes):
            for axis in self._axes.values():
                axis.fill(self._rows)

    def columns(self) -> dict[str, Labels]:
        """Return the columns by axis."""
        return {name: axis.labels() for name, axis in self._axes.items()}


def encode_points(points: Iterable[Mapping[str, Any]]) -> dict[str, Labels]:
    """Encode swept points by axis.

    Args:
        points: Of each run, values by axis.
    """
    encoder = _PointEncoder()
    for point in points:
        encoder.add(point)
    return encoder.columns()


# --- Everything that a comparison of architectures needs of a campaign, in one bulk read ----------

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
        place: (N,) swept values as JSON; no word unless asked for.
        replicate: (N,) number; empty unless asked for.
        test: (N,) digest of the test case; empty unless asked for.
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
    place: Labels
    replicate: Ints
    test: tuple[str, ...]

    def __len__(self) -> int:
        """Return the number of cases N."""
        return len(self.result)

    @property
    def digest_of(self) -> dict[str, str]:
        """What the verdicts of each FSR depend on beside the trace."""
        return dict(zip(self.fsrs, self.fsr_digests, strict=True))


def read_compared(
    connection: Connection,
    campaign_id: str,
    architectures: Collection[str],
    *,
    is_named: bool = False,
    judged_by: str | None = None,
) -> Compared:
    """Read the cases of some architectures of a campaign with verdicts and what happened.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
        architectures: Their ids.
        is_named: Whether to keep what names each case in every campaign, which takes memory.
        judged_by: Campaign by whose FSRs they are judged, where another one's are asked about.
    """
    judging = judged_by or campaign_id
    doing("Reading the test cases of the campaign")
    cases = _Cases.read(connection, campaign_id, frozenset(architectures))
    doing(f"Reading the results of {len(cases.results):,} test cases")
    situation, fault, faults, parameters, replicate = read_columns(
        connection,
        "test_case",
        "digest",
        ("situation_digest", "fault_entry", "faults", "parameters", "replicate"),
        cases.tests,
        object,
    )
    number, trace = read_columns(
        connection, "run", "result_digest", ("number", "trace_digest"), cases.results, object
    )
    number = number.astype(np.float64)
    withdrawn = {
        digest for (digest,) in connection.exec_driver_sql("SELECT result_digest FROM withdrawal")
    }
    # What was withdrawn is as what was never executed.
    stands = [digest not in withdrawn for digest in cases.results]
    has_run = np.isfinite(number) & np.array(stands, dtype=bool)
    trace[~has_run] = None
    numbers, inverse = np.unique(number[has_run].astype(np.int64), return_inverse=True)
    rows = np.full(len(cases.results), -1, dtype=np.int64)
    rows[has_run] = inverse
    fsrs, judged, digest, digests = _judged_on(connection, judging, cases)
    # By what the verdict on each run was given: with numeric uncertainty that depends on where.
    by = np.full((len(numbers), len(fsrs)), -1, dtype=np.int64)
    by[inverse] = digest[has_run]
    plain = plain_digests(connection, judging)
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
        place=Labels.of(cases.points if is_named else ()),
        replicate=replicate.astype(np.int64) if is_named else np.zeros(0, dtype=np.int64),
        test=tuple(cases.tests) if is_named else (),
    )


@dataclass(frozen=True, slots=True)
class Made:
    """What a test case is made of, beside the code of adeye.

    Attributes:
        scenario_digest: Of the stored content.
        architecture_digest: Of the stored content.
        faults: As JSON.
        parameters: As JSON.
        seed: Of the ODD.
        step_s: Master clock [s].
        plugins_digest: Of the code and files of plug-ins; None where there is no result.
    """

    scenario_digest: str
    architecture_digest: str
    faults: str
    parameters: str
    seed: int
    step_s: float
    plugins_digest: str | None


def read_made(connection: Connection, campaign_id: str) -> list[Made]:
    """Read what each test case of a campaign is made of, in the order of the plan."""
    query = (
        "SELECT t.scenario_digest, t.architecture_digest, t.faults, t.parameters, t.seed, "
        "t.step_s, r.plugins_digest FROM campaign_case c "
        "JOIN test_case t ON t.digest = c.test_case_digest "
        "LEFT JOIN run r ON r.result_digest = c.result_digest "
        "WHERE c.campaign_id = ? ORDER BY c.ordinal"
    )
    return [Made(*row) for chunk in read_chunks(connection, query, campaign_id) for row in chunk]


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


# --- The situations of the runs of a campaign that have a result, for what they cover of its ODD --


@dataclass(frozen=True)
class ExecutedSituations:
    """What was executed of one stored scenario.

    Attributes:
        scenario: Its content, overrides applied.
        parameters: Resolved parameters in SI of each run; empty where none has a result.
    """

    scenario: Mapping[str, Any]
    parameters: Sequence[Mapping[str, float]]


@dataclass(frozen=True)
class ExecutedRuns:
    """What a campaign executed.

    Attributes:
        planned: Its test cases.
        without_result: Those that were not executed.
        not_judged: Runs in which the scenario did not come about, or that could not be executed.
        outside_odd: Runs whose planned attributes lie outside the ODD.
        situations: The other runs, by stored scenario.
    """

    planned: int
    without_result: int
    not_judged: int
    outside_odd: int
    situations: tuple[ExecutedSituations, ...]


def executed_runs(place: Place, campaign: str) -> ExecutedRuns:
    """Read what a campaign executed; a case whose result is withdrawn has none.

    Args:
        place: The database, of the current schema.
        campaign: Id of the campaign.
    """
    found: dict[str, list[Mapping[str, float]]] = {}
    planned = without = unjudged = outside = 0
    with opened(place) as connection:
        for scenario, parameters, inside, outcome in connection.exec_driver_sql(
            "SELECT t.scenario_digest, t.parameters, c.inside_odd, r.outcome FROM campaign_case c "  # noqa: S608 - own names
            "JOIN test_case t ON t.digest = c.test_case_digest "
            "LEFT JOIN run r ON r.result_digest = c.result_digest "
            f"AND {standing('c.result_digest')} WHERE c.campaign_id = ? ORDER BY c.ordinal",
            (campaign,),
        ):
            planned += 1
            rows = found.setdefault(scenario, [])
            if outcome is None:
                without += 1
            elif not Outcome(outcome).is_judged:
                unjudged += 1
            elif not inside:
                outside += 1
            else:
                rows.append(json.loads(parameters))
        contents = {digest: content(connection, "scenario", digest) for digest in found}
    situations = tuple(ExecutedSituations(contents[key], rows) for key, rows in found.items())
    return ExecutedRuns(planned, without, unjudged, outside, situations)


def declared_attributes(odd: Mapping[str, Any]) -> tuple[Attributes, CoverageBins | None]:
    """Read the attributes and declared bins of a stored ODD, the content of its own file."""
    from adeye.spec.odd import Attributes, CoverageBins
    from adeye.spec.quantity import SI

    declared = odd.get("coverage")
    bins = None if declared is None else CoverageBins.model_validate(declared, context=SI)
    return Attributes.model_validate(odd["attributes"], context=SI), bins


def coverage_of_runs(runs: ExecutedRuns, stored: Mapping[str, Any], strength: int) -> Coverage:
    """Count what executed runs cover.

    Args:
        runs: What a campaign executed.
        stored: Content of its ODD and everything that it names.
        strength: Most attributes that are combined.
    """
    from adeye.sweep.coverage import coverage_of

    attributes, bins = declared_attributes(stored["odd"])
    executed = [item.scenario for item in runs.situations]
    written = (item for item in stored["scenarios"].values() if item not in executed)
    every = chain(runs.situations, (ExecutedSituations(item, ()) for item in written))
    situations = map(_situations, every)
    return coverage_of(attributes, bins, strength, situations)


def _situations(executed: ExecutedSituations) -> Situations:
    from adeye.spec.quantity import SI
    from adeye.spec.scenario import LogicalScenario
    from adeye.sweep.coverage import Situations

    rows = executed.parameters
    names = rows[0] if rows else ()
    columns = {name: np.array([row[name] for row in rows], dtype=np.float64) for name in names}
    scenario = LogicalScenario.model_validate(executed.scenario, context=SI)
    return Situations(scenario, columns, len(rows))
