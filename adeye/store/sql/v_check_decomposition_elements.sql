-- A child of a decomposition has no element of its own.
-- Allocate each child to an element that the other does not need.
CREATE VIEW v_check_decomposition_elements AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    x.child_id || ' has no element that the other child does without' AS detail
DECOMPOSED
WHERE NOT EXISTS (
    SELECT 1 FROM allocation a
    WHERE a.concept_digest = x.concept_digest AND a.fsr_id = x.child_id AND NOT EXISTS (
        SELECT 1 FROM decomposition_child y
        JOIN allocation b ON b.concept_digest = y.concept_digest AND b.fsr_id = y.child_id
        WHERE y.concept_digest = x.concept_digest AND y.fsr_id = x.fsr_id
            AND y.child_id <> x.child_id AND b.element_id = a.element_id))
