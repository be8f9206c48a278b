"""Ask the integrity rules: of a campaign in the database, or of a plan that is not saved."""

from __future__ import annotations

import json
import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from sqlalchemy import Connection, create_engine

from adeye.errors import SourceLocation
from adeye.store import tables
from adeye.store.cases import standing
from adeye.store.evidence.verification import require_sound
from adeye.store.ledger import insert_rows
from adeye.store.location import Place, locate
from adeye.store.read.campaigns import find_campaign, latest_campaign, plain_digests, uncertified
from adeye.store.records import CampaignInfo, CampaignRecord
from adeye.store.rules import (
    ALIKE,
    BEGINS,
    IDLE,
    IDLE_EVENT,
    IDLE_FAULT,
    NOT_CERTIFIED,
    PLACEHOLDER,
    RULES,
    UNBEGUN_EVENT,
    Rule,
    check_view_ddl,
)
from adeye.store.schema import opened
from adeye.store.write.content import save_concept, save_content
from adeye.store.write.planning import fsr_rows, judging_hash, save_campaign

if TYPE_CHECKING:
    from adeye.spec.concept import Requirement
    from adeye.spec.fault import Injected

_UNSAVED: Final = "unsaved"
_STANDS: Final = standing("run.result_digest")
PLAN_RULES: Final = tuple(rule for rule in RULES if not rule.needs_evidence)
"""Rules that a plan is enough for."""
EVIDENCE_RULES: Final = tuple(rule for rule in RULES if rule.needs_evidence)
"""Rules about runs and verdicts."""


@dataclass(frozen=True, slots=True)
class Violation:
    """Something that breaks an integrity rule.

    Attributes:
        rule: Name of the rule.
        part: Kind of what breaks it: ``fsr``, ``element``, ``scenario``, …
        id: Its id.
        detail: What is wrong with it.
        where: Its place in the files; None for what is only stored.
    """

    rule: str
    part: str
    id: str
    detail: str
    where: SourceLocation | None = None


@dataclass(frozen=True, slots=True)
class CampaignViolations:
    """What the rules say of a stored campaign.

    Attributes:
        campaign: The campaign.
        fsr_digests: Digest by which each of its FSRs is judged, by id.
        violations: In the order of the rules.
    """

    campaign: CampaignInfo
    fsr_digests: dict[str, str]
    violations: tuple[Violation, ...]


@dataclass(frozen=True, slots=True)
class Checked:
    """What was checked, and what was found.

    Attributes:
        odd: Id of the ODD.
        path: Its file; None for a stored campaign.
        campaign: Campaign whose evidence was looked at; None where there is none.
        rules: Rules that were asked, in the order of the findings.
        findings: What breaks them.
    """

    odd: str
    path: Path | None
    campaign: CampaignInfo | None
    rules: tuple[Rule, ...]
    findings: tuple[Violation, ...]

    @property
    def broken(self) -> dict[Rule, list[Violation]]:
        """Findings by rule."""
        found = {rule: [f for f in self.findings if f.rule == rule.name] for rule in self.rules}
        return {rule: findings for rule, findings in found.items() if findings}


def check_plan(
    record: CampaignRecord, counted: Counter[tuple[str, str, bool]]
) -> tuple[Violation, ...]:
    """Ask the rules that need no evidence of a plan, in a database that is gone at the end.

    Args:
        record: The campaign that would be planned.
        counted: Its test cases by architecture, scenario and whether they lie inside the ODD.
    """
    engine = create_engine("sqlite://")
    try:
        with engine.connect() as connection:
            tables.metadata.create_all(connection)
            for statement in check_view_ddl().values():
                connection.exec_driver_sql(statement)
            save_content(connection, "odd", record.odd)
            save_concept(connection, record.concept)
            fsrs = fsr_rows(_UNSAVED, record, counted)
            save_campaign(connection, _UNSAVED, record, counted.total(), judging_hash(fsrs))
            insert_rows(connection, tables.campaign_fsr, fsrs)
            return _ask(connection, PLAN_RULES, _UNSAVED)
    finally:
        engine.dispose()


def check_campaign(
    place: Place,
    name: str | None = None,
    *,
    odd: str | None = None,
    rules: Sequence[Rule] = RULES,
    must_be_sound: bool = False,
) -> CampaignViolations | None:
    """Ask rules of a campaign in a database.

    Args:
        place: The database, as everywhere.
        name: Number or beginning of the id of the campaign; None for the newest.
        odd: Take the newest of the ODD of this id.
        rules: Those to ask.
        must_be_sound: Whether evidence that is not as it was written is refused.

    Returns:
        None where there is no campaign, or no database, and none was named.

    Raises:
        InputError: There is no campaign of the name.
        IntegrityError: It has to be sound and is not.
        PlatformError: The database cannot be read.
    """
    location = locate(place)
    if name is None and location.path is not None and not location.path.is_file():
        return None
    with opened(location) as connection:
        campaign = (
            latest_campaign(connection, odd) if name is None else find_campaign(connection, name)
        )
        if campaign is None:
            return None
        if must_be_sound:
            require_sound(connection, campaign.id, has_figures=False)
        found = _ask(connection, rules, campaign.id)
        if IDLE_FAULT in rules:
            odd = _odd_content(connection, campaign.id).get("odd")
            declared = odd["faults"] if isinstance(odd, dict) else ()
            injected = injected_faults(connection, campaign.id)
            found += idle_violations([item["id"] for item in declared], injected)
        if UNBEGUN_EVENT in rules:
            found += tuple(
                Violation(UNBEGUN_EVENT.name, "scenario", scenario, f"{event} began in no run")
                for scenario, event, is_optional in unbegun_events(connection, campaign.id)
                if not is_optional
            )
        if IDLE_EVENT in rules:
            found += tuple(
                Violation(
                    IDLE_EVENT.name, "scenario", scenario, f"{event} changed nothing in any run"
                )
                for scenario, event in idle_events(connection, campaign.id)
            )
        if NOT_CERTIFIED in rules and (said := uncertified(connection, campaign.id)):
            found += (Violation(NOT_CERTIFIED.name, "odd", campaign.odd, said),)
        return CampaignViolations(campaign, plain_digests(connection, campaign.id), found)


def count_unknown(place: Place, campaign: str, results: Iterable[Sequence[str]]) -> tuple[int, int]:
    """Count the results that neither a campaign asks for nor anything has brought for good.

    What a campaign asks for and lacks is its own finding; what was withdrawn is not there.

    Args:
        place: The database, which is there.
        campaign: Id of the campaign.
        results: Digests of results, many at a time.

    Returns:
        How many are unknown, and how many were given.

    Raises:
        PlatformError: The database cannot be read.
    """
    unknown = total = 0
    with opened(place) as connection:
        for digests in results:
            given = json.dumps(list(digests))
            known = connection.exec_driver_sql(
                "SELECT result_digest FROM campaign_case WHERE campaign_id = ? "  # noqa: S608 - own
                "AND result_digest IN (SELECT value FROM json_each(?)) "
                "UNION SELECT result_digest FROM run "
                f"WHERE result_digest IN (SELECT value FROM json_each(?)) AND {_STANDS}",
                (campaign, given, given),
            )
            total += len(digests)
            found = set(known.scalars())
            unknown += sum(item not in found for item in digests)
    return unknown, total


_TEXTS: Final = (
    *(tables.hazardous_event, tables.safety_goal, tables.fsr, tables.element, tables.assumption),
    *(tables.decomposition, tables.dependent_failure),
)
"""Parts of a concept that argue."""


def _placeholders(connection: Connection, campaign: str) -> Iterator[Violation]:
    """Find texts of a concept that only hold a place; the detail begins with their key."""
    from adeye.spec.concept import is_placeholder

    for table in _TEXTS:
        found = connection.exec_driver_sql(
            f"SELECT p.id, p.content FROM campaign c JOIN {table.name} p "  # noqa: S608 - own names
            "ON p.concept_digest = c.concept_digest WHERE c.id = ? ORDER BY p.id",
            (campaign,),
        )
        for name, content in found.all():
            for key, text in json.loads(content).items():
                if isinstance(text, str) and is_placeholder(key, text):
                    yield Violation(PLACEHOLDER.name, table.name, name, f"{key} is {text!r}")


def _alike(connection: Connection, campaign: str) -> Iterator[Violation]:
    """Find decompositions of which two children have the same verdict on every run."""
    from adeye.spec.concept import Requirement
    from adeye.spec.quantity import SI

    children: dict[str, list[tuple[str, Requirement]]] = defaultdict(list)
    for name, child, content in connection.exec_driver_sql(
        "SELECT d.fsr_id, d.child_id, f.content FROM campaign c "
        "JOIN decomposition_child d ON d.concept_digest = c.concept_digest "
        "JOIN fsr f ON f.concept_digest = d.concept_digest AND f.id = d.child_id "
        "WHERE c.id = ? ORDER BY d.fsr_id, d.child_id",
        (campaign,),
    ).all():
        children[name].append((child, Requirement.model_validate_json(content, context=SI)))
    for name, parts in children.items():
        alike: list[list[tuple[str, Requirement]]] = []
        for part in parts:
            # However it is spelt, and wherever it is judged.
            own = next((kind for kind in alike if _ask_alike(kind[0][1], part[1])), None)
            if own is None:
                alike.append(own := [])
            own.append(part)
        for kind in alike:
            if len(kind) > 1:
                detail = (
                    f"{' and '.join(child for child, _ in kind)} have the same formula or bound"
                )
                yield Violation(ALIKE.name, "decomposition", name, detail)


def _ask_alike(one: Requirement, other: Requirement) -> bool:
    """Tell whether two FSRs ask for the same, as far as is found out."""
    from adeye.judge.first_row import Rows
    from adeye.judge.requirements import compile_requirement, measured
    from adeye.judge.short_runs import fail_alike

    asked = [
        {key: found[key] for key in ("formula", "bound") if found.get(key)}
        for found in (measured(one), measured(other))
    ]
    if asked[0] == asked[1]:
        return bool(asked[0])
    formulas = [compile_requirement(item).formula for item in (one, other)]
    if formulas[0] is None or formulas[1] is None:
        return False
    # No window is as long as such runs, or lies between two of their rows.
    rows = Rows(step=1e-4, end_s=math.inf)
    return fail_alike(formulas[0].root, formulas[1].root, rows) is True


def _ask(connection: Connection, rules: Iterable[Rule], campaign: str) -> tuple[Violation, ...]:
    found = _viewed(connection, rules, campaign)
    if ALIKE in rules:
        found += tuple(_alike(connection, campaign))
    if PLACEHOLDER not in rules:
        return found
    # One of a source is told already.
    told = {item.id for item in found if item.rule == "threshold_without_source"}
    more = _placeholders(connection, campaign)
    return found + tuple(
        item
        for item in more
        if item.id not in told or not item.detail.startswith("threshold_source ")
    )


def _viewed(connection: Connection, rules: Iterable[Rule], campaign: str) -> tuple[Violation, ...]:
    return tuple(
        Violation(rule.name, str(part), str(name), str(detail))
        for rule in rules
        if rule.has_view
        for part, name, detail in connection.exec_driver_sql(
            f"SELECT part, id, detail FROM {rule.view} "  # noqa: S608 - names of this package
            "WHERE campaign = ? ORDER BY part, id, detail",
            (campaign,),
        )
    )


def idle_violations(declared: Iterable[str], injected: Iterable[Injected]) -> tuple[Violation, ...]:
    """Say which faults do nothing, see ``idle_faults``."""
    from adeye.spec.fault import idle_faults

    return tuple(
        Violation(IDLE_FAULT.name, "fault", name, f"{name} {reason}")
        for name, reason in idle_faults(declared, injected)
    )


def injected_faults(connection: Connection, campaign: str) -> list[Injected]:
    """Read the faults of a campaign with what they are injected into, values of sweeps applied."""
    found = connection.exec_driver_sql(
        "SELECT d.faults, a.content FROM (SELECT DISTINCT t.faults, t.architecture_digest "
        "FROM campaign_case c JOIN test_case t ON t.digest = c.test_case_digest "
        "WHERE c.campaign_id = ? AND t.faults <> '[]') d "
        "JOIN architecture a ON a.digest = d.architecture_digest",
        (campaign,),
    ).all()
    if not found:
        return []
    from adeye.spec.architecture import Architecture
    from adeye.spec.fault import FAULT
    from adeye.spec.quantity import SI

    injected: list[Injected] = []
    for faults, content in found:
        known = json.loads(content)
        # Beside its own keys there is the folder of its plug-ins.
        fields = {name: known[name] for name in Architecture.model_fields if name in known}
        planned = (FAULT.validate_python(fault, context=SI) for fault in json.loads(faults))
        injected.append((tuple(planned), Architecture.model_validate(fields, context=SI)))
    return injected


def unbegun_events(connection: Connection, campaign: str) -> tuple[tuple[str, str, bool], ...]:
    """List the storyboard events that need not begin, and did in none of the runs that there are.

    Args:
        connection: To the database.
        campaign: Id of the campaign.

    Returns:
        Scenario, event, and whether it says that it is optional.
    """
    runs = (
        "SELECT 1 FROM campaign_case c JOIN run r ON r.result_digest = c.result_digest {} "
        "WHERE c.campaign_id = ? AND c.scenario = ? {} LIMIT 1"
    )
    executed = runs.format("", "")
    began = runs.format(
        f"JOIN event e ON e.run_number = r.number AND {standing('r.result_digest')}",
        "AND e.kind = 'storyboard' AND e.text IN (?, ?)",
    )
    return tuple(
        (scenario, name, bool(written.get("optional")))
        for scenario, content in _odd_content(connection, campaign).get("scenarios", {}).items()
        for name, written in content["storyboard"].items()
        if name not in content["realised"]
        and connection.exec_driver_sql(executed, (campaign, scenario)).first()
        and not connection.exec_driver_sql(
            began, (campaign, scenario, name + BEGINS, name + IDLE)
        ).first()
    )


def idle_events(connection: Connection, campaign: str) -> tuple[tuple[str, str], ...]:
    """List the storyboard events that began and changed nothing, in each run in which they did.

    Args:
        connection: To the database.
        campaign: Id of the campaign.

    Returns:
        Scenario and event.
    """
    began = (
        "SELECT DISTINCT c.scenario, e.subject FROM campaign_case c "  # noqa: S608 - own words
        "JOIN run r ON r.result_digest = c.result_digest JOIN event e ON e.run_number = r.number "
        f"AND {standing('r.result_digest')} "
        "WHERE c.campaign_id = ? AND e.kind = 'storyboard' AND e.text = e.subject || ?"
    )
    idle, real = (
        {(row[0], row[1]) for row in connection.exec_driver_sql(began, (campaign, end))}
        for end in (IDLE, BEGINS)
    )
    return tuple(sorted(idle - real))


def _odd_content(connection: Connection, campaign: str) -> dict[str, Any]:
    found = connection.exec_driver_sql(
        "SELECT o.content FROM campaign c JOIN odd o ON o.digest = c.odd_digest WHERE c.id = ?",
        (campaign,),
    )
    content: dict[str, Any] = json.loads(found.scalar_one())
    return content
