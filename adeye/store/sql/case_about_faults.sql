-- Results that exercise an FSR about faults, and those that are as without one of the faults.
WITH named AS ($named),
done AS (
    SELECT n.fault, c.campaign_id, c.architecture, c.scenario, c.inside_odd, r.number,
        CASE WHEN REPLACE('+' || t.fault_entry || '+', n.fault, '') <> '+' || t.fault_entry || '+'
            OR (n.fault = '+*+' AND t.fault_entry <> '$no_fault') THEN 1 ELSE 0 END AS has_fault,
        $happened AS happened
    FROM campaign_case c JOIN run r ON r.result_digest = c.result_digest
    JOIN test_case t ON t.digest = c.test_case_digest
    LEFT JOIN chain h ON h.run_number = r.number
    CROSS JOIN named n
    WHERE c.campaign_id = ?),
same AS (
    SELECT fault, architecture, scenario, happened, MIN(has_fault) AS is_new FROM done
    GROUP BY fault, architecture, scenario, happened),
told AS (
    SELECT c.architecture, c.scenario, c.happened,
        CASE WHEN MIN(c.has_fault) = 1 AND MAX(s.is_new) = 0 THEN 1 ELSE 0 END AS is_idle
    FROM done c
    JOIN same s ON s.fault = c.fault AND s.architecture = c.architecture
        AND s.scenario = c.scenario AND s.happened = c.happened
    JOIN campaign_fsr f ON $judged
    JOIN verdict v ON v.run_number = c.number AND v.fsr_digest = f.fsr_digest
    WHERE f.fsr_id = ? AND v.exercised = 1
    GROUP BY c.fault, c.architecture, c.scenario, c.happened),
every_one AS (
    SELECT architecture, scenario, happened, MAX(is_idle) AS is_idle FROM told
    GROUP BY architecture, scenario, happened)
SELECT architecture, scenario, SUM(is_idle), COUNT(*) FROM every_one
GROUP BY architecture, scenario ORDER BY architecture, scenario
