-- Blocks that are not done may have runs, too: those that another campaign executed. Withdrawn
-- results are none.
CREATE VIEW v_coverage AS
SELECT campaign, scenario, architecture, fault_entry, SUM(planned) AS planned, SUM(done) AS done,
    SUM(exercised) AS exercised
FROM (
    SELECT campaign_id AS campaign, scenario, architecture, fault_entry, planned, 0 AS done,
        0 AS exercised
    FROM case_count
    UNION ALL
    SELECT campaign_id, scenario, architecture, fault_entry, 0, runs, exercised
    FROM case_tally
    UNION ALL
    SELECT c.campaign_id, c.scenario, c.architecture, t.fault_entry, 0, 1,
        CASE WHEN EXISTS (
            SELECT 1 FROM campaign_fsr f
            JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
            WHERE $judged AND v.exercised = 1) THEN 1 ELSE 0 END
    FROM work w
    JOIN campaign_case c ON c.campaign_id = w.campaign_id
        AND c.ordinal >= w.from_ordinal AND c.ordinal < w.to_ordinal
    JOIN run r ON r.result_digest = c.result_digest
    JOIN test_case t ON t.digest = c.test_case_digest
    WHERE w.state <> 'done'
    UNION ALL
    SELECT c.campaign_id, c.scenario, c.architecture, t.fault_entry, 0, -1,
        CASE WHEN EXISTS (
            SELECT 1 FROM campaign_fsr f
            JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
            WHERE $judged AND v.exercised = 1) THEN -1 ELSE 0 END
    FROM (SELECT DISTINCT result_digest FROM withdrawal) x
    JOIN campaign_case c ON c.result_digest = x.result_digest
    JOIN run r ON r.result_digest = c.result_digest
    JOIN test_case t ON t.digest = c.test_case_digest) counted
GROUP BY campaign, scenario, architecture, fault_entry
