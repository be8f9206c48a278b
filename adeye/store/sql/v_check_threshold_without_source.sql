-- The threshold of a requirement has no source.
-- Say under threshold_source where the number comes from.
CREATE VIEW v_check_threshold_without_source AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'nobody says where ' || f.measure || ' comes from' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
WHERE f.threshold_source NOT GLOB '*[^ ?.!-]*' OR lower(f.threshold_source) IN
    ('tbd', 'tbd.', 'tbc', 'tbc.', 'todo', 'todo.', 'n/a', 'na', 'none', 'none.', 'unknown',
    'unknown.')
