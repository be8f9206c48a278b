-- Runs on the wrong side of the ODD's border are counted as evidence.
-- Run 'adeye db verify': counts of this database are not those that adeye writes.
CREATE VIEW v_check_outside_odd AS
SELECT j.campaign_id AS campaign, 'fsr' AS part, j.fsr_id AS id,
    SUM(j.runs - COALESCE(s.planned, 0)) || ' runs too many are counted in ' || j.scenario
        AS detail
FROM (JUDGED) j
LEFT JOIN (SELECT f.campaign_id, f.fsr_id, f.architecture, f.scenario, SUM(n.planned) AS planned
    ITS_SIDE) s ON s.campaign_id = j.campaign_id AND s.fsr_id = j.fsr_id
    AND s.architecture = j.architecture AND s.scenario = j.scenario
WHERE j.runs > COALESCE(s.planned, 0)
GROUP BY j.campaign_id, j.fsr_id, j.scenario
