-- The formula of a requirement lets more time pass than its FDTI and FRTI.
-- Shorten the window of the formula, or correct fdti and frti.
--
-- A text, such as 'unbounded', stands for more than every number.
CREATE VIEW v_check_response_beyond_budget AS
SELECT c.id AS campaign, 'fsr' AS part, f.id,
    'the formula gives ' || CASE w.type WHEN 'text' THEN 'unbounded time'
        ELSE w.value || ' s' END || ' to respond, fdti and frti give '
        || b.budget_s || ' s' AS detail
FROM campaign c
JOIN fsr f ON f.concept_digest = c.concept_digest
JOIN json_each(f.content, '$.response_s') w ON TRUE
JOIN (
    SELECT DISTINCT concept, fsr, COALESCE(fdti_s, 0.0) + COALESCE(frti_s, 0.0) AS budget_s
    FROM v_fsr_goals WHERE COALESCE(fdti_s, frti_s) IS NOT NULL) b
    ON b.concept = f.concept_digest AND b.fsr = f.id
WHERE CASE w.type WHEN 'text' THEN 1e9 ELSE NUMBER(w.value) END > b.budget_s + 1e-9
