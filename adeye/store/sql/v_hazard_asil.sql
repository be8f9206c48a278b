CREATE VIEW v_hazard_asil AS
SELECT e.concept_digest AS concept, e.id AS event,
    CASE WHEN e.severity NOT IN ('S0', 'S1', 'S2', 'S3')
        OR e.exposure NOT IN ('E0', 'E1', 'E2', 'E3', 'E4')
        OR e.controllability NOT IN ('C0', 'C1', 'C2', 'C3') THEN 'unknown'
    WHEN e.severity = 'S0' OR e.exposure = 'E0' OR e.controllability = 'C0' THEN NULL
    ELSE CASE CAST(substr(e.severity, 2) AS INTEGER) + CAST(substr(e.exposure, 2) AS INTEGER)
            + CAST(substr(e.controllability, 2) AS INTEGER)
        WHEN 10 THEN 'D' WHEN 9 THEN 'C' WHEN 8 THEN 'B' WHEN 7 THEN 'A' ELSE 'QM' END
    END AS asil
FROM hazardous_event e
