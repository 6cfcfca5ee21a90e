//! Golden runs, read and compared.

use std::fs::File;
use std::io::Read;
use std::path::PathBuf;

use flate2::read::GzDecoder;
use serde_json::Value;

/// The text of a file of a case, such as `rfwr/a_1d`.
pub fn read(case: &str, file: &str) -> String {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "tests/data", case, file].iter().collect();
    let mut text = String::new();
    let file = File::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    if path.extension().is_some_and(|extension| extension == "gz") {
        GzDecoder::new(file).read_to_string(&mut text).unwrap();
    } else {
        { file }.read_to_string(&mut text).unwrap();
    }
    text
}

/// The rows of a table of numbers, without its head.
pub fn table(case: &str, file: &str) -> Vec<Vec<f64>> {
    let number = |cell: &str| cell.parse().unwrap();
    read(case, file).lines().skip(1).map(|row| row.split(',').map(number).collect()).collect()
}

/// A number, list or matrix, row by row.
pub fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap()],
    }
}

/// Demands that the columns agree, relative to the golden column's range.
pub fn agree(what: &str, golden: &[Vec<f64>], ours: &[Vec<f64>], tolerance: f64) {
    assert_eq!(golden.len(), ours.len(), "{what}");
    for column in 0..golden[0].len() {
        let values = || golden.iter().map(|row| row[column]);
        let range = values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min);
        for (row, (golden, ours)) in golden.iter().zip(ours).enumerate() {
            let error = (golden[column] - ours[column]).abs();
            assert!(
                error <= tolerance * range.max(1e-300),
                "{what}, row {row}, column {column}: {} for {}",
                ours[column],
                golden[column]
            );
        }
    }
}
