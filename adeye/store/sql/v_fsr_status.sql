-- Where the worst run of a block is withdrawn, the next one is read from its verdicts.
CREATE VIEW v_fsr_status AS
WITH withdrawn AS (
    SELECT c.campaign_id, f.fsr_id, c.architecture, c.scenario, v.verdict, -1 AS runs,
        0 - v.exercised AS exercised
    FROM (SELECT DISTINCT result_digest FROM withdrawal) x
    CROSS JOIN campaign_case c ON c.result_digest = x.result_digest
    CROSS JOIN work b ON b.campaign_id = c.campaign_id AND b.from_ordinal <= c.ordinal
        AND b.to_ordinal > c.ordinal AND b.state = 'done'
    CROSS JOIN campaign_fsr f ON $judged
    CROSS JOIN run r ON r.result_digest = c.result_digest
    CROSS JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest),
counted AS (
    SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS judged,
        SUM(exercised) AS exercised,
        $counts
    FROM (
        SELECT campaign_id, fsr_id, architecture, scenario, verdict, runs, exercised FROM tally
        UNION ALL SELECT * FROM withdrawn) told
    GROUP BY campaign_id, fsr_id, architecture, scenario),
standing AS (
    SELECT t.campaign_id, t.fsr_id, t.architecture, t.scenario, t.verdict, t.worst_margin,
        t.worst_robustness, t.worst_unit, t.worst_result_digest
    FROM tally t
    WHERE t.verdict IN $measured AND NOT EXISTS (
        SELECT 1 FROM withdrawal y WHERE y.result_digest = t.worst_result_digest)
    UNION ALL
    SELECT t.campaign_id, t.fsr_id, t.architecture, t.scenario, t.verdict, v.margin,
        v.robustness_low, v.unit, c.result_digest
    FROM tally t
    CROSS JOIN work b ON b.id = t.work_id
    CROSS JOIN campaign_case c ON c.campaign_id = b.campaign_id AND c.ordinal >= b.from_ordinal
        AND c.ordinal < b.to_ordinal AND c.architecture = t.architecture
        AND c.scenario = t.scenario
    CROSS JOIN campaign_fsr f ON $judged AND f.fsr_id = t.fsr_id
    CROSS JOIN run r ON r.result_digest = c.result_digest
    CROSS JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
        AND v.verdict = t.verdict
    WHERE t.verdict IN $measured AND EXISTS (
        SELECT 1 FROM withdrawal x WHERE x.result_digest = t.worst_result_digest)
        AND NOT EXISTS (SELECT 1 FROM withdrawal y WHERE y.result_digest = c.result_digest)),
worst AS (
    SELECT campaign_id, fsr_id, architecture, scenario, worst_margin, worst_robustness,
        worst_unit, worst_result_digest, ROW_NUMBER() OVER (
            PARTITION BY campaign_id, fsr_id, architecture, scenario
            ORDER BY $worst_first) AS place
    FROM standing)
SELECT f.campaign_id AS campaign, f.fsr_id AS fsr, f.architecture, f.scenario, f.asil,
    f.mandatory, f.in_gate, f.applicable, f.reason, f.min_exercised, f.waived_until, f.planned,
    $filled,
    f.planned - COALESCE(n.judged, 0) AS n_not_run, $exercised AS exercised,
    w.worst_margin, w.worst_unit AS unit, w.worst_robustness, w.worst_result_digest AS worst_run,
    CASE WHEN f.applicable = 0 THEN NULL $fold END AS verdict,
    COALESCE(n.exercised, 0) AS runs_exercised, COALESCE(a.exercised, 0) AS repeated,
    COALESCE(a.passed, 0) AS repeated_pass
FROM campaign_fsr f
LEFT JOIN counted n ON n.campaign_id = f.campaign_id AND n.fsr_id = f.fsr_id
    AND n.architecture = f.architecture AND n.scenario = f.scenario
LEFT JOIN worst w ON w.campaign_id = f.campaign_id AND w.fsr_id = f.fsr_id
    AND w.architecture = f.architecture AND w.scenario = f.scenario AND w.place = 1
LEFT JOIN case_repeat o ON o.campaign_id = f.campaign_id AND o.fsr_id = f.fsr_id
    AND o.architecture = f.architecture AND o.scenario = f.scenario
LEFT JOIN case_repeat a ON a.campaign_id = f.campaign_id AND a.fsr_id = f.fsr_id
    AND a.architecture = f.architecture AND a.scenario = ''
