-- Planned test cases have no result.
-- Run the ODD again; it goes on where it stopped.
CREATE VIEW v_check_not_run AS
SELECT campaign, 'scenario' AS part, scenario AS id,
    SUM(planned - results) || ' of ' || SUM(planned) || ' test cases of ' || architecture
        || ' have no result' AS detail
FROM v_case_counts
GROUP BY campaign, scenario, architecture
HAVING SUM(results) < SUM(planned)
