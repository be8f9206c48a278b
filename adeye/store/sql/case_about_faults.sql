-- Results that exercise an FSR about faults, and those that are as without the faults.
WITH done AS (
    SELECT c.campaign_id, c.architecture, c.scenario, c.inside_odd, r.number,
        $has_fault AS has_fault,
        $happened AS happened
    FROM campaign_case c JOIN run r ON r.result_digest = c.result_digest
    JOIN test_case t ON t.digest = c.test_case_digest
    LEFT JOIN chain h ON h.run_number = r.number
    WHERE c.campaign_id = ?),
same AS (
    SELECT architecture, scenario, happened, MIN(has_fault) AS is_new FROM done
    GROUP BY architecture, scenario, happened),
told AS (
    SELECT c.architecture, c.scenario, c.happened,
        CASE WHEN MIN(c.has_fault) = 1 AND MAX(s.is_new) = 0 THEN 1 ELSE 0 END AS is_idle
    FROM done c
    JOIN same s ON s.architecture = c.architecture AND s.scenario = c.scenario
        AND s.happened = c.happened
    JOIN campaign_fsr f ON $judged
    JOIN verdict v ON v.run_number = c.number AND v.fsr_digest = f.fsr_digest
    WHERE f.fsr_id = ? AND v.exercised = 1
    GROUP BY c.architecture, c.scenario, c.happened)
SELECT architecture, scenario, SUM(is_idle), COUNT(*) FROM told
GROUP BY architecture, scenario ORDER BY architecture, scenario
