-- Runs with equal results, by what is judged on them, whatever margin was found. Most campaigns have none, which one sort tells;
-- no verdict is read then.
WITH done AS (
    SELECT c.campaign_id, c.architecture, c.scenario, c.inside_odd, r.number,
        $happened AS happened
    FROM campaign_case c JOIN run r ON r.result_digest = c.result_digest
    LEFT JOIN chain h ON h.run_number = r.number
    WHERE c.campaign_id = ?),
same AS (
    SELECT architecture, happened FROM done
    GROUP BY architecture, happened HAVING COUNT(*) > 1 $or_contained)
SELECT f.fsr_id, c.architecture, c.scenario, c.happened,
    SUM(CASE v.verdict WHEN 'PASS' THEN 1 ELSE 0 END), SUM(v.exercised)
FROM same s
JOIN done c ON c.architecture = s.architecture AND c.happened = s.happened
JOIN campaign_fsr f ON $judged
JOIN verdict v ON v.run_number = c.number AND v.fsr_digest = f.fsr_digest
GROUP BY f.fsr_id, c.architecture, c.scenario, c.happened
