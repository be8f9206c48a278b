-- The elements of a decomposition share what no dependent-failure record covers.
-- Take it apart, or write a record under dependent_failures and name it under dfa.
CREATE VIEW v_check_common_cause AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    x.child_id || ' and ' || y.child_id || ' share ' || a.kind || ' ' || a.name AS detail
DECOMPOSED
JOIN decomposition_child y ON y.concept_digest = x.concept_digest AND y.fsr_id = x.fsr_id
    AND y.child_id > x.child_id
JOIN v_fsr_causes a ON a.concept = x.concept_digest AND a.fsr = x.child_id
JOIN v_fsr_causes b ON b.concept = a.concept AND b.fsr = y.child_id AND b.kind = a.kind
    AND b.name = a.name
WHERE NOT EXISTS (
    SELECT 1 FROM json_each(d.content, '$.dfa') n
    JOIN dependent_failure w ON w.concept_digest = d.concept_digest AND w.id = n.value
    JOIN json_each(w.content, '$.covers') v ON TRUE
    WHERE v.value = a.name)
