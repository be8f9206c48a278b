-- What the goal says and what its events call for, whichever is higher.
CREATE VIEW v_goal_asil AS
SELECT concept, goal, MAX(rank) AS rank
FROM (
    SELECT g.concept_digest AS concept, g.id AS goal, RANK(g.asil) AS rank FROM safety_goal g
    UNION ALL
    SELECT v.concept, v.goal, RANK(e.asil) FROM v_goal_events v
    JOIN v_hazard_asil e ON e.concept = v.concept AND e.event = v.event) x
GROUP BY concept, goal
