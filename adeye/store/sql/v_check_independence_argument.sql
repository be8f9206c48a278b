-- A decomposition has no argument for independence.
-- Say under independence why one child cannot fail with the other.
CREATE VIEW v_check_independence_argument AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    'nobody says why ' || d.scheme || ' are independent' AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
WHERE d.independence NOT GLOB '*[^ ]*'
