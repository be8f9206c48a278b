CREATE VIEW v_fsr_causes AS
SELECT DISTINCT a.concept_digest AS concept, a.fsr_id AS fsr, x.kind, x.name
FROM allocation a
JOIN v_element_causes x ON x.concept = a.concept_digest AND x.element = a.element_id
