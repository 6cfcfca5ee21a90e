//! Tables of numbers, read a row at a time.

use std::io::{self, Read};

use csv::ByteRecord;

/// The most faults of a table that are told.
pub(super) const MOST_FAULTS: usize = 20;
/// No line of a table is longer than this, bytes.
const LONGEST_LINE: usize = 1 << 20;

/// Why a table was not read.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// What is wrong with it, each fault with its place.
    #[error("{}", .0.join("\n"))]
    Faults(Vec<String>),
    /// The system does not give it.
    #[error("{name} cannot be read: {cause}")]
    Io {
        /// The table's name.
        name: String,
        /// What the system says.
        cause: io::Error,
    },
}

/// The wanted columns of a CSV table whose first line names its columns.
///
/// Cells may be quoted, and a byte order mark is passed over. `NaN` and `inf` are numbers
/// here; whoever takes the rows decides about them.
pub struct Table<R> {
    name: String,
    reader: csv::Reader<Guard<R>>,
    record: ByteRecord,
    /// How many columns the table has.
    width: usize,
    /// The wanted ones, with their places in a line.
    columns: Vec<(String, usize)>,
    faults: Vec<String>,
    /// Whether one of the faults is an empty cell.
    has_blanks: bool,
}

impl<R: Read> Table<R> {
    /// Reads the first line of `source` and finds the `wanted` columns in it. `name` is the
    /// table's, for messages.
    ///
    /// # Errors
    /// When a column is missing or not the only one of its name, or the source cannot be
    /// read.
    pub fn open(name: &str, source: R, wanted: &[String]) -> Result<Self, TableError> {
        let mut reader = reader_of(source);
        let heads = read_heads(name, &mut reader)?;
        let faults = faults_of_heads(name, &heads, wanted);
        if !faults.is_empty() {
            return Err(TableError::Faults(faults));
        }
        let place = |column: &String| {
            heads.iter().position(|head| head == column).map(|place| (column.clone(), place))
        };
        Ok(Self {
            name: name.to_owned(),
            reader,
            record: ByteRecord::new(),
            width: heads.len(),
            columns: wanted.iter().filter_map(place).collect(),
            faults,
            has_blanks: false,
        })
    }

    /// Puts the next line's numbers into `row`, in the order in which the columns were
    /// wanted; false, and `row` untouched, after the last line.
    ///
    /// # Errors
    /// When a cell is no number: with the place of every such cell from here to the
    /// table's end, up to twenty.
    pub fn next(&mut self, row: &mut [f64]) -> Result<bool, TableError> {
        while self.advance()? {
            self.take(row);
            if self.faults.is_empty() {
                return Ok(true);
            }
            if self.faults.len() >= MOST_FAULTS {
                self.faults.push("further lines were not read".to_owned());
                break;
            }
        }
        if self.faults.is_empty() {
            return Ok(false);
        }
        if self.has_blanks {
            self.faults.push(
                "remove lines with empty cells, or write NaN where a value is missing".to_owned(),
            );
        }
        Err(TableError::Faults(std::mem::take(&mut self.faults)))
    }

    /// The number, from 1, of the line that was read last.
    pub fn line(&self) -> u64 {
        self.record.position().map_or(1, csv::Position::line)
    }

    /// How many bytes of the table were read.
    pub fn bytes(&self) -> u64 {
        self.reader.position().byte()
    }

    fn advance(&mut self) -> Result<bool, TableError> {
        self.reader.read_byte_record(&mut self.record).map_err(|fault| {
            let mut faults = std::mem::take(&mut self.faults);
            match unread(&self.name, fault) {
                TableError::Io { name, cause } if !faults.is_empty() => {
                    faults.push(format!("{name} cannot be read further: {cause}"));
                    TableError::Faults(faults)
                }
                fault => fault,
            }
        })
    }

    /// Reads the line's cells into `row`, or notes what is wrong with them.
    fn take(&mut self, row: &mut [f64]) {
        let (name, line) = (&self.name, self.line());
        let cells = self.record.len();
        if cells != self.width {
            let wanted = self.width;
            self.faults.push(format!(
                "{name}, line {line}: it has {cells} cells where the first line names {wanted} \
                 columns"
            ));
            return;
        }
        for ((column, place), number) in self.columns.iter().zip(row) {
            let cell = self.record.get(*place).unwrap_or_default();
            match number_of(cell) {
                Some(value) => *number = value,
                None if cell.trim_ascii().is_empty() => {
                    self.has_blanks = true;
                    self.faults
                        .push(format!("{name}, line {line}, column {column}: the cell is empty"));
                }
                None => self.faults.push(format!(
                    "{name}, line {line}, column {column}: {:?} is not a number",
                    clip(&cell_text(cell))
                )),
            }
        }
    }
}

/// The first names of the columns of a table, with commas between.
///
/// # Errors
/// When it cannot be read.
pub fn heads(name: &str, source: impl Read) -> Result<String, TableError> {
    Ok(clip_list(&read_heads(name, &mut reader_of(source))?))
}

fn reader_of<R: Read>(source: R) -> csv::Reader<Guard<R>> {
    csv::ReaderBuilder::new().flexible(true).from_reader(Guard { source, since_line: 0 })
}

fn read_heads<R: Read>(name: &str, reader: &mut csv::Reader<R>) -> Result<Vec<String>, TableError> {
    let heads = reader.byte_headers().map_err(|fault| unread(name, fault))?;
    Ok(heads.iter().map(|head| cell_text(head).trim().to_owned()).collect())
}

/// The number in a cell.
fn number_of(cell: &[u8]) -> Option<f64> {
    std::str::from_utf8(cell).ok()?.trim().parse().ok()
}

/// A cell as text.
fn cell_text(cell: &[u8]) -> String {
    String::from_utf8_lossy(cell).into_owned()
}

/// A text short enough for a message.
fn clip(text: &str) -> String {
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    match text.char_indices().nth(40) {
        Some((end, _)) => format!("{}…", text.get(..end).unwrap_or_default()),
        None => text,
    }
}

fn faults_of_heads(name: &str, heads: &[String], wanted: &[String]) -> Vec<String> {
    if heads.iter().all(String::is_empty) {
        return vec![format!(
            "{name} is empty: its first line should name the columns, such as {}",
            wanted.join(",")
        )];
    }
    let count = |column: &String| heads.iter().filter(|head| *head == column).count();
    let mut faults = Vec::new();
    for (index, column) in wanted.iter().enumerate() {
        if wanted.iter().take(index).any(|earlier| earlier == column) {
            faults.push(format!("{name}: the column {column} is asked for twice"));
        } else if count(column) > 1 {
            faults.push(format!("{name}, line 1: there are two columns {column}; rename one"));
        }
    }
    let missing: Vec<String> = wanted.iter().filter(|w| count(w) == 0).cloned().collect();
    if !missing.is_empty() {
        let found = clip_list(heads);
        let hint = match heads {
            [only] if only.contains([';', '\t']) => "; the cells are to be parted by commas",
            _ => "",
        };
        let (what, missing) = match &missing[..] {
            [one] => ("is no column", one.clone()),
            more => ("are no columns", more.join(",")),
        };
        faults.push(format!("{name}, line 1: there {what} {missing}, only {found}{hint}"));
    }
    faults
}

/// The first few names of a list.
fn clip_list(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(20).map(|name| clip(name)).collect();
    let more = if names.len() > shown.len() { ",…" } else { "" };
    format!("{}{more}", shown.join(","))
}

fn unread(name: &str, fault: csv::Error) -> TableError {
    match fault.into_kind() {
        csv::ErrorKind::Io(cause) => TableError::Io { name: name.to_owned(), cause },
        other => TableError::Faults(vec![format!("{name} is no readable table: {other:?}")]),
    }
}

/// Refuses what has no lines, before it fills the memory.
struct Guard<R> {
    source: R,
    /// Bytes since the last line's end.
    since_line: usize,
}

impl<R: Read> Read for Guard<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        let read = buffer.get(..count).unwrap_or_default();
        self.since_line = match read.iter().rposition(|byte| *byte == b'\n') {
            Some(end) => count - end,
            None => self.since_line + count,
        };
        if self.since_line > LONGEST_LINE {
            return Err(io::Error::other("a line is longer than 1 MiB; this is no CSV table"));
        }
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wanted(columns: &str) -> Vec<String> {
        columns.split(',').map(str::to_owned).collect()
    }

    fn rows(text: &str, columns: &str) -> Result<Vec<Vec<f64>>, String> {
        let columns = wanted(columns);
        let mut table =
            Table::open("t.csv", text.as_bytes(), &columns).map_err(|e| e.to_string())?;
        let mut row = vec![0.0; columns.len()];
        let mut rows = Vec::new();
        while table.next(&mut row).map_err(|e| e.to_string())? {
            rows.push(row.clone());
        }
        Ok(rows)
    }

    #[test]
    fn columns_are_found_by_name_in_any_order_with_marks_quotes_and_blanks() {
        let text = "\u{feff}\"b\" , a,c\r\n\"1\", 2 ,x\r\n\r\n3,4e0,\n";
        assert_eq!(rows(text, "a,b").unwrap(), [[2.0, 1.0], [4.0, 3.0]]);
        assert!(rows("a\nNaN\ninf\n", "a").unwrap()[0][0].is_nan());
        assert_eq!(rows("a\n", "a").unwrap(), [[0.0; 1]; 0]);
    }

    #[test]
    fn all_faults_are_told_with_their_places() {
        let told = rows("a,b\n1,2\nx,\n5\n6,7\n", "a,b").unwrap_err();
        let lines: Vec<&str> = told.lines().collect();
        assert_eq!(lines.len(), 4, "{told}");
        assert!(lines[0].starts_with("t.csv, line 3, column a: \"x\" is not a number"), "{told}");
        assert!(lines[1].starts_with("t.csv, line 3, column b: the cell is empty"), "{told}");
        assert!(lines[2].starts_with("t.csv, line 4: it has 1 cells"), "{told}");
        let many = "a\n".to_owned() + &"x\n".repeat(100);
        let told = rows(&many, "a").unwrap_err();
        assert_eq!(told.lines().count(), 21);
        assert!(told.ends_with("further lines were not read"));
    }

    #[test]
    fn missing_and_doubled_columns_are_told_at_once() {
        let told = rows("a,a,b\n", "a,c,d").unwrap_err();
        assert!(told.contains("two columns a") && told.contains("no columns c,d, only a,a,b"));
        assert!(rows("a;b\n1;2\n", "a").unwrap_err().contains("parted by commas"));
        assert!(rows("", "a,b").unwrap_err().contains("t.csv is empty"));
        assert!(rows("a\n", "a,a").unwrap_err().contains("asked for twice"));
    }

    #[test]
    fn what_has_no_lines_is_refused() {
        let told = Table::open("noise", io::repeat(b'x'), &wanted("a")).err().unwrap().to_string();
        assert!(told.contains("longer than 1 MiB"), "{told}");
    }
}
