-- What happened in a run, whatever faults were present meanwhile: behind the links of parts
-- stands that of all but the presence of faults, in newer databases.
CASE WHEN LENGTH(h.links) > $length * (r.trace_rows / h.every_rows)
    THEN SUBSTR(h.links, $length * (r.trace_rows / h.every_rows) + 1)
    ELSE r.trace_digest END
