-- No planned scenario stands for a hazardous event.
-- Add one to the ODD, and mandatory requirements of the event's goals that are judged in it.
CREATE VIEW v_check_hazard_without_scenario AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    'no mandatory requirement of its goals is judged in ' || l.value AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN json_each(e.content, '$.scenarios') l ON TRUE
WHERE NOT EXISTS (
    SELECT 1 FROM v_goal_events g
    JOIN v_fsr_goals s ON s.concept = g.concept AND s.goal = g.goal
    JOIN campaign_fsr p ON p.campaign_id = c.id AND p.fsr_id = s.fsr AND p.scenario = l.value
    WHERE g.concept = e.concept_digest AND g.event = e.id AND p.planned > 0 AND p.mandatory = 1)
UNION ALL
SELECT c.id, 'hazardous_event', e.id, 'no mandatory requirement of its goals is judged anywhere'
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
WHERE e.asil <> 'QM' AND NOT EXISTS (SELECT 1 FROM json_each(e.content, '$.scenarios'))
    AND EXISTS (
        SELECT 1 FROM v_goal_events g JOIN v_fsr_goals s ON s.concept = g.concept
            AND s.goal = g.goal
        WHERE g.concept = e.concept_digest AND g.event = e.id)
    AND NOT EXISTS (
        SELECT 1 FROM v_goal_events g
        JOIN v_fsr_goals s ON s.concept = g.concept AND s.goal = g.goal
        JOIN campaign_fsr p ON p.campaign_id = c.id AND p.fsr_id = s.fsr
        WHERE g.concept = e.concept_digest AND g.event = e.id AND p.planned > 0
            AND p.mandatory = 1)
