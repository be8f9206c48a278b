-- A requirement is judged in no planned scenario, or in fewer than what it is a part of.
-- Add a scenario to the ODD that exercises it, or correct its scenarios.
CREATE VIEW v_check_fsr_without_scenario AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'no planned test case judges it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr p
    WHERE p.campaign_id = c.id AND p.fsr_id = f.id AND p.planned > 0)
UNION ALL
SELECT DISTINCT c.id, 'fsr', x.child_id,
    'no test case of ' || p.scenario || ' judges it, where ' || x.fsr_id || ' needs it'
FROM campaign c
JOIN decomposition_child x ON x.concept_digest = c.concept_digest
JOIN decomposition_child y ON y.concept_digest = x.concept_digest AND y.fsr_id = x.fsr_id
JOIN campaign_fsr p ON p.campaign_id = c.id AND p.fsr_id IN (x.fsr_id, y.child_id) AND p.planned > 0
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr k
    WHERE k.campaign_id = c.id AND k.fsr_id = x.child_id AND k.scenario = p.scenario
        AND k.planned > 0)
    AND EXISTS (
        SELECT 1 FROM campaign_fsr k
        WHERE k.campaign_id = c.id AND k.fsr_id = x.child_id AND k.planned > 0)
