-- A safety goal has no functional safety requirement, or none that is mandatory.
-- Write a requirement that names it under goals, or make one mandatory: no gate asks for the others.
CREATE VIEW v_check_goal_without_fsr AS
WITH served AS (
    SELECT g.concept_digest, g.id, g.asil, COUNT(f.id) AS fsrs, MAX(f.mandatory) AS mandatory
    FROM safety_goal g
    LEFT JOIN v_fsr_goals s ON s.concept = g.concept_digest AND s.goal = g.id
    LEFT JOIN fsr f ON f.concept_digest = s.concept AND f.id = s.fsr
    GROUP BY g.concept_digest, g.id, g.asil)
SELECT c.id AS campaign, 'safety_goal' AS part, s.id,
    'ASIL ' || s.asil || ', and ' || CASE WHEN s.fsrs = 0 THEN 'no requirement serves it'
        ELSE 'only optional requirements serve it' END AS detail
FROM campaign c
JOIN served s ON s.concept_digest = c.concept_digest
WHERE s.fsrs = 0 OR s.mandatory = 0
