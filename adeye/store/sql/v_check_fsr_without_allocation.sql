-- A requirement is allocated to no element.
-- Name the elements that meet it under allocation.
CREATE VIEW v_check_fsr_without_allocation AS
SELECT c.id AS campaign, 'fsr' AS part, f.id, 'no element has to meet it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE NOT EXISTS (
    SELECT 1 FROM allocation a WHERE a.concept_digest = f.concept_digest AND a.fsr_id = f.id)
