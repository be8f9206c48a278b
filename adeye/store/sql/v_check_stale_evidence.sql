-- Results are there that were not judged by a requirement as it is now.
-- Run the ODD again; what is there is judged, not executed.
CREATE VIEW v_check_stale_evidence AS
SELECT s.campaign_id AS campaign, 'fsr' AS part, s.fsr_id AS id,
    (SUM(s.results) - SUM(COALESCE(j.runs, 0))) || ' of ' || SUM(s.results)
        || ' results are not judged by it' AS detail
FROM (SELECT f.campaign_id, f.fsr_id, f.architecture, f.scenario, SUM(n.results) AS results
    ITS_SIDE) s
LEFT JOIN (JUDGED) j ON j.campaign_id = s.campaign_id AND j.fsr_id = s.fsr_id
    AND j.architecture = s.architecture AND j.scenario = s.scenario
WHERE s.results > COALESCE(j.runs, 0)
GROUP BY s.campaign_id, s.fsr_id
