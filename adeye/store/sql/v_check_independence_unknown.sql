-- An element under a decomposition states no resources.
-- State its resources, such as power and computer: what is not stated cannot be compared.
CREATE VIEW v_check_independence_unknown AS
SELECT DISTINCT c.id AS campaign, 'element' AS part, a.element_id AS id,
    'states no resources, and ' || x.child_id || ' of ' || d.id || ' rests on it' AS detail
DECOMPOSED
JOIN allocation a ON a.concept_digest = x.concept_digest AND a.fsr_id = x.child_id
WHERE NOT EXISTS (
    SELECT 1 FROM element_relation r
    WHERE r.concept_digest = a.concept_digest AND r.element_id = a.element_id
        AND r.kind = 'resource')
