-- No requirement is judged in a planned scenario.
-- Remove the scenario from the ODD, or write what it is there for.
CREATE VIEW v_check_orphan_scenario AS
SELECT DISTINCT c.id AS campaign, 'scenario' AS part, n.value AS id,
    'no requirement is judged in it' AS detail
FROM campaign c
JOIN json_each(c.factors) x ON TRUE
JOIN json_each(x.value, '$.scenario') n ON TRUE
WHERE NOT EXISTS (
    SELECT 1 FROM campaign_fsr p
    WHERE p.campaign_id = c.id AND p.scenario = n.value AND p.planned > 0)
