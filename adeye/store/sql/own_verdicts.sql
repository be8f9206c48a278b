-- While trusted_schema is off, SQLite 3.40 lets a view use json_each, but no json function.
(
    SELECT '{' || COALESCE(group_concat('"' || fsr || '":"' || verdict || '"', ','), '') || '}'
    FROM (
        SELECT v.fsr, v.verdict FROM v_verdicts v
        WHERE v.campaign = $case.campaign_id AND v.ordinal = $case.ordinal ORDER BY v.fsr) judged
    )
