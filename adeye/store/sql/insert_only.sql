CREATE FUNCTION insert_only() RETURNS trigger LANGUAGE plpgsql AS $body$
BEGIN
    RAISE EXCEPTION '% is insert-only', TG_TABLE_NAME;
END
$body$
