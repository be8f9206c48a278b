"""Saved queries: what people ask the database most, by name, over its documented views."""

from __future__ import annotations

from dataclasses import dataclass, replace
from string import Template
from typing import Final


@dataclass(frozen=True, slots=True)
class SavedQuery:
    """A query with a name.

    Attributes:
        name: What it is called by.
        text: What it answers.
        sql: One SELECT.
        basis: One SELECT of a number: of how much the query can tell anything.
        lacking: What no rows mean where that number is 0, and what brings it.
    """

    name: str
    text: str
    sql: str
    basis: str = "SELECT COUNT(*) FROM campaign"
    lacking: str = "the database has no campaign: 'adeye run ODD' makes one"

    def about_one(self) -> SavedQuery:
        """Ask about the campaign that the parameter ``:campaign`` names instead of the latest."""
        sql, basis = (text.replace(_LATEST, ":campaign") for text in (self.sql, self.basis))
        lacking = self.lacking.replace("the latest campaign", "this campaign")
        return replace(self, sql=sql, basis=basis, lacking=lacking)


_LATEST: Final = "(SELECT campaign FROM v_campaigns WHERE recency = 1)"

_QUERIES: Final = (
    SavedQuery(
        "campaigns",
        "every campaign with its ODD and size, the latest first",
        """SELECT number, substr(campaign, 1, 10) AS campaign, odd, planned, created_at, title
FROM v_campaigns ORDER BY recency""",
    ),
    SavedQuery(
        "failing-fsrs",
        "FSRs that fail, where, how often and by what margin at worst",
        """SELECT architecture, fsr, asil, scenario, n_fail, planned, exercised, worst_margin,
    unit, substr(worst_run, 1, 10) AS worst_run
FROM v_fsr_status
WHERE campaign = $latest AND verdict = 'FAIL'
ORDER BY in_gate DESC, architecture, fsr, n_fail DESC""",
        "SELECT COUNT(*) FROM v_fsr_status WHERE campaign = $latest AND exercised > 0",
        "no FSR of the latest campaign was exercised: 'adeye run ODD' executes what has no result, "
        "'adeye query unexercised' tells the rest",
    ),
    SavedQuery(
        "gate",
        "every mandatory FSR with its counts and folded verdict",
        """SELECT architecture, in_gate, fsr, asil, verdict, n_pass, n_fail, n_error, n_invalid,
    n_inconclusive, n_vacuous, n_not_run, exercised, min_exercised
FROM v_gate WHERE campaign = $latest
ORDER BY in_gate DESC, architecture, fsr""",
    ),
    SavedQuery(
        "worst-runs",
        "the three worst runs of each FSR and architecture",
        """WITH ranked AS (
    SELECT *, ROW_NUMBER() OVER (
        PARTITION BY fsr, architecture
        ORDER BY verdict = 'FAIL' DESC, (margin IS NULL) = (verdict <> 'FAIL'), margin, run,
            ordinal) AS place
    FROM v_verdicts
    WHERE campaign = $latest AND verdict IN ('FAIL', 'PASS', 'INCONCLUSIVE'))
SELECT fsr, architecture, scenario, fault_entry, verdict, margin, unit, signal, actor, time_s,
    substr(run, 1, 10) AS run
FROM ranked WHERE place <= 3
ORDER BY fsr, architecture, place""",
    ),
    SavedQuery(
        "fault-coverage",
        "runs planned, done and exercising an FSR, by fault entry",
        """SELECT fault_entry, scenario, architecture, planned, done, exercised
FROM v_coverage WHERE campaign = $latest
ORDER BY fault_entry, scenario, architecture""",
    ),
    SavedQuery(
        "architecture-pairs",
        "how two architectures differ in the same situations, on average and at most",
        """SELECT architecture_a, architecture_b, scenario, fault_entry, COUNT(*) AS pairs,
    SUM(contact_a) AS contacts_a, SUM(contact_b) AS contacts_b,
    AVG(min_distance_m_difference) AS mean_min_distance_m_b_minus_a,
    MIN(min_distance_m_difference) AS least_min_distance_m_b_minus_a,
    MAX(min_distance_m_difference) AS most_min_distance_m_b_minus_a
FROM v_architecture_pairs WHERE campaign = $latest
GROUP BY architecture_a, architecture_b, scenario, fault_entry
ORDER BY architecture_a, architecture_b, scenario, fault_entry""",
        "SELECT COUNT(*) FROM v_architecture_pairs WHERE campaign = $latest",
        "no two architectures of the latest campaign have a result in the same situation: name "
        "two in the ODD, and 'adeye run ODD' executes them",
    ),
    SavedQuery(
        "metrics-by-architecture",
        "contacts and the worst of each metric, by architecture and scenario",
        """SELECT architecture, scenario, COUNT(*) AS runs, SUM(contact) AS contacts,
    MAX(impact_speed_mps) AS max_impact_speed_mps, MIN(min_distance_m) AS min_distance_m,
    MIN(min_ttc_s) AS min_ttc_s, MIN(min_time_headway_s) AS min_time_headway_s,
    MAX(max_required_deceleration_mps2) AS max_required_deceleration_mps2,
    MAX(rss_violation_s) AS max_rss_violation_s, MAX(max_jerk_mps3) AS max_jerk_mps3
FROM v_runs WHERE campaign = $latest
GROUP BY architecture, scenario
ORDER BY architecture, scenario""",
    ),
    SavedQuery(
        "outcomes",
        "what happened to the runs: completed, a channel failed, not realised",
        """SELECT architecture, scenario, outcome, COALESCE(outcome_channel, '') AS channel,
    end_reason, COUNT(*) AS runs
FROM v_runs WHERE campaign = $latest
GROUP BY architecture, scenario, outcome, channel, end_reason
ORDER BY architecture, scenario, outcome, channel, end_reason""",
    ),
    SavedQuery(
        "least-slack",
        "how far each mandatory FSR is from failing, the nearest first",
        """SELECT architecture, fsr, asil, scenario, verdict, worst_margin AS slack, unit,
    worst_robustness AS slack_in_scales, substr(worst_run, 1, 10) AS worst_run
FROM v_fsr_status
WHERE campaign = $latest AND mandatory = 1 AND (worst_margin IS NOT NULL OR verdict = 'FAIL')
ORDER BY in_gate DESC, worst_robustness, architecture, fsr, scenario""",
        """SELECT COUNT(*) FROM v_fsr_status
WHERE campaign = $latest AND mandatory = 1 AND (worst_margin IS NOT NULL OR verdict = 'FAIL')""",
        "no mandatory FSR of the latest campaign has a margin yet: 'adeye run ODD' measures them",
    ),
    SavedQuery(
        "unexercised",
        "FSRs whose precondition held in no run of a scenario",
        """SELECT architecture, fsr, asil, scenario, planned, n_vacuous, n_not_run
FROM v_fsr_status
WHERE campaign = $latest AND applicable = 1 AND exercised = 0
ORDER BY in_gate DESC, architecture, fsr, scenario""",
    ),
    SavedQuery(
        "undetected-faults",
        "faults that no run of an architecture detected",
        """SELECT architecture, fault_entry, COUNT(*) AS runs,
    COUNT(fault_detection_time_s) AS detected
FROM v_runs
WHERE campaign = $latest AND fault_entry <> 'none'
    AND fault_detection_time_s_status IN ('value', 'incomplete')
GROUP BY architecture, fault_entry HAVING COUNT(fault_detection_time_s) = 0
ORDER BY architecture, fault_entry""",
        """SELECT COUNT(*) FROM v_runs
WHERE campaign = $latest AND fault_entry <> 'none'
    AND fault_detection_time_s_status IN ('value', 'incomplete')""",
        "no run says how long a fault took to be detected: the latest campaign has no faults, "
        "their runs have no result yet ('adeye run ODD'), or none took effect ('adeye faults')",
    ),
    SavedQuery(
        "evidence-by-element",
        "what hangs on each element: the FSRs allocated to it and their verdicts",
        """SELECT a.element_id AS element, g.architecture, g.fsr, g.asil, g.verdict, g.n_pass,
    g.exercised
FROM campaign c
JOIN allocation a ON a.concept_digest = c.concept_digest
JOIN v_gate g ON g.campaign = c.id AND g.fsr = a.fsr_id
WHERE c.id = $latest
ORDER BY element, g.in_gate DESC, g.architecture, g.fsr""",
    ),
    SavedQuery(
        "contacts",
        "runs with a contact, the hardest first",
        """SELECT substr(run, 1, 10) AS run, architecture, scenario, fault_entry, impact_speed_mps,
    contact_time_s AS time_s, contact_actor AS actor, parameters
FROM v_runs WHERE campaign = $latest AND contact = 1
ORDER BY impact_speed_mps DESC, ordinal""",
        "SELECT COUNT(*) FROM v_runs WHERE campaign = $latest AND contact IS NOT NULL",
        "no run of the latest campaign has a result: 'adeye run ODD' executes it",
    ),
)

SAVED: Final = {
    query.name: replace(
        query,
        sql=Template(query.sql).substitute(latest=_LATEST),
        basis=Template(query.basis).substitute(latest=_LATEST),
    )
    for query in _QUERIES
}
"""Saved queries by name; each is about the latest campaign, but for ``campaigns``."""
