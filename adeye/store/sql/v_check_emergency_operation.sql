-- Emergency operation lasts longer than its goal tolerates, or the goal tolerates none.
-- Shorten emergency_operation_interval, or state the goal's emergency operation and eotti.
CREATE VIEW v_check_emergency_operation AS
SELECT c.id AS campaign, 'fsr' AS part, s.fsr AS id,
    'emergency operation of ' || s.emergency_operation_s || ' s, and ' || g.id || ' tolerates '
        || COALESCE((SELECT NUMBER(value) FROM json_each(g.content, '$.eotti')) || ' s', 'none')
        AS detail
FROM campaign c
JOIN v_fsr_goals s ON s.concept = c.concept_digest
JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
WHERE s.emergency_operation_s
    > COALESCE((SELECT NUMBER(value) FROM json_each(g.content, '$.eotti')), 0.0) + 1e-9
