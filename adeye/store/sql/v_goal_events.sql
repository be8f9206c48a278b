CREATE VIEW v_goal_events AS
SELECT g.concept_digest AS concept, g.id AS goal, j.value AS event
FROM safety_goal g JOIN json_each(g.content, '$.hazardous_events') j ON TRUE
