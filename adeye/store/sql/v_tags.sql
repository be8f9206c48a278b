CREATE VIEW v_tags AS
SELECT c.id AS campaign, 'odd' AS kind, c.odd_id AS id, t.key AS tag, t.value AS text
FROM campaign c
JOIN odd o ON o.digest = c.odd_digest
JOIN json_each(o.content, '$.odd') p ON p.key = 'tags'
JOIN json_each(p.value) t ON TRUE
UNION ALL
SELECT c.id, CASE g.key WHEN 'scenarios' THEN 'scenario' ELSE 'architecture' END, p.key, t.key,
    t.value
FROM campaign c
JOIN odd o ON o.digest = c.odd_digest
JOIN json_each(o.content) g ON g.key IN ('scenarios', 'architectures')
JOIN json_each(g.value) p ON TRUE
JOIN json_each(p.value, '$.tags') t ON t.value <> ''
UNION ALL
SELECT c.id, 'concept', k.id, t.key, t.value
FROM campaign c
JOIN concept k ON k.digest = c.concept_digest
JOIN json_each(k.content, '$.tags') t ON TRUE
UNION ALL
SELECT c.id, 'fsr', f.id, t.key, t.value
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
JOIN json_each(f.content, '$.tags') t ON TRUE
