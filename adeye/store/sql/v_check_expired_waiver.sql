-- A waiver is out of date.
-- Remove it, or have it renewed.
CREATE VIEW v_check_expired_waiver AS
SELECT c.id AS campaign, 'waiver' AS part, r.value AS id,
    'expired on ' || u.value AS detail
FROM campaign c
JOIN concept k ON k.digest = c.concept_digest
JOIN json_each(k.content, '$.waivers') w ON TRUE
JOIN json_each(w.value, '$.requirement') r ON TRUE
JOIN json_each(w.value, '$.expires') u ON TRUE
WHERE u.value < date('now')
