CREATE VIEW v_case_counts AS
SELECT k.campaign_id AS campaign, k.scenario, k.architecture, k.inside_odd, COUNT(*) AS planned,
    COUNT(r.number) AS results
FROM campaign_case k LEFT JOIN run r ON r.result_digest = k.result_digest
    AND NOT EXISTS (SELECT 1 FROM withdrawal y WHERE y.result_digest = k.result_digest)
GROUP BY k.campaign_id, k.scenario, k.architecture, k.inside_odd
