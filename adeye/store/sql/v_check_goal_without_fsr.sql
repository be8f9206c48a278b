-- A safety goal has no functional safety requirement.
-- Write a requirement that names it under goals.
CREATE VIEW v_check_goal_without_fsr AS
SELECT c.id AS campaign, 'safety_goal' AS part, g.id,
    'ASIL ' || g.asil || ', and no requirement serves it' AS detail
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM v_fsr_goals s WHERE s.concept = g.concept_digest AND s.goal = g.id)
