-- A withdrawn run is none: its numbers would count in whatever is asked of runs.
-- Metrics come before the rest of a run, and the test case last: a filter leaves few of them.
CREATE VIEW v_runs AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    t.replicate, t.seed, c.inside_odd, t.parameters, c.point, c.result_digest AS run,
    c.test_case_digest AS test_case, t.situation_digest AS situation, r.outcome, r.outcome_channel,
    r.outcome_detail, r.realised, r.end_reason, r.duration_s, r.backend, r.trace_digest,
    r.machine_dependent, r.executed_at,
    $metrics,
    $verdicts AS verdicts
FROM campaign_case c
LEFT JOIN case_run o ON o.campaign_id = c.campaign_id AND o.ordinal = c.ordinal
JOIN metric m ON m.run_number = $number
JOIN run r ON r.number = m.run_number
LEFT JOIN timing n ON n.run_number = m.run_number
LEFT JOIN criticality k ON k.run_number = m.run_number
LEFT JOIN test_case t ON t.digest = c.test_case_digest
WHERE NOT EXISTS (SELECT 1 FROM withdrawal y WHERE y.result_digest = c.result_digest)
