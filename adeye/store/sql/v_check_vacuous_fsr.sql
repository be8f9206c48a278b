-- A requirement was exercised in too few runs: what it asks about never came about.
-- Add scenarios or faults that bring its condition about, or correct its formula.
CREATE VIEW v_check_vacuous_fsr AS
WITH asked AS (
    SELECT t.campaign_id, t.fsr_id, t.architecture, SUM(t.runs) AS runs, MIN(h.antecedent) AS lacks,
        CASE WHEN COUNT(h.antecedent) > 0 THEN 0 ELSE SUM(t.exercised) END AS exercised
    FROM tally t
    LEFT JOIN (
        SELECT campaign_id, fsr_id, architecture, MIN(antecedent) AS antecedent
        FROM never_held WHERE decides = 1
        GROUP BY campaign_id, fsr_id, architecture) h ON h.campaign_id = t.campaign_id
        AND h.fsr_id = t.fsr_id AND h.architecture = t.architecture
    GROUP BY t.campaign_id, t.fsr_id, t.architecture)
SELECT campaign_id AS campaign, 'fsr' AS part, fsr_id AS id,
    'exercised in none of ' || SUM(runs) || ' runs'
        || COALESCE(': ' || MIN(lacks) || ' never held', '') AS detail
FROM asked
GROUP BY campaign_id, fsr_id
HAVING SUM(exercised) = 0
UNION ALL
SELECT g.campaign, 'fsr', g.fsr, 'exercised for ' || g.architecture || ' in ' || g.exercised
    || ' different results, ' || g.min_exercised || ' are needed'
FROM v_gate g
WHERE g.in_gate = 1 AND g.verdict = 'VACUOUS' AND EXISTS (
    SELECT 1 FROM asked a
    WHERE a.campaign_id = g.campaign AND a.fsr_id = g.fsr AND a.exercised > 0)
