CREATE VIEW v_gate AS
WITH summed AS (
    SELECT campaign, architecture, fsr, MAX(asil) AS asil, MAX(in_gate) AS in_gate,
        MAX(applicable) AS applicable, MAX(reason) AS reason,
        MAX(min_exercised) AS min_exercised, MAX(waived_until) AS waived_until,
        SUM(planned) AS planned,
        $sums,
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
SELECT s.*, $exercised AS exercised, w.worst_margin, w.unit, w.worst_robustness, w.worst_run,
    CASE WHEN s.applicable = 0 THEN CASE WHEN s.in_gate = 1 THEN 'ERROR' END $fold END AS verdict,
    CASE WHEN s.applicable = 0 THEN CASE WHEN s.in_gate = 1 THEN 'ERROR' END $waived_fold
        END AS verdict_waived
FROM summed s
LEFT JOIN worst w ON w.campaign = s.campaign AND w.architecture = s.architecture
    AND w.fsr = s.fsr AND w.place = 1
