//! CSV: a file for each table, and one that tells what the columns are.

use std::path::Path;

use csv::Writer;

use super::Recorded;
use super::columns::Column;
use super::tables::{Table, tables};
use crate::record::Error;

/// The file that tells what the columns are.
const DICTIONARY: &str = "columns.csv";

/// Writes the tables of `session` into `folder`, and tells their rows.
pub fn write(session: &Recorded, folder: &Path) -> Result<Vec<(String, u64)>, Error> {
    let tables = tables(session)?;
    let columns: Vec<(&str, &Column)> = tables
        .iter()
        .flat_map(|table| table.columns.iter().map(move |column| (table.name, column)))
        .collect();
    write_dictionary(&folder.join(DICTIONARY), &columns)?;
    tables.into_iter().map(|table| write_table(folder, table)).collect()
}

fn write_dictionary(path: &Path, columns: &[(&str, &Column)]) -> Result<(), Error> {
    let refused = |fault| refused(path, fault);
    let mut file = Writer::from_path(path).map_err(refused)?;
    file.write_record(["table", "column", "type", "unit", "meaning"]).map_err(refused)?;
    for &(table, Column { name, kind, unit, meaning }) in columns {
        file.write_record([table, name, kind.word(), unit, meaning]).map_err(refused)?;
    }
    file.flush().map_err(Error::io("write", path))
}

fn write_table(folder: &Path, table: Table<'_>) -> Result<(String, u64), Error> {
    let path = folder.join(format!("{}.csv", table.name));
    let refused = |fault| refused(&path, fault);
    let mut file = Writer::from_path(&path).map_err(refused)?;
    file.write_record(table.columns.iter().map(|column| &column.name)).map_err(refused)?;
    let mut count = 0;
    for row in table.rows {
        // Numbers take the shortest form that reads back to the same bits.
        file.serialize(row?).map_err(refused)?;
        count += 1;
    }
    file.flush().map_err(Error::io("write", &path))?;
    Ok((table.name.to_owned(), count))
}

fn refused(path: &Path, fault: csv::Error) -> Error {
    let cause = match fault.into_kind() {
        csv::ErrorKind::Io(cause) => cause,
        other => std::io::Error::other(format!("{other:?}")),
    };
    Error::Io { action: "write", path: path.to_owned(), cause }
}
