-- A hazardous event with an ASIL has no safety goal.
-- Name it under hazardous_events of a safety goal.
CREATE VIEW v_check_hazard_without_goal AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    'ASIL ' || e.asil || ', and no safety goal is against it' AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
WHERE e.asil <> 'QM' AND NOT EXISTS (
    SELECT 1 FROM v_goal_events g WHERE g.concept = e.concept_digest AND g.event = e.id)
