-- A dependent-failure record is out of date.
-- Review it and set another date, or remove it.
CREATE VIEW v_check_expired_dfa AS
SELECT c.id AS campaign, 'dependent_failure' AS part, w.id,
    'was valid until ' || w.valid_until AS detail
FROM campaign c
JOIN dependent_failure w ON w.concept_digest = c.concept_digest
WHERE w.valid_until < date('now')
