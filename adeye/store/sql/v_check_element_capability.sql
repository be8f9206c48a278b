-- A requirement is allocated to an element of a lower ASIL capability.
-- Allocate it to an able element, raise what is asked of this one, or decompose it.
CREATE VIEW v_check_element_capability AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'ASIL ' || f.asil || ' on ' || e.id || ', which is capable of ' || e.asil_capability AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
JOIN allocation a ON a.concept_digest = f.concept_digest AND a.fsr_id = f.id
JOIN element e ON e.concept_digest = a.concept_digest AND e.id = a.element_id
WHERE RANK(e.asil_capability) < RANK(f.asil)
