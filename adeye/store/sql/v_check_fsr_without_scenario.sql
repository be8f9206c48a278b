-- A requirement is judged in no planned scenario.
-- Add a scenario to the ODD that exercises it, or correct its scenarios.
CREATE VIEW v_check_fsr_without_scenario AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'no planned test case judges it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr p
    WHERE p.campaign_id = c.id AND p.fsr_id = f.id AND p.planned > 0)
