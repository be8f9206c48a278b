CREATE VIEW v_forks AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    f.origin_digest AS run, f.result_digest AS fork, f.authority, f.from_tick,
    f.from_tick * t.step_s AS from_time_s, o.class, o.takeover_s, o.violation_s,
    o.fork_violation_s, r.outcome, r.end_reason, r.duration_s
FROM fork f
JOIN run r ON r.result_digest = f.result_digest
JOIN campaign_case c ON c.result_digest = f.origin_digest
JOIN test_case t ON t.digest = c.test_case_digest
LEFT JOIN takeover o ON o.fork_digest = f.result_digest AND o.version = (
    SELECT MAX(x.version) FROM takeover x WHERE x.fork_digest = f.result_digest)
WHERE NOT EXISTS (SELECT 1 FROM withdrawal y
    WHERE y.result_digest IN (c.result_digest, f.result_digest))
