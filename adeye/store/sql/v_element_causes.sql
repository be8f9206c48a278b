-- A resource that is itself an element goes by the element. What follows 'element' is nothing, in
-- the collation of the column: PostgreSQL wants the same one in both halves of a recursion.
CREATE VIEW v_element_causes AS
WITH RECURSIVE edge(concept, source, kind, name) AS (
    SELECT r.concept_digest, r.element_id,
        CASE WHEN r.kind = 'resource' AND e.id IS NOT NULL THEN 'element' ELSE r.kind END, r.name
    FROM element_relation r
    LEFT JOIN element e ON e.concept_digest = r.concept_digest AND e.id = r.name
    WHERE r.kind IN ('resource', 'software', 'supplier')
    UNION ALL
    SELECT r.concept_digest, r.element_id, 'element' AS kind, p.element_id
    FROM element_relation r
    JOIN element_relation p ON p.concept_digest = r.concept_digest AND p.kind = 'provides'
        AND p.name = r.name
    WHERE r.kind = 'consumes'),
above(concept, element, kind, name) AS (
    SELECT concept_digest, id, 'element' || substr(id, 1, 0), id FROM element
    UNION
    SELECT a.concept, a.element, x.kind, x.name
    FROM above a JOIN edge x ON x.concept = a.concept AND x.source = a.name
    WHERE a.kind = 'element')
SELECT concept, element, kind, name FROM above
