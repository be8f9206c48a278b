-- Schema 0007 for SQLite. A line of two dashes stands between statements.

--

DROP VIEW v_gate

--

DROP VIEW v_fsr_status

--

CREATE VIEW v_fsr_status AS
WITH withdrawn AS (
    SELECT c.campaign_id, f.fsr_id, c.architecture, c.scenario, v.verdict, -1 AS runs,
        0 - v.exercised AS exercised
    FROM (SELECT DISTINCT result_digest FROM withdrawal) x
    CROSS JOIN campaign_case c ON c.result_digest = x.result_digest
    CROSS JOIN work b ON b.campaign_id = c.campaign_id AND b.from_ordinal <= c.ordinal
        AND b.to_ordinal > c.ordinal AND b.state = 'done'
    CROSS JOIN campaign_fsr f ON f.campaign_id = c.campaign_id AND f.architecture = c.architecture
    AND f.scenario = c.scenario AND f.applicable = 1
    AND f.applies IN ('everywhere', CASE c.inside_odd WHEN 1 THEN 'inside' ELSE 'outside' END)
    CROSS JOIN run r ON r.result_digest = c.result_digest
    CROSS JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest),
counted AS (
    SELECT campaign_id, fsr_id, architecture, scenario, SUM(runs) AS judged,
        SUM(exercised) AS exercised,
        SUM(CASE verdict WHEN 'FAIL' THEN runs ELSE 0 END) AS n_fail,
    SUM(CASE verdict WHEN 'ERROR' THEN runs ELSE 0 END) AS n_error,
    SUM(CASE verdict WHEN 'INVALID' THEN runs ELSE 0 END) AS n_invalid,
    SUM(CASE verdict WHEN 'INCONCLUSIVE' THEN runs ELSE 0 END) AS n_inconclusive,
    SUM(CASE verdict WHEN 'VACUOUS' THEN runs ELSE 0 END) AS n_vacuous,
    SUM(CASE verdict WHEN 'PASS' THEN runs ELSE 0 END) AS n_pass
    FROM (
        SELECT campaign_id, fsr_id, architecture, scenario, verdict, runs, exercised FROM tally
        UNION ALL SELECT * FROM withdrawn) told
    GROUP BY campaign_id, fsr_id, architecture, scenario),
worst AS (
    SELECT campaign_id, fsr_id, architecture, scenario, worst_margin, worst_robustness,
        worst_unit, worst_result_digest, ROW_NUMBER() OVER (
            PARTITION BY campaign_id, fsr_id, architecture, scenario
            ORDER BY verdict = 'FAIL' DESC, (worst_margin IS NULL) = (verdict <> 'FAIL'), worst_margin, worst_result_digest) AS place
    FROM tally WHERE verdict IN ('FAIL', 'PASS', 'INCONCLUSIVE'))
SELECT f.campaign_id AS campaign, f.fsr_id AS fsr, f.architecture, f.scenario, f.asil,
    f.mandatory, f.in_gate, f.applicable, f.reason, f.min_exercised, f.waived_until, f.planned,
    COALESCE(n.n_fail, 0) AS n_fail,
    COALESCE(n.n_error, 0) AS n_error,
    COALESCE(n.n_invalid, 0) AS n_invalid,
    COALESCE(n.n_inconclusive, 0) AS n_inconclusive,
    COALESCE(n.n_vacuous, 0) AS n_vacuous,
    COALESCE(n.n_pass, 0) AS n_pass,
    f.planned - COALESCE(n.judged, 0) AS n_not_run, CASE WHEN COALESCE(n.exercised, 0) > 0 THEN CASE WHEN COALESCE(n.exercised, 0) > COALESCE(o.exercised, 0) THEN COALESCE(n.exercised, 0) - COALESCE(o.exercised, 0) ELSE 1 END ELSE 0 END AS exercised,
    w.worst_margin, w.worst_unit AS unit, w.worst_robustness, w.worst_result_digest AS worst_run,
    CASE WHEN f.applicable = 0 THEN NULL WHEN f.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' WHEN n_error > 0 THEN 'ERROR' WHEN n_invalid > 0 THEN 'INVALID' WHEN n_inconclusive > 0 THEN 'INCONCLUSIVE' WHEN f.planned > COALESCE(n.judged, 0) THEN 'NOT_RUN' WHEN n_pass >= 1 THEN 'PASS' ELSE 'VACUOUS' END AS verdict,
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

--

CREATE VIEW v_gate AS
WITH summed AS (
    SELECT campaign, architecture, fsr, MAX(asil) AS asil, MAX(in_gate) AS in_gate,
        MAX(applicable) AS applicable, MAX(reason) AS reason,
        MAX(min_exercised) AS min_exercised, MAX(waived_until) AS waived_until,
        SUM(planned) AS planned,
        SUM(n_fail) AS n_fail,
    SUM(n_error) AS n_error,
    SUM(n_invalid) AS n_invalid,
    SUM(n_inconclusive) AS n_inconclusive,
    SUM(n_vacuous) AS n_vacuous,
    SUM(n_pass) AS n_pass,
        SUM(n_not_run) AS n_not_run, SUM(runs_exercised) AS runs_exercised,
        MAX(repeated) AS repeated, MAX(repeated_pass) AS repeated_pass
    FROM v_fsr_status WHERE mandatory = 1
    GROUP BY campaign, architecture, fsr),
worst AS (
    SELECT campaign, architecture, fsr, worst_margin, unit, worst_robustness, worst_run,
        ROW_NUMBER() OVER (
            PARTITION BY campaign, architecture, fsr
            ORDER BY n_fail > 0 DESC, (worst_margin IS NULL) = (n_fail = 0),
                worst_margin, worst_run) AS place
    FROM v_fsr_status WHERE worst_run IS NOT NULL)
SELECT s.*, CASE WHEN runs_exercised > 0 AND NOT EXISTS (SELECT 1 FROM never_held h WHERE h.campaign_id = s.campaign AND h.fsr_id = s.fsr AND h.architecture = s.architecture AND h.decides = 1) THEN CASE WHEN runs_exercised > repeated THEN runs_exercised - repeated ELSE 1 END ELSE 0 END AS exercised, w.worst_margin, w.unit, w.worst_robustness, w.worst_run,
    CASE WHEN s.applicable = 0 THEN CASE WHEN s.in_gate = 1 THEN 'ERROR' END WHEN s.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' WHEN n_error > 0 THEN 'ERROR' WHEN n_invalid > 0 THEN 'INVALID' WHEN n_inconclusive > 0 THEN 'INCONCLUSIVE' WHEN s.planned > COALESCE(s.planned - s.n_not_run, 0) THEN 'NOT_RUN' WHEN CASE WHEN n_pass > 0 THEN CASE WHEN n_pass > repeated_pass THEN n_pass - repeated_pass ELSE 1 END ELSE 0 END >= s.min_exercised AND NOT EXISTS (SELECT 1 FROM never_held h WHERE h.campaign_id = s.campaign AND h.fsr_id = s.fsr AND h.architecture = s.architecture AND h.decides = 1) THEN 'PASS' ELSE 'VACUOUS' END AS verdict,
    CASE WHEN s.applicable = 0 THEN CASE WHEN s.in_gate = 1 THEN 'ERROR' END WHEN s.planned = 0 THEN 'NOT_RUN' WHEN n_fail > 0 THEN 'FAIL' WHEN n_error > 0 THEN 'ERROR' WHEN CASE WHEN n_pass > 0 THEN CASE WHEN n_pass > repeated_pass THEN n_pass - repeated_pass ELSE 1 END ELSE 0 END >= s.min_exercised AND NOT EXISTS (SELECT 1 FROM never_held h WHERE h.campaign_id = s.campaign AND h.fsr_id = s.fsr AND h.architecture = s.architecture AND h.decides = 1) THEN 'PASS' ELSE 'VACUOUS'
        END AS verdict_waived
FROM summed s
LEFT JOIN worst w ON w.campaign = s.campaign AND w.architecture = s.architecture
    AND w.fsr = s.fsr AND w.place = 1
