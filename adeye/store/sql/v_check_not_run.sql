-- Planned test cases, or twins with half the step, have no result that counts.
-- Run the ODD again; it goes on where it stopped. What is withdrawn stays so.
CREATE VIEW v_check_not_run AS
SELECT campaign, 'scenario' AS part, scenario AS id,
    SUM(planned - results) || ' of ' || SUM(planned) || ' test cases of ' || architecture
        || ' have no result' AS detail
FROM v_case_counts
GROUP BY campaign, scenario, architecture
HAVING SUM(results) < SUM(planned)
UNION ALL
SELECT u.campaign_id, 'scenario', u.scenario,
    COUNT(DISTINCT x.result_digest) || ' runs with half the step of ' || u.architecture
        || ' are withdrawn, so that its numeric uncertainty is unknown'
FROM (SELECT DISTINCT campaign_id, scenario, architecture FROM uncertainty) u
JOIN campaign_case c ON c.campaign_id = u.campaign_id AND c.scenario = u.scenario
    AND c.architecture = u.architecture
JOIN half_step h ON h.origin_digest = c.result_digest
JOIN withdrawal x ON x.result_digest = h.result_digest
GROUP BY u.campaign_id, u.scenario, u.architecture
