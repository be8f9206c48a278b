CREATE VIEW $view AS
SELECT $columns
FROM v_runs
WHERE scenario = '$scenario'
