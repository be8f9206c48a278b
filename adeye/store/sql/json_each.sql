CREATE FUNCTION json_each(document text, path text DEFAULT '$')
RETURNS TABLE (key text, value text, type text) LANGUAGE sql IMMUTABLE PARALLEL SAFE AS $body$
WITH part AS (
    SELECT p.j, json_typeof(p.j) AS kind FROM (
        SELECT CASE path WHEN '$' THEN document::json
            ELSE document::json -> substr(path, 3) END AS j) p),
member AS (
    SELECT m.key, m.value FROM part,
        json_each(CASE part.kind WHEN 'object' THEN part.j ELSE '{}' END) m
    UNION ALL
    SELECT (a.place - 1)::text, a.value FROM part,
        json_array_elements(CASE part.kind WHEN 'array' THEN part.j ELSE '[]' END)
            WITH ORDINALITY AS a(value, place)
    UNION ALL
    SELECT NULL, part.j FROM part WHERE part.kind NOT IN ('object', 'array'))
SELECT member.key,
    CASE WHEN json_typeof(member.value) <> 'boolean' THEN member.value #>> '{}'
        WHEN member.value::text = 'true' THEN '1' ELSE '0' END,
    CASE json_typeof(member.value) WHEN 'string' THEN 'text' WHEN 'boolean' THEN member.value::text
        WHEN 'number' THEN CASE WHEN member.value::text ~ '[.eE]' THEN 'real' ELSE 'integer' END
        ELSE json_typeof(member.value) END
FROM member
$body$
