//! JSON for people: a key a line, lists of numbers on one line.

use std::io::{self, Write};

use serde::Serialize;
use serde_json::ser::{CharEscape, Formatter, Serializer};

/// Lays a value out as JSON that people can read.
pub(super) fn to_vec<T: Serialize>(value: &T) -> serde_json::Result<Vec<u8>> {
    let mut text = Vec::new();
    value.serialize(&mut Serializer::with_formatter(&mut text, Layout::default()))?;
    Ok(text)
}

/// What is open: an object or a list.
#[derive(Clone, Copy, Default)]
struct Level {
    /// An element of a list is about to be written, and whether one came before it.
    pending: Option<Nth>,
    /// Whether anything in it began a line.
    has_lines: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Nth {
    First,
    Later,
}

#[derive(Default)]
struct Layout {
    levels: Vec<Level>,
}

impl Layout {
    fn new_line<W: ?Sized + Write>(&self, out: &mut W) -> io::Result<()> {
        out.write_all(b"\n")?;
        self.levels.iter().try_for_each(|_| out.write_all(b"  "))
    }

    /// A number, word or text begins: in a list it goes on in the line.
    fn plain<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        let pending = self.levels.last_mut().and_then(|level| level.pending.take());
        if pending == Some(Nth::Later) { out.write_all(b" ") } else { Ok(()) }
    }

    /// A list or object begins: in a list on a line of its own.
    fn open<W: ?Sized + Write>(&mut self, out: &mut W, mark: &[u8]) -> io::Result<()> {
        if let Some(level) = self.levels.last_mut()
            && level.pending.take().is_some()
        {
            level.has_lines = true;
            self.new_line(out)?;
        }
        self.levels.push(Level::default());
        out.write_all(mark)
    }

    fn close<W: ?Sized + Write>(&mut self, out: &mut W, mark: &[u8]) -> io::Result<()> {
        if self.levels.pop().is_some_and(|level| level.has_lines) {
            self.new_line(out)?;
        }
        out.write_all(mark)
    }
}

macro_rules! plain {
    ($($write:ident($type:ty))*) => {
        $(fn $write<W: ?Sized + Write>(&mut self, out: &mut W, value: $type) -> io::Result<()> {
            self.plain(out)?;
            Formatter::$write(&mut serde_json::ser::CompactFormatter, out, value)
        })*
    };
}

impl Formatter for Layout {
    plain! {
        write_bool(bool)
        write_i8(i8) write_i16(i16) write_i32(i32) write_i64(i64) write_i128(i128)
        write_u8(u8) write_u16(u16) write_u32(u32) write_u64(u64) write_u128(u128)
        write_f32(f32) write_f64(f64) write_number_str(&str)
    }

    fn write_null<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.plain(out)?;
        out.write_all(b"null")
    }

    fn begin_string<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.plain(out)?;
        out.write_all(b"\"")
    }

    fn write_char_escape<W: ?Sized + Write>(
        &mut self,
        out: &mut W,
        escape: CharEscape,
    ) -> io::Result<()> {
        Formatter::write_char_escape(&mut serde_json::ser::CompactFormatter, out, escape)
    }

    fn begin_array<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.open(out, b"[")
    }

    fn end_array<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.close(out, b"]")
    }

    fn begin_array_value<W: ?Sized + Write>(&mut self, out: &mut W, first: bool) -> io::Result<()> {
        if let Some(level) = self.levels.last_mut() {
            level.pending = Some(if first { Nth::First } else { Nth::Later });
        }
        if first { Ok(()) } else { out.write_all(b",") }
    }

    fn begin_object<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.open(out, b"{")
    }

    fn end_object<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        self.close(out, b"}")
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, out: &mut W, first: bool) -> io::Result<()> {
        if let Some(level) = self.levels.last_mut() {
            level.has_lines = true;
        }
        if !first {
            out.write_all(b",")?;
        }
        self.new_line(out)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, out: &mut W) -> io::Result<()> {
        out.write_all(b": ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde_json::{Value, json};

    #[test]
    fn keys_have_lines_and_numbers_share_them() {
        let value = json!({
            "a": [1.0, -2.5, null],
            "b": { "matrix": [[1, 0], [0, 1]], "empty": [], "none": {} },
            "c": [{ "x": "one\ntwo" }, { "x": true }],
        });
        let text = String::from_utf8(to_vec(&value).unwrap()).unwrap();
        let expected = r#"{
  "a": [1.0, -2.5, null],
  "b": {
    "empty": [],
    "matrix": [
      [1, 0],
      [0, 1]
    ],
    "none": {}
  },
  "c": [
    {
      "x": "one\ntwo"
    },
    {
      "x": true
    }
  ]
}"#;
        assert_eq!(text, expected);
    }

    fn value() -> impl Strategy<Value = Value> {
        let leaf = prop_oneof![
            Just(Value::Null),
            any::<bool>().prop_map(Value::from),
            proptest::num::f64::NORMAL.prop_map(Value::from),
            any::<u64>().prop_map(Value::from),
            ".{0,6}".prop_map(Value::from),
        ];
        leaf.prop_recursive(3, 24, 4, |inner| {
            prop_oneof![
                proptest::collection::vec(inner.clone(), 0..4).prop_map(Value::from),
                proptest::collection::btree_map(".{0,3}", inner, 0..4)
                    .prop_map(|map| Value::Object(map.into_iter().collect())),
            ]
        })
    }

    proptest! {
        #[test]
        fn whatever_is_laid_out_reads_back_the_same(value in value()) {
            let text = to_vec(&value).unwrap();
            let back: Value = serde_json::from_slice(&text).unwrap();
            prop_assert_eq!(back, value);
        }
    }
}
