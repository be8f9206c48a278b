-- An assumption is out of date.
-- Ask its owner, and set another date or remove what rests on it.
CREATE VIEW v_check_expired_assumption AS
SELECT c.id AS campaign, 'assumption' AS part, a.id,
    'was valid until ' || a.valid_until || ', of ' || a.owner AS detail
FROM campaign c
JOIN assumption a ON a.concept_digest = c.concept_digest
WHERE a.valid_until < date('now')
