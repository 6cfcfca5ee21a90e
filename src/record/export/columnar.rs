//! Parquet: a file for each table, with units in the schema.

use std::collections::HashMap;
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

use arrow_array::builder::{Float64Builder, StringBuilder, UInt32Builder};
use arrow_array::{ArrayRef, RecordBatch};
use arrow_schema::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;

use super::Recorded;
use super::columns::{Column, Kind};
use super::tables::{Cell, Cells, Table, tables};
use crate::record::Error;

/// Rows that are held in memory at a time.
const BATCH: usize = 8192;

/// Writes the tables of `session` into `folder`, and tells their rows.
pub fn write(session: &Recorded, folder: &Path) -> Result<Vec<(String, u64)>, Error> {
    let tables = tables(session)?;
    tables.into_iter().map(|table| write_table(session, folder, table)).collect()
}

fn write_table(
    session: &Recorded,
    folder: &Path,
    table: Table<'_>,
) -> Result<(String, u64), Error> {
    let path = folder.join(format!("{}.parquet", table.name));
    let schema = Arc::new(schema(session, &table.columns));
    let file = File::create(&path).map_err(Error::io("write", &path))?;
    let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
    let mut file =
        ArrowWriter::try_new(file, schema.clone(), Some(properties)).map_err(refused(&path))?;
    let mut rows = table.rows;
    let mut count = 0;
    loop {
        let batch: Vec<Cells<'_>> = rows.by_ref().take(BATCH).collect::<Result<_, _>>()?;
        if batch.is_empty() {
            break;
        }
        count += batch.len() as u64;
        let arrays = table.columns.iter().enumerate();
        let arrays = arrays.map(|(place, column)| array(column.kind, &batch, place)).collect();
        let batch = RecordBatch::try_new(schema.clone(), arrays).map_err(refused(&path))?;
        file.write(&batch).map_err(refused(&path))?;
    }
    file.close().map_err(refused(&path))?;
    Ok((table.name.to_owned(), count))
}

/// The columns with their units and meanings, and of which session they are.
fn schema(session: &Recorded, columns: &[Column]) -> Schema {
    let fields: Vec<Field> = columns.iter().map(field).collect();
    let about = session.facts().map(|(name, value)| (name.to_owned(), value));
    Schema::new(fields).with_metadata(HashMap::from(about))
}

fn field(column: &Column) -> Field {
    let kind = match column.kind {
        Kind::Text => DataType::Utf8,
        Kind::Whole => DataType::UInt32,
        Kind::Number => DataType::Float64,
    };
    let about: HashMap<String, String> = [("unit", column.unit), ("meaning", column.meaning)]
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .into();
    Field::new(&column.name, kind, true).with_metadata(about)
}

/// The cells at `place` of all `rows`.
fn array(kind: Kind, rows: &[Cells<'_>], place: usize) -> ArrayRef {
    let cells = rows.iter().map(|row| row.get(place).unwrap_or(&Cell::Missing));
    match kind {
        Kind::Text => {
            let mut array = StringBuilder::new();
            for cell in cells {
                array.append_option(if let Cell::Text(text) = cell { Some(text) } else { None });
            }
            Arc::new(array.finish())
        }
        Kind::Whole => {
            let mut array = UInt32Builder::new();
            for cell in cells {
                array.append_option(if let Cell::Whole(number) = cell {
                    Some(*number)
                } else {
                    None
                });
            }
            Arc::new(array.finish())
        }
        Kind::Number => {
            let mut array = Float64Builder::new();
            for cell in cells {
                array.append_option(if let Cell::Number(number) = cell {
                    Some(*number)
                } else {
                    None
                });
            }
            Arc::new(array.finish())
        }
    }
}

/// For `map_err`: what could not be written to `path`.
fn refused<E: std::error::Error + Send + Sync + 'static>(
    path: &Path,
) -> impl Fn(E) -> Error + use<'_, E> {
    move |fault| Error::Io {
        action: "write",
        path: path.to_owned(),
        cause: io::Error::other(fault),
    }
}
