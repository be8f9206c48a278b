"""Evidence goes stale exactly where it depends on what was edited, on random ODDs."""

from __future__ import annotations

import random  # noqa: TID251 - which ODDs are tried
import tempfile
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from adeye.campaign import stale
from adeye.campaign.plan import CampaignPlan, make_plan
from adeye.campaign.stale import CAUSES, find_stale
from adeye.judge.outcome import UNTESTED
from adeye.judge.requirements import compile_requirement
from adeye.judge.verdict import Outcome, Verdict
from adeye.store.records import MetricValue, VerdictRecord
from adeye.store.repository import Repository
from adeye.store.tables import METRIC_IDS
from adeye.units import read_quantity
from tests.judge.conftest import fsr
from tests.project import CONCEPT, Project
from tests.store.rows import RunRecord, complete_block

SCENARIOS = {
    "cut_in": ("ego_speed", ["100 km/h", "110 km/h", "120 km/h"]),
    "lead_braking": ("time_gap", ["1 s", "1.5 s", "2 s"]),
    "cut_out_to_stopped": ("ego_speed", ["60 km/h", "70 km/h", "80 km/h"]),
}
ARCHITECTURES = ("legacy_camera", "camera_radar")
FAULTS = {
    "camera_out": {"target": "sensors.front_camera", "model": "drop_out"},
    "silent": {"target": "channels.nominal", "model": "silent"},
}
MEASURES: list[dict[str, Any]] = [
    {"formula": "always(not contact)"},
    {"formula": "always(abs(ego.lane_offset) <= 0.6 m)"},
    {"formula": "always(in_odd)"},
    {"bound": {"metric": "min_ttc_s", "at_least": 1.5}},
    {"bound": {"metric": "min_distance_m", "at_least": 1}},
]


@dataclass(frozen=True)
class Pair:
    """A run with a verdict, by where the run stands."""

    scenario: str
    architecture: str
    fault_entry: str
    value: str
    fsr: str


@dataclass
class Graph:
    """What a random ODD is made of."""

    scenarios: dict[str, list[str]]
    architectures: list[str]
    faults: list[str]
    fsrs: dict[str, dict[str, Any]] = field(default_factory=dict)

    @classmethod
    def draw(cls, rnd: random.Random) -> Graph:
        names = rnd.sample(sorted(SCENARIOS), rnd.randint(1, 3))
        graph = cls(
            {name: rnd.sample(SCENARIOS[name][1], rnd.randint(2, 3)) for name in names},
            rnd.sample(ARCHITECTURES, rnd.randint(1, 2)),
            rnd.sample(sorted(FAULTS), rnd.randint(0, 2)),
        )
        for number in range(rnd.randint(2, 5)):
            # A copy: what two share would be one thing in the file, and edited as one.
            own = {
                **deepcopy(rnd.choice(MEASURES)),
                "scenarios": rnd.sample(names, rnd.randint(0, 1)),
            }
            graph.fsrs[f"F-{number}"] = own
        return graph

    def pairs(self) -> set[Pair]:
        return {
            Pair(scenario, architecture, entry, value, fsr)
            for scenario, values in self.scenarios.items()
            for value in values
            for architecture in self.architectures
            for entry in ("none", *self.faults)
            for fsr, own in self.fsrs.items()
            if not own["scenarios"] or scenario in own["scenarios"]
        }

    def write(self, project: Project) -> None:
        project.write(
            "odd/tested.yaml",
            {
                "odd": "tested",
                "attributes": {"dynamic_elements": {"ego_speed": {"max": "130 km/h"}}},
                "scenarios": [
                    {"use": name, "sweep": {"parameters": {SCENARIOS[name][0]: values}}}
                    for name, values in self.scenarios.items()
                ],
                "faults": [
                    {"id": name, "onset": {"at": "2 s"}, **FAULTS[name]} for name in self.faults
                ],
                "architectures": [f"architectures/{name}.yaml" for name in self.architectures],
                "concept": "concepts/motorway_chauffeur.yaml",
                "gate": {"architectures": self.architectures[:1]},
                "step": "0.05 s",
                "seed": 7,
            },
        )
        with project.edited(CONCEPT) as concept:
            first = concept["requirements"][0]
            bare = {key: value for key, value in first.items() if key not in {"formula", "bound"}}
            concept["requirements"] = [
                {**bare, "id": name, **own} for name, own in self.fsrs.items()
            ]


Edit = tuple["Callable[[Project], None]", list[dict[str, str]]]
"""What is edited, and fields of the evidence that depends on it; of all if there are none."""
"""What is edited, and which evidence depends on it."""


def change(name: str, edit: Callable[[Any], None]) -> Callable[[Project], None]:
    def done(project: Project) -> None:
        with project.edited(name) as content:
            edit(content)

    return done


def requirement(concept: Any, fsr: str) -> Any:
    return next((item for item in concept["requirements"] if item["id"] == fsr), {})


def threshold(concept: Any, fsr: str) -> None:
    item = requirement(concept, fsr)
    if "bound" in item:
        item["bound"]["at_least"] += 0.125
    elif item:
        item["formula"] = f"{item['formula']} and always(ego.speed < 90 m/s)"


IN_ODD = "always(in_odd)"
SPELLINGS = {
    "always(not contact)": "always  ((not (contact)))",
    "always(abs(ego.lane_offset) <= 0.6 m)": "always(abs( ego.lane_offset )<=60 cm)",
    "always(in_odd)": "always in_odd",
    1.5: "1500 ms",
    1: "100 cm",
}
"""Other words for the measures."""


def respell(concept: Any) -> None:
    """Write every requirement otherwise, in another order of its keys."""
    for number, item in enumerate(concept["requirements"]):
        if "formula" in item:
            item["formula"] = SPELLINGS.get(item["formula"], f"({item['formula']} )")
        else:
            least = item["bound"]["at_least"]
            item["bound"]["at_least"] = SPELLINGS.get(least, float(least))
        concept["requirements"][number] = dict(reversed(item.items()))


def comment(project: Project) -> None:
    path = project.folder / CONCEPT
    path.write_text(f"# Said before.\n{path.read_text('utf-8')}\n# Said after.\n", "utf-8")


def edits(graph: Graph, rnd: random.Random) -> list[Edit]:
    """Draw one edit of every kind with what depends on it, told from the kind alone."""
    scenario = rnd.choice(sorted(graph.scenarios))
    architecture = rnd.choice(graph.architectures)
    fsr = rnd.choice(sorted(graph.fsrs))
    value = rnd.choice(graph.scenarios[scenario])
    about_odd = [{"fsr": fsr} for fsr, own in graph.fsrs.items() if own.get("formula") == IN_ODD]
    odd = "odd/tested.yaml"
    catalogue = f"scenarios_db/motorway/{scenario}.yaml"
    parts = f"odd/architectures/{architecture}.yaml"
    there, mine = [{"scenario": scenario}], [{"architecture": architecture}]

    def slippery(content: Any) -> None:
        content["parameters"]["friction"].update(default=0.8)

    def faster(content: Any) -> None:
        content["attributes"]["dynamic_elements"]["ego_speed"].update(max="131 km/h")

    def fewer(content: Any) -> None:
        use = next(use for use in content["scenarios"] if use["use"] == scenario)
        use["sweep"]["parameters"][SCENARIOS[scenario][0]].remove(value)

    def renamed(content: Any) -> None:
        content.update(title="Another", cost=content.get("cost", 0) + 1)

    found: list[Edit] = [
        (change(catalogue, lambda c: c.update(tail="7 s")), there),
        (change(catalogue, slippery), there),
        (change(catalogue, lambda c: c.update(title="Another", text="Other words.")), []),
        (change(parts, lambda c: c["vehicle"].update(acceleration_lag="0.35 s")), mine),
        (change(parts, renamed), []),
        (change(CONCEPT, lambda c: threshold(c, fsr)), [{"fsr": fsr}]),
        (change(CONCEPT, lambda c: requirement(c, fsr).update(text="Other", mandatory=False)), []),
        (change(CONCEPT, lambda c: c.update(title="Another")), []),
        (comment, []),
        (change(odd, lambda c: c.update(seed=8)), [{}]),
        (change(odd, lambda c: c.update(step="0.025 s")), [{}]),
        (change(odd, faster), about_odd),
        (change(odd, fewer), [{"scenario": scenario, "value": value}]),
    ]
    if graph.faults:
        fault = rnd.choice(graph.faults)

        def later(content: Any) -> None:
            next(f for f in content["faults"] if f["id"] == fault).update(onset={"at": "3 s"})

        found.append((change(odd, later), [{"fault_entry": fault}]))
    if len(graph.architectures) > 1:
        last = {"architecture": graph.architectures[-1]}
        found.append((change(odd, lambda c: c["architectures"].pop()), [last]))
    return found


def depends(pair: Pair, on: list[dict[str, str]]) -> bool:
    fields = vars(pair)
    return any(wanted.items() <= fields.items() for wanted in on)


def complete(repository: Repository, plan: CampaignPlan) -> str:
    """Give every test case of a plan a result and verdicts without executing it."""
    stored = repository.plan_campaign(plan.record(), plan.planned(), block_size=64)
    digests = {item.requirement.id: item.digest for item in plan.requirements}
    metrics = {name: MetricValue(None, "not_applicable") for name in METRIC_IDS}
    while (block := repository.claim_block(campaign=stored.campaign)) is not None:
        runs = []
        for case in block.to_execute:
            architecture = plan.cases[case.ordinal].architecture.architecture
            runs.append(
                RunRecord(
                    test_case=case.test_case,
                    engine=plan.engines[architecture],
                    outcome=Outcome.COMPLETED,
                    trace_rows=11,
                    duration_s=0.5,
                    trace_digest=case.result_digest[:32],
                    is_realised=True,
                    end_reason="horizon",
                    metrics=metrics,
                    verdicts=[
                        VerdictRecord(fsr, digests[fsr], Verdict.PASS, is_exercised=True)
                        for fsr in case.missing_fsrs
                    ],
                )
            )
        assert complete_block(repository, block, runs)
    return stored.campaign


def places(plan: CampaignPlan, graph: Graph) -> dict[Pair, tuple[str, str]]:
    """Find the result of every pair of a graph."""
    results: dict[tuple[str, str, str, str], str] = {}
    for case in plan.cases:
        name = SCENARIOS[case.scenario_id][0]
        value = next(
            text
            for text in SCENARIOS[case.scenario_id][1]
            if abs(read_quantity(text)[0] - case.parameters[name]) < 1e-9
        )
        engine = plan.engines[case.architecture.architecture]
        key = case.scenario_id, case.architecture.architecture, case.fault_entry, value
        results[key] = engine.result_digest(case.digest)
    return {
        pair: (results[pair.scenario, pair.architecture, pair.fault_entry, pair.value], pair.fsr)
        for pair in graph.pairs()
    }


def check(seed: int) -> set[str]:
    """Edit a random ODD; what is stale is what depends on the edits. Return the causes."""
    rnd = random.Random(seed)  # noqa: S311 - a test
    graph = Graph.draw(rnd)
    with tempfile.TemporaryDirectory() as folder:
        project = Project(Path(folder) / "project")
        graph.write(project)
        plan = make_plan(project.odd)
        with Repository.open(project.db) as repository:
            campaign = complete(repository, plan)
            where = places(plan, graph)
            info = repository.find_campaign(campaign)
            untouched = find_stale(repository, make_plan(project.odd), info)
            assert (untouched.evidence, untouched.counts) == (len(where), len(where))
            assert untouched.planned == untouched.there == len(where)
            chosen = rnd.sample(edits(graph, rnd), rnd.randint(1, 3))
            change(CONCEPT, respell)(project)
            respelt = find_stale(repository, make_plan(project.odd), info)
            assert (respelt.stale, respelt.counts) == ((), len(where))
            assert respelt.planned == respelt.there == len(where)
            graph.write(project)
            for edit, _ in chosen:
                edit(project)
            found = find_stale(repository, make_plan(project.odd), info)
        expected = {
            key for pair, key in where.items() if any(depends(pair, on) for _, on in chosen)
        }
        assert set(found.pairs) == expected
        assert found.counts == len(where) - len(expected)
        assert sum(item.evidence for item in found.stale) == len(expected)
        assert all(item.text for item in found.stale)
        return {item.cause for item in found.stale}


def test_run_that_bars_every_verdict_is_judged_without_its_trace() -> None:
    reasons = {1: "the lead never began to brake", 2: f"{UNTESTED}the fault never acted", 3: None}
    again = Mock()
    again.judged.return_value = {}
    again.bases.return_value = {number: (False, why, {}) for number, why in reasons.items()}
    again.files.return_value = ()
    asked = [("new", compile_requirement(fsr(formula="always(not contact)")))]
    found = stale._judgeable(again, asked, list(reasons), Path("adeye.db"))
    assert list(found) == ["to_judge", "to_replay", "to_replay"]


@pytest.mark.slow
def test_stale_is_exactly_what_depends_on_the_edits_of_many_random_odds() -> None:
    causes = set().union(*(check(seed) for seed in range(60)))
    kinds = "scenario parameters architecture faults seed step requirement attributes not_planned"
    assert set(kinds.split()) <= causes <= set(CAUSES)
