CREATE VIEW v_timeline AS
SELECT c.campaign_id AS campaign, c.ordinal, c.scenario, c.architecture, t.fault_entry,
    c.result_digest AS run, e.seq, e.time_s, e.kind, e.subject, e.text
FROM campaign_case c
JOIN test_case t ON t.digest = c.test_case_digest
JOIN run r ON r.result_digest = c.result_digest
JOIN event e ON e.run_number = r.number
WHERE NOT EXISTS (SELECT 1 FROM withdrawal y WHERE y.result_digest = c.result_digest)
