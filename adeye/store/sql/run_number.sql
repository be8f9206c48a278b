-- The number of a run, from where blocks that are done note it; a digest falls anywhere into an
-- index, which takes longer than all the rest of a row.
COALESCE($own.run_number, (
    SELECT x.number FROM run x WHERE x.result_digest = $case.result_digest))
