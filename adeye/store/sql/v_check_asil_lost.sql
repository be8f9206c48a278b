-- A requirement has a lower ASIL than its goal, and comes of no decomposition.
-- Give it the ASIL of the goal, or decompose a requirement into it.
CREATE VIEW v_check_asil_lost AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'has ASIL ' || f.asil || ', its goal ' || g.goal || ' has ' || LETTER(g.rank) AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN fsr f ON f.concept_digest = s.concept AND f.id = s.fsr
JOIN v_goal_asil g ON g.concept = s.concept AND g.goal = s.goal
WHERE RANK(f.asil) < g.rank AND NOT EXISTS (
    SELECT 1 FROM decomposition_child x
    JOIN v_fsr_goals p ON p.concept = x.concept_digest AND p.fsr = x.fsr_id AND p.goal = s.goal
    WHERE x.concept_digest = f.concept_digest AND x.child_id = f.id)
