-- A safety goal has a lower ASIL than one of its hazardous events.
-- Give it the highest ASIL of its events.
CREATE VIEW v_check_goal_asil AS
SELECT c.id AS campaign, 'safety_goal' AS part, g.id,
    'has ASIL ' || g.asil || ', its event ' || e.event || ' has ' || e.asil AS detail
FROM campaign c
JOIN safety_goal g ON g.concept_digest = c.concept_digest
JOIN v_goal_events v ON v.concept = g.concept_digest AND v.goal = g.id
JOIN (
    SELECT h.concept, h.event, CASE h.asil WHEN 'unknown' THEN x.asil ELSE h.asil END AS asil
    FROM v_hazard_asil h
    JOIN hazardous_event x ON x.concept_digest = h.concept AND x.id = h.event) e
    ON e.concept = v.concept AND e.event = v.event
WHERE RANK(g.asil) < RANK(e.asil)
