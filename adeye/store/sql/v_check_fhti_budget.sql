-- Detection and reaction times of requirements exceed the FTTI of their goal.
-- Shorten fdti or frti, or show that the goal has more time.
CREATE VIEW v_check_fhti_budget AS
SELECT c.id AS campaign, 'fsr' AS part, s.fsr AS id,
    'FDTI ' || s.fdti_s || ' s and FRTI ' || s.frti_s || ' s exceed the ' || g.ftti_s
        || ' s of ' || g.id AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
WHERE s.fdti_s + s.frti_s > g.ftti_s + 1e-9
UNION ALL
SELECT c.id, 'safety_goal', g.id, 'FDTI ' || b.fdti_s || ' s and FRTI ' || b.frti_s
    || ' s of its requirements exceed its ' || g.ftti_s || ' s'
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
JOIN (
    SELECT concept, goal, COALESCE(MAX(CASE WHEN frti_s IS NULL THEN fdti_s END), 0.0) AS fdti_s,
        COALESCE(MAX(CASE WHEN fdti_s IS NULL THEN frti_s END), 0.0) AS frti_s
    FROM v_fsr_goals GROUP BY concept, goal) b
    ON b.concept = g.concept_digest AND b.goal = g.id
WHERE b.fdti_s + b.frti_s > g.ftti_s + 1e-9
