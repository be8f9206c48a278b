FROM campaign c
JOIN decomposition d ON d.concept_digest = c.concept_digest
JOIN decomposition_child x ON x.concept_digest = d.concept_digest AND x.fsr_id = d.id
