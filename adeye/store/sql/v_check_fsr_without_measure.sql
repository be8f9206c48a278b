-- A requirement has neither a formula nor a bound on a metric.
-- Write one: what nothing measures cannot pass.
CREATE VIEW v_check_fsr_without_measure AS
SELECT c.id AS campaign, 'fsr' AS part, f.id, 'nothing measures it' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE f.measure NOT GLOB '*[^ ]*'
