"""What each compared architecture costs and achieves, and which of them are worth choosing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from adeye.judge import pairing as pareto
from adeye.judge.pairing import FAILED, HELD, UNDECIDED, number_rows, pair_up, severities
from adeye.judge.statistics import median_low
from adeye.judge.verdict import FAIL, INCONCLUSIVE, PASS, Verdict
from adeye.report.comparison import records
from adeye.signals import NO_FAULT, Ints
from adeye.spec.architecture import Architecture
from adeye.spec.quantity import SI
from adeye.store.read.bulk import Compared
from adeye.store.read.totals import channel_failures
from adeye.store.records import CampaignInfo
from adeye.store.repository import Repository

# --- What an architecture consists of: its cost, its sensors, what it has beyond another ----------


def cost_of(content: Mapping[str, Any]) -> records.Cost | None:
    """Add up what an architecture costs.

    Its own ``cost`` is the total where it covers that of the parts, and the rest is what has no
    part. Where the parts cost more, as after a part was added, their sum is the total.

    Args:
        content: The architecture.

    Returns:
        None if neither is declared: what costs nothing is not known to be cheap.

    >>> cost_of({"cost": 300.0, "sensors": {"camera": {"cost": 120.0}}, "channels": {}}).total
    300.0
    """
    parts = {
        f"{kind}.{name}": float(part["cost"])
        for kind in ("sensors", "channels")
        for name, part in content[kind].items()
        if part["cost"] > 0.0
    }
    declared = float(content["cost"])
    total = max(declared, sum(parts.values()))
    return records.Cost(total=total, declared=declared, parts=parts) if total > 0.0 else None


def measuring(content: Mapping[str, Any]) -> list[str]:
    """List the sensors that measure and feed a channel."""
    linked = {link for channel in content["channels"].values() for link in channel["links"]}
    return [
        name
        for name, sensor in content["sensors"].items()
        if name in linked and sensor["kind"] not in {"ground_truth", "localisation"}
    ]


def suite_of(content: Mapping[str, Any]) -> dict[str, int]:
    """Count the sensors that measure and feed a channel, by kind."""
    return dict(Counter(content["sensors"][name]["kind"] for name in measuring(content)))


def extra_sensor(more: Mapping[str, Any], less: Mapping[str, Any]) -> str | None:
    """Name the one sensor that an architecture has beyond another that is equal in all else.

    Args:
        more: Executable part of the one.
        less: Executable part of the other.
    """
    extra = [name for name in more["sensors"] if name not in less["sensors"]]
    if len(extra) != 1 or len(more["sensors"]) != len(less["sensors"]) + 1:
        return None
    gone = {extra[0], f"health.{extra[0]}"}
    without = {
        **more,
        "sensors": {key: item for key, item in more["sensors"].items() if key != extra[0]},
        "channels": {
            key: {**item, "links": [link for link in item["links"] if link not in gone]}
            for key, item in more["channels"].items()
        },
    }
    return extra[0] if without == dict(less) else None


# --- What each compared architecture costs and achieves, and which of them are worth choosing -----


class Candidates:
    """Measures the compared architectures on the test cases that all share and have executed."""

    def __init__(
        self,
        repository: Repository,
        campaign: CampaignInfo,
        odd: Mapping[str, Any],
        names: Sequence[str],
        matching: Matching,
    ) -> None:
        """Use what a comparison has read.

        Args:
            repository: The database.
            campaign: The campaign.
            odd: Stored content of its ODD.
            names: Architectures.
            matching: Of their cases.
        """
        self._campaign = campaign
        self._contents: Mapping[str, Any] = odd["architectures"]
        self._names = names
        self._matching = matching
        self._compared = matching.compared
        self._gate = [
            item for item in repository.gate(campaign.id) if item.architecture in set(names)
        ]
        self._failures = channel_failures(repository, campaign)
        self._shared = matching.common(names)
        self._rows = matching.common(names, executed=True)
        mandatory = {item.fsr for item in self._gate}
        applicable = {
            name: {
                item.fsr for item in self._gate if item.architecture == name and item.is_applicable
            }
            for name in names
        }
        self.fsrs = [
            fsr
            for fsr in self._compared.fsrs
            if fsr in mandatory and all(fsr in applicable[name] for name in names)
        ]
        """Mandatory FSRs that are applicable to all."""

    def judge(self, objectives: Sequence[str], epsilon: Mapping[str, float]) -> dict[str, Any]:
        """Measure the candidates and find the front.

        Args:
            objectives: Names of ``OBJECTIVES``, the first decides between equals.
            epsilon: Difference that does not count, by objective.

        Returns:
            What a comparison says of them: the candidates in the order given, the objectives that
            could be used, those that could not and why, and the cheapest.
        """
        measured = {name: self._measured(name) for name in self._names}
        used: list[records.Objective] = []
        left_out: list[str] = []
        has_evidence = all(item.cases for item in measured.values())
        if not has_evidence:
            # A front of costs alone would be an advice that nothing supports.
            left_out.append("all of them, because no test case was executed for every architecture")
        values: dict[str, dict[str, float]] = {name: {} for name in self._names}
        for objective in objectives if has_evidence else ():
            found = {name: self._value(item, objective) for name, item in measured.items()}
            known = {name: value for name, value in found.items() if value is not None}
            if len(known) < len(found):
                unknown = [name for name in found if name not in known]
                left_out.append(f"{objective}: not known for {', '.join(unknown)}")
                continue
            better = records.OBJECTIVES[objective]
            used.append(
                records.Objective.model_validate(
                    {"name": objective, "better": better, "epsilon": epsilon.get(objective, 0)}
                )
            )
            for name, value in known.items():
                values[name][objective] = value
        dominators = pareto.dominators(
            {name: tuple(found.values()) for name, found in values.items()},
            [pareto.Objective(item.name, item.better, item.epsilon) for item in used],
        )
        candidates = tuple(
            item.model_copy(
                update={
                    "values": values[name],
                    "is_on_front": bool(used) and dominators[name] is None,
                    "dominated_by": dominators[name] if used else None,
                }
            )
            for name, item in measured.items()
        )
        return {
            "candidates": candidates,
            "objectives": tuple(used),
            "left_out": tuple(left_out),
            "cheapest": _cheapest(candidates),
        }

    def _value(self, item: records.Candidate, objective: str) -> float | None:
        """Return the value of an objective, None if it is not known."""
        if objective == "failures":
            return float(item.failing + item.undecided)
        if objective == "availability":
            return item.availability
        if objective == "cost":
            return None if item.cost is None else item.cost.total
        return None if self._lacks_margin(item.id) else item.worst_margin

    def _measured(self, name: str) -> records.Candidate:
        """Measure one candidate; its place among the others is not known yet."""
        rows = self._rows[name]
        compared = self._compared
        severity = severities(compared.verdict[self._judged(name)]).max(axis=1, initial=HELD)
        is_free = np.array([word == NO_FAULT for word in compared.fault_entry.words])
        free = rows[is_free[compared.fault_entry.codes[rows]]]
        default = self._contents[name]["switch"]["default"]
        own = compared.channels.index(default) if default in compared.channels else None
        foreign = compared.acting[free] & ~(0 if own is None else 1 << own)
        margin, fsr, run = self._worst(name)
        return records.Candidate(
            id=name,
            title=self._contents[name]["title"],
            is_gate=name in self._campaign.gate,
            cost=cost_of(self._contents[name]),
            sensors=suite_of(self._contents[name]),
            mandatory=sum(item.architecture == name for item in self._gate),
            unmet=tuple(
                records.Unmet(
                    fsr=item.fsr, verdict=item.verdict, failing=self._failing(item.fsr, rows)
                )
                for item in self._gate
                if item.architecture == name and item.verdict is not Verdict.PASS
            ),
            refused=tuple(
                f"{item.outcome} of channel {item.channel} in {item.blocking_in_words}"
                for item in self._failures
                if item.architecture == name and item.blocking
            ),
            cases=len(rows),
            left_out=len(self._shared[name]) - len(rows),
            unexecuted=tuple(self._unexecuted(name)),
            failing=int((severity == FAILED).sum()),
            undecided=int((severity == UNDECIDED).sum()),
            worst_margin=margin,
            worst_fsr=fsr,
            worst_run=run,
            availability=float((foreign == 0).mean()) if len(free) else None,
            fault_free=len(free),
            values={},
            is_on_front=False,
        )

    def _unexecuted(self, name: str) -> Iterator[records.Unexecuted]:
        """Count the planned test cases of an architecture without a result, by scenario."""
        compared = self._compared
        rows = self._matching.rows(name)
        for code, scenario in enumerate(compared.scenario.words):
            is_done = compared.is_done[rows[compared.scenario.codes[rows] == code]]
            if not is_done.all():
                missing = int((~is_done).sum())
                yield records.Unexecuted(scenario=scenario, planned=len(is_done), missing=missing)

    def _failing(self, fsr: str, rows: Ints) -> dict[str, int]:
        """Count the test cases that fail an FSR, by scenario in the order of the ODD."""
        compared = self._compared
        fails = rows[compared.verdict[rows, compared.fsrs.index(fsr)] == FAIL]
        counts = np.bincount(compared.scenario.codes[fails], minlength=1)
        words = compared.scenario.words
        return {words[code]: int(count) for code, count in enumerate(counts) if count > 0}

    def _columns(self) -> Ints:
        """Return the columns of the mandatory FSRs that are applicable to all."""
        return np.array([self._compared.fsrs.index(fsr) for fsr in self.fsrs], dtype=np.int64)

    def _judged(self, name: str) -> tuple[Ints, ...]:
        """Return the places of the cases of an architecture and of the FSRs that all have."""
        return np.ix_(self._rows[name], self._columns())

    def _lacks_margin(self, name: str) -> bool:
        """Return whether a FAIL of an architecture has no robustness."""
        at, compared = self._judged(name), self._compared
        return bool(((compared.verdict[at] == FAIL) & ~np.isfinite(compared.robustness[at])).any())

    def _worst(self, name: str) -> tuple[float | None, str, str]:
        """Return the least robustness of an architecture, its FSR and its run."""
        at, compared = self._judged(name), self._compared
        robustness = compared.robustness[at]
        counted = np.isin(compared.verdict[at], (PASS, FAIL, INCONCLUSIVE))
        known = np.where(counted & np.isfinite(robustness), robustness, np.inf)
        if not known.size or not np.isfinite(known.min()):
            return None, "", ""
        results = [compared.result[row] for row in self._rows[name].tolist()]
        ties = zip(*(part.tolist() for part in np.nonzero(known == known.min())), strict=True)
        row, column = min(ties, key=lambda at: (results[at[0]], at[1]))
        return float(known[row, column]), self.fsrs[column], results[row]

    # Sensors

    def contributions(self) -> tuple[records.Contribution, ...]:
        """Find architectures that equal another but for one sensor, and what that sensor adds."""
        parts = {
            name: Architecture.model_validate(self._contents[name], context=SI).executable()
            for name in self._names
        }
        found = []
        for more in self._names:
            for less in self._names:
                sensor = extra_sensor(parts[more], parts[less])
                if sensor is not None:
                    found.append(self._contribution(sensor, more, less))
        return tuple(found)

    def _contribution(self, sensor: str, more: str, less: str) -> records.Contribution:
        columns = self._columns()
        rows = self._matching.pairs(more, less)
        is_done = self._compared.is_done[rows[0]] & self._compared.is_done[rows[1]]
        with_it, without_it = (
            severities(self._compared.verdict[np.ix_(own[is_done], columns)]).max(
                axis=1, initial=HELD
            )
            for own in rows
        )
        return records.Contribution(
            sensor=sensor,
            with_it=more,
            without_it=less,
            cost=self._contents[more]["sensors"][sensor]["cost"],
            pairs=int(is_done.sum()),
            rescued=int(((without_it == FAILED) & (with_it == HELD)).sum()),
            harmed=int(((with_it == FAILED) & (without_it == HELD)).sum()),
        )

    def sightings(self) -> tuple[records.Sighting, ...]:
        """Count which sensor is the first to detect the object that matters."""
        return tuple(item for name in self._names for item in self._sightings(name))

    def _sightings(self, name: str) -> list[records.Sighting]:
        compared = self._compared
        rows = self._rows[name]
        rows = rows[compared.has_object[rows]]
        sensors = measuring(self._contents[name])
        if not sensors or not len(rows):
            return []
        seen = np.full((len(rows), len(sensors)), np.inf)
        for place, sensor in enumerate(sensors):
            if sensor in compared.sensors:
                times = compared.seen_s[rows, compared.sensors.index(sensor)]
                seen[:, place] = np.where(np.isfinite(times), times, np.inf)
        found = []
        for place, sensor in enumerate(sensors):
            own = seen[:, place]
            others = np.delete(seen, place, axis=1).min(axis=1, initial=np.inf)
            has_seen = np.isfinite(own)
            is_first = has_seen & (own < others) & np.isfinite(others)
            leads = others[is_first] - own[is_first]
            found.append(
                records.Sighting(
                    architecture=name,
                    sensor=sensor,
                    runs=len(rows),
                    first=int((has_seen & (own < others)).sum()),
                    shared=int((has_seen & (own == others)).sum()),
                    only=int((has_seen & ~np.isfinite(others)).sum()),
                    never=int((~has_seen).sum()),
                    lead_s=median_low(leads) if len(leads) else None,
                )
            )
        return found


def _cheapest(candidates: Sequence[records.Candidate]) -> tuple[str, ...]:
    """Name the cheapest that a gate lets pass; nobody while it is not known.

    It is not where one of them has no price, or where one that costs no more than they do may still
    meet everything: nothing of it fails, but not all was executed.
    """
    good = [item for item in candidates if item.is_good]
    if not good or any(item.cost is None for item in good):
        return ()
    least = min(item.cost.total for item in good if item.cost is not None)
    if any(item.is_open and (item.cost is None or item.cost.total <= least) for item in candidates):
        return ()
    return tuple(item.id for item in good if item.cost is not None and item.cost.total == least)


# --- Which test cases of two or more architectures are the same: situation, faults and swept axes -


class Matching:
    """Finds the same test cases among the planned cases of a campaign."""

    def __init__(self, compared: Compared) -> None:
        """Use cases with their verdicts."""
        self.compared = compared
        self._rows = {
            name: np.flatnonzero(compared.architecture.codes == code)
            for code, name in enumerate(compared.architecture.words)
        }

    def rows(self, name: str) -> Ints:
        """Return the cases of an architecture."""
        return self._rows.get(name, np.zeros(0, dtype=np.int64))

    def pairs(self, a: str, b: str) -> tuple[Ints, Ints]:
        """Return the cases (P,) of both on the same test cases.

        An axis of the architecture that only one of them has leaves several cases of that one for
        each of the other; all of them are pairs.
        """
        keys = self._keys((a, b))
        rows_a, rows_b = self.rows(a), self.rows(b)
        at_a, at_b = pair_up(keys[rows_a], keys[rows_b])
        return rows_a[at_a], rows_b[at_b]

    def common(self, names: Sequence[str], *, executed: bool = False) -> dict[str, Ints]:
        """Return the cases of each architecture on the test cases that all of them share.

        Args:
            names: Architectures.
            executed: Leave out a test case unless every case of all of them has its results.
        """
        keys = self._keys(names)
        shared = np.unique(keys)
        for name in names:
            own = self.rows(name)
            shared = np.intersect1d(shared, keys[own])
            if executed:
                shared = np.setdiff1d(shared, keys[own[~self.compared.is_done[own]]])
        return {name: self.rows(name)[np.isin(keys[self.rows(name)], shared)] for name in names}

    def _keys(self, names: Sequence[str]) -> Ints:
        """Number the test cases (N,) as far as these architectures have their axes in common."""
        compared = self.compared
        columns = [compared.situation, compared.fault_entry.codes]
        for axis in compared.axes.values():
            codes = axis.codes.copy()
            for scenario in range(len(compared.scenario.words)):
                here = compared.scenario.codes == scenario
                if not all(self._has_axis(axis.codes, here, name) for name in names):
                    codes[here] = -1
            columns.append(codes)
        return number_rows(*columns)

    def _has_axis(self, codes: Ints, here: Ints, name: str) -> bool:
        own = self.rows(name)
        return bool((codes[own[here[own]]] >= 0).any())
