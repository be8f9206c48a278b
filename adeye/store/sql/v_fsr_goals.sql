CREATE VIEW v_fsr_goals AS
SELECT f.concept_digest AS concept, f.id AS fsr, j.value AS goal,
    (SELECT NUMBER(value) FROM json_each(f.content, '$.fdti')) AS fdti_s,
    (SELECT NUMBER(value) FROM json_each(f.content, '$.frti')) AS frti_s,
    (SELECT NUMBER(value) FROM json_each(f.content, '$.emergency_operation_interval'))
        AS emergency_operation_s
FROM fsr f JOIN json_each(f.content, '$.goals') j ON TRUE
