-- The ASIL of a hazardous event is not the one of its classes.
-- Correct severity, exposure or controllability; the ASIL follows from them.
CREATE VIEW v_check_hazard_asil AS
SELECT c.id AS campaign, 'hazardous_event' AS part, e.id,
    e.severity || ' ' || e.exposure || ' ' || e.controllability || ' give '
        || COALESCE(h.asil, 'no ASIL') || ', the event has ' || COALESCE(e.asil, 'none') AS detail
FROM campaign c
JOIN hazardous_event e ON e.concept_digest = c.concept_digest
JOIN v_hazard_asil h ON h.concept = e.concept_digest AND h.event = e.id
WHERE COALESCE(h.asil, '') <> COALESCE(e.asil, '')
