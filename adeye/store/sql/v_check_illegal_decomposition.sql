-- A decomposition is none of the table.
-- Two children whose ASIL make a scheme of the table, with the goal's ASIL in brackets.
CREATE VIEW v_check_illegal_decomposition AS
SELECT c.id AS campaign, 'decomposition' AS part, d.id,
    p.asil || ' into ' || COALESCE(k.children, 'nothing') || ' for a goal of ASIL '
        || g.asil AS detail
FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN fsr p ON p.concept_digest = d.concept_digest AND p.id = d.id
LEFT JOIN (
    SELECT x.concept_digest, x.fsr_id, COUNT(*) AS n, SUM(RANK(f.asil)) AS total,
        MIN(BRACKET(f.asil)) AS least, MAX(BRACKET(f.asil)) AS most,
        group_concat(f.asil, ' and ') AS children
    FROM decomposition_child x
    JOIN fsr f ON f.concept_digest = x.concept_digest AND f.id = x.child_id
    GROUP BY x.concept_digest, x.fsr_id) k
    ON k.concept_digest = d.concept_digest AND k.fsr_id = d.id
LEFT JOIN (
    SELECT s.concept, s.fsr, MAX(RANK(g.asil)) AS rank, MAX(g.asil) AS asil
    FROM v_fsr_goals s JOIN safety_goal g ON g.concept_digest = s.concept AND g.id = s.goal
    WHERE g.asil <> 'QM'
    GROUP BY s.concept, s.fsr) g ON g.concept = d.concept_digest AND g.fsr = d.id
WHERE COALESCE(k.n, 0) <> 2 OR k.total <> RANK(p.asil) OR RANK(p.asil) < 1
    OR COALESCE(k.least, -8) <> COALESCE(g.rank, -8)
    OR COALESCE(k.most, -8) <> COALESCE(g.rank, -8)
