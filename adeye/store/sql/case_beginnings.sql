-- Runs of an architecture that begin alike and last differently, the longest first.
WITH done AS (
    SELECT c.architecture, r.trace_rows, h.links, r.trace_rows / h.every_rows AS parts,
        SUBSTR(h.links, 1, $length) AS beginning, $happened AS happened
    FROM campaign_case c JOIN run r ON r.result_digest = c.result_digest
    JOIN chain h ON h.run_number = r.number
    WHERE c.campaign_id = ? AND r.trace_rows >= h.every_rows),
alike AS (
    SELECT architecture, beginning FROM done GROUP BY architecture, beginning
    HAVING MIN(trace_rows) < MAX(trace_rows))
SELECT d.architecture, d.trace_rows, d.links, d.parts, d.happened
FROM alike a JOIN done d ON d.architecture = a.architecture AND d.beginning = a.beginning
ORDER BY d.trace_rows DESC
