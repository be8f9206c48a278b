from adeye.store import tables
from adeye.store.database import Database
from adeye.store.encoding import row
from adeye.store.ledger import insert_rows
from adeye.store.repository import Repository


def test_known_rows_stay_and_of_one_key_the_first_goes_in(repository: Repository) -> None:
    def made(key: str, name: str) -> tuple[object, ...]:
        return row(tables.odd, (key * 64, name, "", "{}"))

    database = Database(repository.location)
    with database.write() as connection:
        insert_rows(connection, tables.odd, [made("a", "first")])
    with database.write() as connection:
        again = [made("a", "second"), made("b", "third"), made("b", "fourth")]
        insert_rows(connection, tables.odd, again, ignore_existing=True)
        insert_rows(connection, tables.odd, [], ignore_existing=True)
    with database.read() as connection:
        found = connection.exec_driver_sql("SELECT id FROM odd ORDER BY digest").scalars().all()
        counted = connection.exec_driver_sql("SELECT sum(row_count) FROM ledger").scalar_one()
    database.close()
    assert (found, counted) == (["first", "third"], 2)
